//! Where arm and gripper are to go now: streams of targets from whoever steers, planned by the bridge.
//!
//! A sender chooses a stream id of its own and repeats its target at any rate, twenty times a second or more. The bridge
//! plans the way inside the limits of the arm, anew with each target. A stream that falls silent for [`SILENCE_NS`] is
//! over: the arm is braked and holds.

use super::check::{self, Wrong};
use super::wire::{codes, plain, wire};
use super::{Joints, MAX_JOINTS};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// How long a stream may be silent [ns]. Older targets do not count.
pub const SILENCE_NS: u64 = 200_000_000;

/// Where the arm is to go. Topic `/arm/target`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmTarget {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Chosen by the sender, not 0; a stream that was braked needs another one to go on. Seen as `motion_id` of
    /// [`super::arm::ArmState`].
    pub stream: u64,
    /// What counts, joints or pose.
    pub kind: TargetKind,
    /// Number of joints that count.
    pub dof: u32,
    /// Share of the highest speed of each joint that may be used, up to 1; 0: a quarter.
    pub speed: f64,
    /// Joint positions, for [`TargetKind::Joints`] [rad].
    pub q: Joints,
    /// Origin of the flange in the base frame, for [`TargetKind::Pose`] [m].
    pub position: [f64; 3],
    /// Flange's axes in the base frame, for [`TargetKind::Pose`]: unit quaternion w, x, y, z.
    pub wxyz: [f64; 4],
}

impl Default for ArmTarget {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            stream: 0,
            kind: TargetKind::Joints,
            dof: 0,
            speed: 0.0,
            q: [0.0; MAX_JOINTS],
            position: [0.0; 3],
            wxyz: [1.0, 0.0, 0.0, 0.0],
        }
    }
}

impl ArmTarget {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::dof(self.dof)?;
        check::number("speed", self.speed)?;
        check::joints(&[("q", &self.q)])?;
        check::unused("q", &self.q, self.dof)?;
        check::numbers("position", &self.position)?;
        check::quaternion("wxyz", &self.wxyz)
    }
}

wire!("twinalign/ArmTarget/1" ArmTargetWire: ArmTarget {
    stamp_ns: u64,
    stream: u64,
    kind: TargetKind,
    dof: u32,
    speed: f64,
    q: Joints,
    position: [f64; 3],
    wxyz: [f64; 4],
});

/// What of an [`ArmTarget`] counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TargetKind {
    /// The joint positions.
    #[default]
    Joints = 0,
    /// The flange's pose.
    Pose = 1,
}

codes!(TargetKind: Joints, Pose);

/// How far the fingers are to be apart. Topic `/gripper/target`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/GripperTarget/1")]
#[repr(C)]
pub struct GripperTarget {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Chosen by the sender, not 0.
    pub stream: u64,
    /// Between the fingers [m].
    pub width: f64,
    /// How fast; 0: as fast as it goes [m/s].
    pub speed: f64,
    /// How hard to hold what is in the way; 0: only move [N].
    pub force: f64,
}

impl GripperTarget {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::numbers("width", &[self.width, self.speed, self.force])
    }
}

plain!(GripperTarget);
