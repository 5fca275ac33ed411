//! The gripper: what it does, and what it is told.

use super::check::{self, Wrong};
use super::wire::{codes, plain, wire};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// State of the gripper. Topic `/gripper`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/GripperState/1")]
#[repr(C)]
pub struct GripperState {
    /// When the state reached this machine: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Opening between the fingers [m].
    pub width: f64,
    /// Opening asked for [m].
    pub width_d: f64,
    /// Gripping force, or its estimate from the motor current [N]; NaN where the device does not tell.
    pub force: f64,
    /// 1 when something is held between the fingers.
    pub grasped: u32,
    /// The device's own fault code, 0 for none.
    pub fault: u32,
}

impl GripperState {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::numbers("width", &[self.width, self.width_d])?;
        check::number_or_none("force", self.force)?;
        check::flag("grasped", self.grasped)
    }
}

plain!(GripperState);

/// What the gripper is told. Topic `/gripper/command`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GripperCommand {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Opening between the fingers to go to, or of the object to hold [m].
    pub width: f64,
    /// How fast; 0: as fast as it goes [m/s].
    pub speed: f64,
    /// How hard to hold; 0: as gently as it can [N].
    pub force: f64,
    /// What to do.
    pub action: GripperAction,
    /// Keeps the size a multiple of 8; always 0.
    pub reserved: u32,
}

impl GripperCommand {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::number("width", self.width)?;
        check::number("speed", self.speed)?;
        check::number("force", self.force)
    }
}

wire!("twinalign/GripperCommand/2" GripperCommandWire: GripperCommand {
    stamp_ns: u64,
    width: f64,
    speed: f64,
    force: f64,
    action: GripperAction,
    reserved: u32,
});

/// What a gripper can be told to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GripperAction {
    /// Go to `width`.
    #[default]
    Move = 0,
    /// Close until something of about `width` is held with `force`.
    Grasp = 1,
    /// Stay where the fingers are.
    Stop = 2,
    /// Find out how far the fingers go. They open and close once: keep clear.
    Home = 3,
}

codes!(GripperAction: Move, Grasp, Stop, Home);
