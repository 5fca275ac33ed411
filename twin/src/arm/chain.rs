//! A serial chain as its source tells it: joints, the bodies behind them, the flange.

use super::inertia::MassProperties;
use nalgebra::{Isometry3, Unit, Vector3};

/// An arm as its source tells it, before it is laid out for computing.
pub(super) struct Chain {
    pub(super) joints: Vec<Joint>,
    /// The flange in the last link's frame.
    pub(super) flange: Isometry3<f64>,
    /// Movable joints of its source that are no joints of the arm, such as fingers.
    pub(super) held: Vec<String>,
}

/// One movable joint and the body behind it.
pub(super) struct Joint {
    pub(super) name: String,
    /// The link that it carries.
    pub(super) link: String,
    pub(super) slides: bool,
    /// The joint's frame at 0 in the link before.
    pub(super) origin: Isometry3<f64>,
    /// In the joint's frame.
    pub(super) axis: Unit<Vector3<f64>>,
    /// In the joint's frame, which moves with the link.
    pub(super) body: MassProperties,
    pub(super) position: [f64; 2],
    pub(super) velocity: f64,
    pub(super) torque: f64,
    pub(super) rotor_inertia: f64,
    pub(super) ready: f64,
}
