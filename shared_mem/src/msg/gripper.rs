//! Gripper state.

use iceoryx2::prelude::ZeroCopySend;

/// State of the gripper. Topic `/gripper`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("twinalign/GripperState/1")]
#[repr(C)]
pub struct GripperState {
    /// When the state reached this machine: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Opening between the fingers [m].
    pub width: f64,
    /// Opening asked for [m].
    pub width_d: f64,
    /// Gripping force, or its estimate from the motor current [N].
    pub force: f64,
    /// 1 when something is held between the fingers.
    pub grasped: u32,
    /// The device's own fault code, 0 for none.
    pub fault: u32,
}
