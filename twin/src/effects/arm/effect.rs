//! What an effect on the arm may do: each does some of it. What it leaves out, it does not touch.

use crate::arm::{ArmModel, Slip};

/// An effect on the arm, as the calls of [`super::ArmEffects`] see it. Units SI, joints from base to flange.
pub(in crate::effects) trait ArmEffect {
    /// Whether it lies between motors and links.
    const IN_JOINTS: bool = false;

    /// Changes the bodies of the arm that moves; the controller goes on with those it knows.
    fn change(&self, _arm: &mut ArmModel) {}

    /// Adds to the largest dry friction of a joint [N m].
    fn dry_friction(&self, _joint: usize, _slip: Slip) -> f64 {
        0.0
    }

    /// Motor speed at which dry friction is `tanh(1)` of its bound [rad/s]; of several effects the largest holds.
    fn creep(&self, _joint: usize) -> f64 {
        0.0
    }

    /// Speed over which dry friction falls [rad/s]; 0 where it does not.
    fn falls_over(&self, _joint: usize) -> f64 {
        0.0
    }

    /// Adds to the torque that a motor loses otherwise [N m], at its position [rad] and velocity [rad/s].
    fn drag(&self, _joint: usize, _q: f64, _dq: f64) -> f64 {
        0.0
    }
}
