//! Object, camera, wrench, gripper and events: `/object/pose`, `/camera/*`, `/wrench`, `/gripper`, `/events`.

use super::proto::{foxglove, twinalign};
use super::{UnixClock, Wire, array};
use crate::msg::event::{Event, EventLevel, EventSource};
use crate::msg::gripper::GripperState;
use crate::msg::image::{CameraInfo, ImageHeader, PixelEncoding, StampDomain};
use crate::msg::object::{NamedPose, ObjectName, ObjectPose};
use crate::msg::wrench::Wrench;
use crate::topics;
use prost::Message as _;
use prost::encoding::{WireType, encode_key, encode_varint};

/// Name of the camera's frame, as Foxglove shows it. That of the base is the cell's, which the writer of a clip knows.
const CAMERA: &str = "camera";
/// Field number of the pixels in `foxglove.RawImage`.
const PIXELS: u32 = 6;

impl Wire for ObjectPose {
    const TOPIC: &'static str = topics::OBJECT_POSE.name;
    const SCHEMA: &'static str = "foxglove.PoseInFrame";
    type Message = foxglove::PoseInFrame;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, clock: UnixClock) -> foxglove::PoseInFrame {
        let [x, y, z] = self.position;
        let [qw, qx, qy, qz] = self.wxyz;
        let known = self.covariance.iter().any(|v| *v != 0.0);
        foxglove::PoseInFrame {
            timestamp: clock.timestamp(self.stamp_ns),
            frame_id: String::new(),
            pose: Some(foxglove::Pose {
                position: Some(foxglove::Vector3 { x, y, z }),
                orientation: Some(foxglove::Quaternion { x: qx, y: qy, z: qz, w: qw }),
            }),
            twinalign: Some(twinalign::ObjectPoseDetail {
                stamp_ns: self.stamp_ns,
                device_ns: self.device_ns,
                sequence: self.sequence,
                covariance: if known { self.covariance.to_vec() } else { Vec::new() },
                name: String::new(),
            }),
        }
    }

    fn from_wire(m: foxglove::PoseInFrame) -> Self {
        let pose = m.pose.unwrap_or_default();
        let p = pose.position.unwrap_or_default();
        let q = pose.orientation.unwrap_or_default();
        let detail = m.twinalign.unwrap_or_default();
        Self {
            stamp_ns: detail.stamp_ns,
            device_ns: detail.device_ns,
            sequence: detail.sequence,
            position: [p.x, p.y, p.z],
            wxyz: [q.w, q.x, q.y, q.z],
            covariance: array(&detail.covariance),
        }
    }
}

impl Wire for NamedPose {
    const TOPIC: &'static str = topics::OBJECT_POSES.name;
    const SCHEMA: &'static str = ObjectPose::SCHEMA;
    type Message = foxglove::PoseInFrame;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, clock: UnixClock) -> foxglove::PoseInFrame {
        let mut message = Wire::to_wire(&self.unnamed(), clock);
        if let Some(detail) = &mut message.twinalign {
            self.name.text().clone_into(&mut detail.name);
        }
        message
    }

    fn from_wire(m: foxglove::PoseInFrame) -> Self {
        let name = m.twinalign.as_ref().and_then(|detail| ObjectName::new(&detail.name)).unwrap_or_default();
        Self::new(name, &<ObjectPose as Wire>::from_wire(m))
    }
}

impl Wire for CameraInfo {
    const TOPIC: &'static str = topics::CAMERA_INFO.name;
    const SCHEMA: &'static str = "foxglove.CameraCalibration";
    type Message = foxglove::CameraCalibration;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, clock: UnixClock) -> foxglove::CameraCalibration {
        let [fx, fy, cx, cy] = self.intrinsics;
        foxglove::CameraCalibration {
            timestamp: clock.timestamp(self.stamp_ns),
            width: self.width,
            height: self.height,
            distortion_model: "plumb_bob".into(),
            d: self.distortion.to_vec(),
            k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            frame_id: CAMERA.into(),
            twinalign: Some(twinalign::CameraDetail {
                stamp_ns: self.stamp_ns,
                position: self.position.to_vec(),
                orientation: self.wxyz.to_vec(),
            }),
        }
    }

    fn from_wire(m: foxglove::CameraCalibration) -> Self {
        let [fx, _, cx, _, fy, cy, ..] = array::<9>(&m.k);
        let detail = m.twinalign.unwrap_or_default();
        Self {
            stamp_ns: detail.stamp_ns,
            width: m.width,
            height: m.height,
            intrinsics: [fx, fy, cx, cy],
            distortion: array(&m.d),
            position: array(&detail.position),
            wxyz: array(&detail.orientation),
        }
    }
}

impl Wire for Wrench {
    const TOPIC: &'static str = topics::WRENCH.name;
    const SCHEMA: &'static str = "twinalign.Wrench";
    type Message = twinalign::Wrench;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> twinalign::Wrench {
        twinalign::Wrench {
            stamp_ns: self.stamp_ns,
            device_ns: self.device_ns,
            sequence: self.sequence,
            force: self.force.to_vec(),
            torque: self.torque.to_vec(),
            saturated: self.saturated,
        }
    }

    fn from_wire(m: twinalign::Wrench) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            device_ns: m.device_ns,
            sequence: m.sequence,
            force: array(&m.force),
            torque: array(&m.torque),
            saturated: m.saturated,
            reserved: 0,
        }
    }
}

impl Wire for GripperState {
    const TOPIC: &'static str = topics::GRIPPER.name;
    const SCHEMA: &'static str = "twinalign.GripperState";
    type Message = twinalign::GripperState;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> twinalign::GripperState {
        twinalign::GripperState {
            stamp_ns: self.stamp_ns,
            width: self.width,
            width_d: self.width_d,
            force: self.force,
            grasped: self.grasped != 0,
            fault: self.fault,
        }
    }

    fn from_wire(m: twinalign::GripperState) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            width: m.width,
            width_d: m.width_d,
            force: m.force,
            grasped: u32::from(m.grasped),
            fault: m.fault,
        }
    }
}

impl Wire for Event {
    const TOPIC: &'static str = topics::EVENTS.name;
    const SCHEMA: &'static str = "foxglove.Log";
    type Message = foxglove::Log;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, clock: UnixClock) -> foxglove::Log {
        let name = match self.source {
            EventSource::Bridge => "bridge",
            EventSource::Recorder => "recorder",
            EventSource::Twin => "twin",
            EventSource::Capture => "capture",
        };
        foxglove::Log {
            timestamp: clock.timestamp(self.stamp_ns),
            level: self.level as i32,
            message: self.text().into(),
            name: name.into(),
            file: String::new(),
            line: 0,
            twinalign: Some(twinalign::EventDetail { stamp_ns: self.stamp_ns, source: self.source as i32 }),
        }
    }

    fn from_wire(m: foxglove::Log) -> Self {
        use foxglove::log::Level;
        use twinalign::event_detail::Source;
        let level = match m.level() {
            Level::Unknown | Level::Debug | Level::Info => EventLevel::Info,
            Level::Warning => EventLevel::Warning,
            Level::Error | Level::Fatal => EventLevel::Error,
        };
        let detail = m.twinalign.unwrap_or_default();
        let source = match detail.source() {
            Source::Bridge => EventSource::Bridge,
            Source::Recorder => EventSource::Recorder,
            Source::Twin => EventSource::Twin,
            Source::Capture => EventSource::Capture,
        };
        Self { stamp_ns: detail.stamp_ns, ..Self::new(level, source, &m.message) }
    }
}

/// Full name of the pictures' schema.
pub(in super::super) const IMAGE_SCHEMA: &str = "foxglove.RawImage";

/// Appends a picture as `foxglove.RawImage` to `out`. The pixels are copied once: they are appended by hand, because a
/// message struct would want its own copy.
pub(in super::super) fn image_to_wire(header: &ImageHeader, pixels: &[u8], clock: UnixClock, out: &mut Vec<u8>) {
    let image = foxglove::RawImage {
        timestamp: clock.timestamp(header.stamp_ns),
        width: header.width,
        height: header.height,
        encoding: header.encoding.name().into(),
        step: header.stride,
        data: Vec::new(),
        frame_id: CAMERA.into(),
        twinalign: Some(twinalign::ImageDetail {
            stamp_ns: header.stamp_ns,
            device_ns: header.device_ns,
            sequence: header.sequence,
            exposure_ns: header.exposure_ns,
            depth_scale: header.depth_scale,
            stamp_domain: header.stamp_domain as i32,
        }),
    };
    out.extend(image.encode_to_vec());
    encode_key(PIXELS, WireType::LengthDelimited, out);
    encode_varint(pixels.len() as u64, out);
    out.extend_from_slice(pixels);
}

/// Header and pixels of a `foxglove.RawImage`; `None` for a pixel format that twinalign never writes.
pub(in super::super) fn image_from_wire(m: foxglove::RawImage) -> Option<(ImageHeader, Vec<u8>)> {
    use twinalign::image_detail::StampDomain as WireDomain;
    let detail = m.twinalign.unwrap_or_default();
    let header = ImageHeader {
        stamp_ns: detail.stamp_ns,
        device_ns: detail.device_ns,
        sequence: detail.sequence,
        exposure_ns: detail.exposure_ns,
        width: m.width,
        height: m.height,
        stride: m.step,
        encoding: PixelEncoding::from_name(&m.encoding)?,
        depth_scale: detail.depth_scale,
        stamp_domain: match detail.stamp_domain() {
            WireDomain::HardwareClock => StampDomain::HardwareClock,
            WireDomain::SystemTime => StampDomain::SystemTime,
            WireDomain::GlobalTime => StampDomain::GlobalTime,
        },
        reserved: 0,
    };
    Some((header, m.data))
}
