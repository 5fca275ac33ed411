//! The ROS 2 messages that clips are read from, field by field as their `.msg` definitions list them.
//!
//! Units are those of the definitions: rad, rad/s, N m, m; quaternions are `x, y, z, w` on the wire and `w, x, y, z` here.

use super::cdr::{CdrError, CdrReader};

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

/// `std_msgs/msg/Header`: stamp [ns] and frame.
fn header<'a>(r: &mut CdrReader<'a>) -> Result<(u64, &'a str), CdrError> {
    let seconds = u64::try_from(r.i32()?).unwrap_or(0);
    let nanoseconds = u64::from(r.u32()?);
    Ok((seconds * 1_000_000_000 + nanoseconds, r.text()?))
}
