//! The ROS 2 messages that clips are read from, field by field as their `.msg` definitions list them.
//!
//! Units are those of the definitions: rad, rad/s, N m, m; quaternions are `x, y, z, w` on the wire and `w, x, y, z` here.

use super::cdr::{CdrError, CdrReader};
use crate::lens::Distortion;
use crate::lens::calibration::Calibration;
use crate::lens::coefficients::of_list;
use crate::msg::image::CameraInfo;

/// Type names of the messages that are told apart by type alone.
pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const COMPRESSED_IMAGE: &str = "sensor_msgs/msg/CompressedImage";
pub(super) const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

/// Types of devices and remarks.
pub(super) const WRENCH: &str = "geometry_msgs/msg/WrenchStamped";
pub(super) const TEXT: &str = "std_msgs/msg/String";
pub(super) const LOG: &str = "rcl_interfaces/msg/Log";
/// Joint of a gripper's `JointState`: its position is the width between the fingers.
pub(super) const GRIPPER_JOINT: &str = "gripper_width";

/// `sensor_msgs/msg/JointState`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointState<'a> {
    /// Stamp of the header [ns].
    pub(super) stamp_ns: u64,
    /// Joint names; empty where the publisher left them out.
    pub(super) names: Vec<&'a str>,
    /// [rad]
    pub(super) position: Vec<f64>,
    /// [rad/s]; may be empty.
    pub(super) velocity: Vec<f64>,
    /// [N m]; may be empty.
    pub(super) effort: Vec<f64>,
}

impl<'a> JointState<'a> {
    pub(super) const TYPE: &'static str = "sensor_msgs/msg/JointState";

    pub(super) fn decode(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut r = CdrReader::new(message)?;
        let (stamp_ns, _frame) = header(&mut r)?;
        Ok(Self {
            stamp_ns,
            names: r.text_sequence()?,
            position: r.f64_sequence()?,
            velocity: r.f64_sequence()?,
            effort: r.f64_sequence()?,
        })
    }
}

/// `geometry_msgs/msg/PoseStamped` or `TransformStamped`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StampedPose<'a> {
    /// Stamp of the header [ns].
    pub(super) stamp_ns: u64,
    /// Frame that the pose is given in.
    pub(super) frame: &'a str,
    /// [m]
    pub(super) position: [f64; 3],
    /// `w, x, y, z`
    pub(super) wxyz: [f64; 4],
}

impl<'a> StampedPose<'a> {
    pub(super) const POSE_TYPE: &'static str = "geometry_msgs/msg/PoseStamped";
    pub(super) const TRANSFORM_TYPE: &'static str = "geometry_msgs/msg/TransformStamped";

    /// Decodes either type; `has_child` says that the name of a child frame precedes the numbers (`TransformStamped`).
    pub(super) fn decode(message: &'a [u8], has_child: bool) -> Result<Self, CdrError> {
        let mut r = CdrReader::new(message)?;
        let (stamp_ns, frame) = header(&mut r)?;
        if has_child {
            r.text()?;
        }
        let position = r.f64_array()?;
        let [x, y, z, w] = r.f64_array()?;
        Ok(Self { stamp_ns, frame, position, wxyz: [w, x, y, z] })
    }
}

/// `sensor_msgs/msg/Image`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Image<'a> {
    /// Stamp of the header [ns].
    pub(super) stamp_ns: u64,
    pub(super) height: u32,
    pub(super) width: u32,
    /// `rgb8`, `16UC1`, ...
    pub(super) encoding: &'a str,
    pub(super) is_big_endian: bool,
    /// Bytes from row to row.
    pub(super) step: u32,
    pub(super) data: &'a [u8],
}

impl<'a> Image<'a> {
    pub(super) fn decode(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut r = CdrReader::new(message)?;
        let (stamp_ns, _frame) = header(&mut r)?;
        Ok(Self {
            stamp_ns,
            height: r.u32()?,
            width: r.u32()?,
            encoding: r.text()?,
            is_big_endian: r.u8()? != 0,
            step: r.u32()?,
            data: r.byte_sequence()?,
        })
    }
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CompressedImage<'a> {
    /// Stamp of the header [ns].
    pub(super) stamp_ns: u64,
    /// `jpeg`, `png`, `16UC1; compressedDepth png`, ...
    pub(super) format: &'a str,
    pub(super) data: &'a [u8],
}

impl<'a> CompressedImage<'a> {
    pub(super) fn decode(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut r = CdrReader::new(message)?;
        let (stamp_ns, _frame) = header(&mut r)?;
        Ok(Self { stamp_ns, format: r.text()?, data: r.byte_sequence()? })
    }
}

/// `sensor_msgs/msg/CameraInfo`, up to its intrinsics.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CameraCalibration<'a> {
    /// Stamp of the header [ns].
    pub(super) stamp_ns: u64,
    pub(super) height: u32,
    pub(super) width: u32,
    /// `plumb_bob`, `rational_polynomial`, ...
    pub(super) model: &'a str,
    pub(super) d: Vec<f64>,
    /// Row-major 3x3.
    pub(super) k: [f64; 9],
}

impl<'a> CameraCalibration<'a> {
    pub(super) fn decode(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut r = CdrReader::new(message)?;
        let (stamp_ns, _frame) = header(&mut r)?;
        Ok(Self {
            stamp_ns,
            height: r.u32()?,
            width: r.u32()?,
            model: r.text()?,
            d: r.f64_sequence()?,
            k: r.f64_array()?,
        })
    }

    /// The camera; a sentence for a lens that is not read. `None` where nobody calibrated it: all of its numbers are 0.
    pub(super) fn calibration(&self) -> Result<Option<Calibration>, String> {
        let [fx, _, cx, _, fy, cy, ..] = self.k;
        if [fx, fy] == [0.0; 2] {
            return Ok(None);
        }
        let size = [self.width as usize, self.height as usize];
        Ok(Some(Calibration {
            pinhole: Some([fx, fy, cx, cy]),
            distortion: of_list(Some(self.model), &self.d)?,
            size: (size != [0; 2]).then_some(size),
            is_unnamed: false,
        }))
    }

    /// As the project's payload; a sentence for a lens that five coefficients do not describe. The pose is not known.
    pub(super) fn camera_info(&self) -> Result<CameraInfo, String> {
        let is_bent = self.d.iter().any(|d| *d != 0.0);
        let lens = if is_bent { of_list(Some(self.model), &self.d)? } else { Distortion::NONE };
        let distortion = lens.as_brown().ok_or_else(|| {
            format!(
                "the lens model is `{}`, and a clip holds the five numbers of plumb_bob alone: leave this topic out of the bag \
                 (`ros2 bag convert`) and put the lens into `[camera] distortion` of cell.toml",
                self.model
            )
        })?;
        let [fx, _, cx, _, fy, cy, ..] = self.k;
        let intrinsics = [fx, fy, cx, cy];
        Ok(CameraInfo {
            stamp_ns: self.stamp_ns,
            width: self.width,
            height: self.height,
            intrinsics,
            distortion,
            ..CameraInfo::default()
        })
    }
}

/// `geometry_msgs/msg/WrenchStamped`: stamp [ns], force [N] and torque [N m].
pub(super) fn wrench(message: &[u8]) -> Result<(u64, [f64; 3], [f64; 3]), CdrError> {
    let mut r = CdrReader::new(message)?;
    let (stamp_ns, _frame) = header(&mut r)?;
    Ok((stamp_ns, r.f64_array()?, r.f64_array()?))
}

/// `rcl_interfaces/msg/Log`, up to its text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Log<'a> {
    /// [ns]
    pub(super) stamp_ns: u64,
    /// 10 debug, 20 info, 30 warning, 40 error, 50 fatal.
    pub(super) level: u8,
    /// Who speaks.
    pub(super) name: &'a str,
    pub(super) text: &'a str,
}

impl<'a> Log<'a> {
    pub(super) fn decode(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut r = CdrReader::new(message)?;
        let stamp_ns = stamp(&mut r)?;
        Ok(Self { stamp_ns, level: r.u8()?, name: r.text()?, text: r.text()? })
    }
}

/// `std_msgs/msg/Header`: stamp [ns] and frame.
fn header<'a>(r: &mut CdrReader<'a>) -> Result<(u64, &'a str), CdrError> {
    Ok((stamp(r)?, r.text()?))
}

/// `builtin_interfaces/msg/Time` [ns].
fn stamp(r: &mut CdrReader<'_>) -> Result<u64, CdrError> {
    let seconds = u64::try_from(r.i32()?).unwrap_or(0);
    Ok(seconds * 1_000_000_000 + u64::from(r.u32()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Encodes like `rmw` does: every primitive aligned to its size behind the four bytes of the header.
    #[derive(Default)]
    struct Encoder {
        payload: Vec<u8>,
        big_endian: bool,
    }

    impl Encoder {
        fn put<const N: usize>(&mut self, mut bytes: [u8; N]) -> &mut Self {
            while !self.payload.len().is_multiple_of(N) {
                self.payload.push(0);
            }
            if self.big_endian {
                bytes.reverse();
            }
            self.payload.extend(bytes);
            self
        }

        fn u32(&mut self, value: usize) -> &mut Self {
            self.put(u32::try_from(value).expect("a small number").to_le_bytes())
        }

        fn text(&mut self, text: &str) -> &mut Self {
            self.u32(text.len() + 1);
            self.payload.extend(text.as_bytes());
            self.payload.push(0);
            self
        }

        fn doubles(&mut self, values: &[f64]) -> &mut Self {
            self.u32(values.len());
            values.iter().for_each(|v| {
                self.put(v.to_le_bytes());
            });
            self
        }

        fn message(&self) -> Vec<u8> {
            let mut message = vec![0, u8::from(!self.big_endian), 0, 0];
            message.extend(&self.payload);
            message
        }
    }

    fn joint_state(names: &[String], position: &[f64], velocity: &[f64], big_endian: bool) -> Vec<u8> {
        let mut e = Encoder { big_endian, ..Encoder::default() };
        e.u32(12).u32(34).text("base").u32(names.len());
        names.iter().for_each(|name| {
            e.text(name);
        });
        e.doubles(position).doubles(velocity).doubles(&[]);
        e.message()
    }

    proptest! {
        #[test]
        fn joint_states_come_back_in_either_byte_order_whatever_the_lengths(
            names in prop::collection::vec("[a-z_0-9]{0,9}", 0..9),
            position in prop::collection::vec(-10.0..10.0f64, 0..9),
            velocity in prop::collection::vec(-10.0..10.0f64, 0..9),
            big_endian in any::<bool>(),
        ) {
            let bytes = joint_state(&names, &position, &velocity, big_endian);
            let state = JointState::decode(&bytes).expect("a whole message");
            prop_assert_eq!(state.stamp_ns, 12_000_000_034);
            prop_assert_eq!(state.names, names);
            prop_assert_eq!(state.position, position);
            prop_assert_eq!(state.velocity, velocity);
            prop_assert_eq!(state.effort, Vec::<f64>::new());
        }

        #[test]
        fn a_cut_message_is_an_error_and_never_a_panic(cut in 0usize..200) {
            let bytes = joint_state(&["a".into(), "bc".into()], &[1.0, 2.0], &[3.0, 4.0], false);
            let cut = cut.min(bytes.len() - 1);
            prop_assert!(JointState::decode(&bytes[..cut]).is_err());
        }

        #[test]
        fn random_bytes_never_panic(
            mut bytes in prop::collection::vec(any::<u8>(), 0..300), header in any::<bool>(), child in any::<bool>(),
        ) {
            if header && bytes.len() >= 4 {
                bytes[..4].copy_from_slice(&[0, 1, 0, 0]);
            }
            let _ = JointState::decode(&bytes);
            let _ = StampedPose::decode(&bytes, child);
            let _ = Image::decode(&bytes);
            let _ = CompressedImage::decode(&bytes);
            let _ = CameraCalibration::decode(&bytes).map(|c| c.camera_info());
            let _ = wrench(&bytes);
            let _ = Log::decode(&bytes);
        }
    }

    #[test]
    fn a_pose_has_its_quaternion_turned_round() {
        let mut e = Encoder::default();
        e.u32(1).u32(0).text("base");
        [0.1, 0.2, 0.3, 0.0, 0.0, 0.6, 0.8f64].iter().for_each(|v| {
            e.put(v.to_le_bytes());
        });
        let message = e.message();
        let pose = StampedPose::decode(&message, false).expect("a whole message");
        assert_eq!((pose.frame, pose.position), ("base", [0.1, 0.2, 0.3]));
        assert_eq!(pose.wxyz, [0.8, 0.0, 0.0, 0.6]);
    }

    #[test]
    fn a_camera_info_yields_intrinsics_and_refuses_a_fisheye() {
        let camera = |model, d: Vec<f64>| CameraCalibration {
            stamp_ns: 5,
            height: 480,
            width: 640,
            model,
            d,
            k: [600.0, 0.0, 320.0, 0.0, 610.0, 240.0, 0.0, 0.0, 1.0],
        };
        let info = camera("plumb_bob", vec![0.1, 0.2, 0.0, 0.0, 0.3]).camera_info().expect("a pinhole");
        assert_eq!((info.intrinsics, info.distortion), ([600.0, 610.0, 320.0, 240.0], [0.1, 0.2, 0.0, 0.0, 0.3]));
        let fisheye = camera("equidistant", vec![0.1; 4]);
        assert!(fisheye.camera_info().is_err_and(|line| line.contains("`equidistant`") && !line.contains("more than")));
        let read = fisheye.calibration().expect("a lens").expect("a camera");
        assert_eq!(
            (read.pinhole, read.distortion),
            (Some([600.0, 610.0, 320.0, 240.0]), Distortion::Fisheye([0.1; 4]))
        );
        assert!(camera("rational_polynomial", vec![0.1; 8]).camera_info().is_err());
    }
}
