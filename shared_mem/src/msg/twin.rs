//! What the twin says about the cell while it shadows it.
#![allow(non_snake_case)] // the field's own symbols

use super::check::{self, Wrong};
use super::object::ObjectName;
use super::wire::{plain, wire};
use super::{Joints, MAX_JOINTS};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// The twin's own state, for the same command and moment as one `/arm/state`. Topic `/twin/state`.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/TwinState/1")]
#[repr(C)]
pub struct TwinState {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// `stamp_ns` of the arm state it mirrors.
    pub mirrors_ns: u64,
    /// `cycle` of the arm state it mirrors.
    pub cycle: u64,
    /// Number of joints that count.
    pub dof: u32,
    /// 1 when the twin holds an object.
    pub has_object: u32,
    /// Predicted joint positions [rad].
    pub q: Joints,
    /// Predicted joint velocities [rad/s].
    pub dq: Joints,
    /// Predicted torque behind the gear, with gravity [N m].
    pub tau_J: Joints,
    /// Predicted object position, geometric centre in the base frame [m].
    pub object_position: [f64; 3],
    /// Predicted object orientation in the base frame, `w, x, y, z`.
    pub object_wxyz: [f64; 4],
    /// Normal force between tool and object [N]; 0 when they do not touch.
    pub contact_force: f64,
}

impl Default for TwinState {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            mirrors_ns: 0,
            cycle: 0,
            dof: 0,
            has_object: 0,
            q: [0.0; MAX_JOINTS],
            dq: [0.0; MAX_JOINTS],
            tau_J: [0.0; MAX_JOINTS],
            object_position: [0.0; 3],
            object_wxyz: [1.0, 0.0, 0.0, 0.0],
            contact_force: 0.0,
        }
    }
}

impl TwinState {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("mirrors_ns", self.mirrors_ns)?;
        check::running("cycle", self.cycle)?;
        check::dof(self.dof)?;
        check::flag("has_object", self.has_object)?;
        check::joints(&[("q", &self.q), ("dq", &self.dq), ("tau_J", &self.tau_J)])?;
        check::numbers("object_position", &self.object_position)?;
        check::quaternion("object_wxyz", &self.object_wxyz)?;
        check::number("contact_force", self.contact_force)
    }
}

plain!(TwinState);

/// Real against twin. Topic `/twin/gap`.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/TwinGap/1")]
#[repr(C)]
pub struct TwinGap {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// `cycle` of the arm state it speaks of.
    pub cycle: u64,
    /// Number of joints that count.
    pub dof: u32,
    /// Times the twin was set back onto the robot since it attached (start, lost packets, restart of the bridge).
    pub alignments: u32,
    /// Twin minus robot, now [rad].
    pub joint_error: Joints,
    /// Root mean square of `joint_error` over the last second [rad].
    pub joint_rms: Joints,
    /// Average distance of the object's surface points, twin against robot [m]; NaN without an object.
    pub object_add_m: f64,
    /// The same to the closest point (for symmetric objects) [m]; NaN without an object.
    pub object_add_s_m: f64,
    /// Age of the arm state when the twin received it [ns].
    pub age_ns: u64,
}

impl Default for TwinGap {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            cycle: 0,
            dof: 0,
            alignments: 0,
            joint_error: [0.0; MAX_JOINTS],
            joint_rms: [0.0; MAX_JOINTS],
            object_add_m: f64::NAN,
            object_add_s_m: f64::NAN,
            age_ns: 0,
        }
    }
}

impl TwinGap {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("cycle", self.cycle)?;
        check::dof(self.dof)?;
        check::joints(&[("joint_error", &self.joint_error), ("joint_rms", &self.joint_rms)])?;
        check::number_or_none("object_add_m", self.object_add_m)?;
        check::number_or_none("object_add_s_m", self.object_add_s_m)?;
        check::running("age_ns", self.age_ns)
    }
}

plain!(TwinGap);

/// One of several objects in the twin, when the tracker reports it, and how far the two are apart. Topic `/twin/objects`; clips
/// hold each on `/twin/object/NAME`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwinObject {
    /// When it was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Moment of the picture behind the tracker's pose: monotonic clock [ns].
    pub mirrors_ns: u64,
    /// Predicted position at that moment, geometric centre in the base frame [m].
    pub position: [f64; 3],
    /// Predicted orientation in the base frame, `w, x, y, z`.
    pub wxyz: [f64; 4],
    /// Average distance of its surface points, twin against tracker [m]; NaN when the twin was just set onto it.
    pub add_m: f64,
    /// The same to the closest point (for symmetric objects) [m]; NaN as before.
    pub add_s_m: f64,
    /// Whose it is.
    pub name: ObjectName,
}

impl Default for TwinObject {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            mirrors_ns: 0,
            position: [0.0; 3],
            wxyz: [1.0, 0.0, 0.0, 0.0],
            add_m: f64::NAN,
            add_s_m: f64::NAN,
            name: ObjectName::default(),
        }
    }
}

impl TwinObject {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("mirrors_ns", self.mirrors_ns)?;
        check::numbers("position", &self.position)?;
        check::quaternion("wxyz", &self.wxyz)?;
        check::number_or_none("add_m", self.add_m)?;
        check::number_or_none("add_s_m", self.add_s_m)
    }
}

wire!("twinalign/TwinObject/1" TwinObjectWire: TwinObject {
    stamp_ns: u64,
    mirrors_ns: u64,
    position: [f64; 3],
    wxyz: [f64; 4],
    add_m: f64,
    add_s_m: f64,
    name: ObjectName,
});
