//! The ROS 2 messages that clips are read from, field by field as their `.msg` definitions list them.
//!
//! Units are those of the definitions: rad, rad/s, N m, m; quaternions are `x, y, z, w` on the wire and `w, x, y, z` here.

use super::cdr::{CdrError, CdrReader};
use crate::msg::image::CameraInfo;

/// Type names of the messages that are told apart by type alone.
pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const COMPRESSED_IMAGE: &str = "sensor_msgs/msg/CompressedImage";
pub(super) const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

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

    /// As the project's payload; a sentence for a lens that five coefficients do not describe. The pose is not known.
    pub(super) fn camera_info(&self) -> Result<CameraInfo, String> {
        let (used, beyond) = self.d.split_at_checked(5).unwrap_or((&self.d, &[]));
        let bent = self.d.iter().any(|d| *d != 0.0);
        if beyond.iter().any(|d| *d != 0.0) || (bent && !matches!(self.model, "plumb_bob" | "rational_polynomial")) {
            return Err(format!("the lens model `{}` is not plumb_bob; calibrate with plumb_bob", self.model));
        }
        let mut distortion = [0.0; 5];
        for (out, d) in distortion.iter_mut().zip(used) {
            *out = *d;
        }
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

/// `std_msgs/msg/Header`: stamp [ns] and frame.
fn header<'a>(r: &mut CdrReader<'a>) -> Result<(u64, &'a str), CdrError> {
    let seconds = u64::try_from(r.i32()?).unwrap_or(0);
    let nanoseconds = u64::from(r.u32()?);
    Ok((seconds * 1_000_000_000 + nanoseconds, r.text()?))
}
