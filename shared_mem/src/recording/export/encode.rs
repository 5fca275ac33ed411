//! ROS 2 messages as bytes: the other direction of [`super::super::ros2`].

use super::super::cdr::CdrWriter;
use super::super::picture::Picture;
use super::super::robot::Transform;
use super::super::ros2;
use crate::msg::event::{Event, EventLevel, EventSource};
use crate::msg::image::{CameraInfo, PixelEncoding};
use crate::msg::wrench::Wrench;

/// Depth counts of this many metres are what `16UC1` means in ROS.
const MILLIMETRE: f64 = 1e-3;
/// Optical frame of the pictures in a ROS 2 bag: z forward, x right, y down.
pub(super) const ROS_CAMERA_FRAME: &str = "camera_color_optical_frame";
/// Types of texts and of frames.
pub(super) const TEXT: &str = ros2::TEXT;
pub(super) const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

/// `builtin_interfaces/Time`, which ends in 2038.
fn stamp(stamp_ns: u64) -> CdrWriter {
    stamped(CdrWriter::default(), stamp_ns)
}

fn stamped(message: CdrWriter, stamp_ns: u64) -> CdrWriter {
    let seconds = i32::try_from(stamp_ns / 1_000_000_000).unwrap_or(i32::MAX);
    message.u32(seconds.cast_unsigned()).u32((stamp_ns % 1_000_000_000) as u32)
}

fn header(stamp_ns: u64, frame: &str) -> CdrWriter {
    stamp(stamp_ns).text(frame)
}

/// `sensor_msgs/JointState`; a quantity that was not logged is an empty slice.
pub(super) fn joint_state(stamp_ns: u64, names: &[String], [q, dq, tau]: [&[f64]; 3]) -> Vec<u8> {
    let names = names.iter().map(String::as_str);
    header(stamp_ns, "").text_sequence(names).f64_sequence(q).f64_sequence(dq).f64_sequence(tau).message()
}

/// `geometry_msgs/PoseStamped`.
pub(super) fn pose(stamp_ns: u64, frame: &str, position: [f64; 3], [w, x, y, z]: [f64; 4]) -> Vec<u8> {
    header(stamp_ns, frame).f64s(&position).f64s(&[x, y, z, w]).message()
}

/// `std_msgs/String`.
pub(super) fn text(text: &str) -> Vec<u8> {
    CdrWriter::default().text(text).message()
}

/// `tf2_msgs/TFMessage`.
pub(super) fn transforms(stamp_ns: u64, transforms: &[Transform]) -> Vec<u8> {
    let count = u32::try_from(transforms.len()).unwrap_or(u32::MAX);
    let one = |message: CdrWriter, Transform { parent, child, position, wxyz: [w, x, y, z] }: &Transform| {
        stamped(message, stamp_ns).text(parent).text(child).f64s(position).f64s(&[*x, *y, *z, *w])
    };
    transforms.iter().fold(CdrWriter::default().u32(count), one).message()
}

/// `geometry_msgs/WrenchStamped`.
pub(super) fn wrench(stamp_ns: u64, frame: &str, wrench: &Wrench) -> Vec<u8> {
    header(stamp_ns, frame).f64s(&wrench.force).f64s(&wrench.torque).message()
}

/// Type and bytes of a picture. Depth in other steps than millimetres becomes metres in single precision.
pub(super) fn picture(stamp_ns: u64, picture: &Picture) -> (&'static str, Vec<u8>) {
    match picture {
        Picture::Compressed { format, bytes, .. } => {
            (ros2::COMPRESSED_IMAGE, header(stamp_ns, ROS_CAMERA_FRAME).text(format).byte_sequence(bytes).message())
        }
        Picture::Pixels { header: head, pixels } => {
            let counts = head.encoding == PixelEncoding::Depth16;
            let metres = counts && (head.depth_scale - MILLIMETRE).abs() > 1e-9;
            let (encoding, step, data) = if metres {
                let count = |pair: &[u8]| (f64::from(u16::from_le_bytes([pair[0], pair[1]])) * head.depth_scale) as f32;
                let data = pixels.chunks_exact(2).flat_map(|pair| count(pair).to_le_bytes()).collect();
                ("32FC1", 2 * head.stride, std::borrow::Cow::Owned(data))
            } else {
                (head.encoding.name(), head.stride, std::borrow::Cow::Borrowed(pixels))
            };
            let message = header(stamp_ns, ROS_CAMERA_FRAME).u32(head.height).u32(head.width).text(encoding).u8(0);
            (ros2::IMAGE, message.u32(step).byte_sequence(&data).message())
        }
    }
}

/// `sensor_msgs/CameraInfo`.
pub(super) fn camera_info(stamp_ns: u64, info: &CameraInfo) -> Vec<u8> {
    let [fx, fy, cx, cy] = info.intrinsics;
    header(stamp_ns, ROS_CAMERA_FRAME)
        .u32(info.height)
        .u32(info.width)
        .text("plumb_bob")
        .f64_sequence(&info.distortion)
        .f64s(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])
        .f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
        .f64s(&[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0])
        .u32(0)
        .u32(0)
        .u32(0)
        .u32(0)
        .u32(0)
        .u32(0)
        .u8(0)
        .message()
}

/// `rcl_interfaces/Log`.
pub(super) fn log(stamp_ns: u64, event: &Event) -> Vec<u8> {
    let level = match event.level {
        EventLevel::Info => 20,
        EventLevel::Warning => 30,
        EventLevel::Error => 40,
    };
    let name = match event.source {
        EventSource::Bridge => "bridge",
        EventSource::Recorder => "recorder",
        EventSource::Twin => "twin",
        EventSource::Capture => "capture",
    };
    stamp(stamp_ns).u8(level).text(name).text(event.text()).text("").text("").u32(0).message()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn joints_poses_and_wrenches_come_back_bit_by_bit(
            stamp_ns in 0_u64..2_147_483_648_000_000_000,
            names in prop::collection::vec("[a-z_0-9]{0,9}", 0..9),
            q in prop::collection::vec(any::<f64>(), 0..9),
            dq in prop::collection::vec(any::<f64>(), 0..9),
            wxyz: [f64; 4],
            six: [f64; 6],
        ) {
            let bytes = joint_state(stamp_ns, &names, [&q, &dq, &[]]);
            let read = ros2::JointState::decode(&bytes).expect("own bytes");
            prop_assert_eq!((read.stamp_ns, &read.names), (stamp_ns, &names.iter().map(String::as_str).collect()));
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!([bits(&read.position), bits(&read.velocity), bits(&read.effort)], [bits(&q), bits(&dq), vec![]]);
            let [a, b, c, d, e, f] = six;
            let bytes = pose(stamp_ns, "base", [a, b, c], wxyz);
            let read = ros2::StampedPose::decode(&bytes, false).expect("own bytes");
            prop_assert_eq!([bits(&read.position), bits(&read.wxyz)], [bits(&[a, b, c]), bits(&wxyz)]);
            let sample = Wrench { force: [a, b, c], torque: [d, e, f], ..Wrench::default() };
            let (read_ns, force, torque) = ros2::wrench(&wrench(stamp_ns, "flange", &sample)).expect("own bytes");
            prop_assert_eq!((read_ns, bits(&force), bits(&torque)), (stamp_ns, bits(&[a, b, c]), bits(&[d, e, f])));
        }

        #[test]
        fn a_remark_comes_back(stamp_ns in 0_u64..2_147_483_648_000_000_000, text in "[ -~]{0,200}") {
            let bytes = log(stamp_ns, &Event::new(EventLevel::Warning, EventSource::Twin, &text));
            let read = ros2::Log::decode(&bytes).expect("own bytes");
            prop_assert_eq!(read, ros2::Log { stamp_ns, level: 30, name: "twin", text: &text });
        }
    }
}
