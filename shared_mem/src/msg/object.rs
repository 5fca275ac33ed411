//! Pose of the tracked object, whoever tracks it.

use super::check::{self, Wrong};
use super::wire::plain;
use crate::frames::{Base, Object, Pose};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// The object's geometric centre in the base frame. Topic `/object/pose`.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/ObjectPose/1")]
#[repr(C)]
pub struct ObjectPose {
    /// When the picture behind it, or where nobody knows that, the pose arrived here: monotonic clock [ns]. One latency of
    /// cell.toml's camera after the object was there.
    pub stamp_ns: u64,
    /// When the picture behind it was taken, by the camera's clock [ns].
    pub device_ns: u64,
    /// Counts the poses of one tracker.
    pub sequence: u64,
    /// Position in the base frame [m].
    pub position: [f64; 3],
    /// Orientation in the base frame, `w, x, y, z`.
    pub wxyz: [f64; 4],
    /// Row-major covariance of position [m²] and small rotation about the base axes [rad²]: x, y, z, rx, ry, rz. All 0: not known.
    pub covariance: [f64; 36],
}

impl Default for ObjectPose {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            device_ns: 0,
            sequence: 0,
            position: [0.0; 3],
            wxyz: [1.0, 0.0, 0.0, 0.0],
            covariance: [0.0; 36],
        }
    }
}

impl ObjectPose {
    /// The pose with its frames named; `None` when the numbers are no pose.
    #[must_use]
    pub fn pose(&self) -> Option<Pose<Base, Object>> {
        Pose::from_parts(self.position, self.wxyz)
    }

    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("device_ns", self.device_ns)?;
        check::running("sequence", self.sequence)?;
        check::numbers("position", &self.position)?;
        check::quaternion("wxyz", &self.wxyz)?;
        check::numbers("covariance", &self.covariance)
    }
}

plain!(ObjectPose);
