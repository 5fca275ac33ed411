//! A serial chain as its source tells it: joints, the bodies behind them, the flange.

use super::inertia::MassProperties;
use nalgebra::{Isometry3, Unit, Vector3};
use serde::Serialize;
use std::collections::HashSet;

/// An arm as its source tells it, before it is laid out for computing.
pub(super) struct Chain {
    pub(super) joints: Vec<Joint>,
    /// The flange in the last link's frame.
    pub(super) flange: Isometry3<f64>,
    /// Movable joints of its source that are no joints of the arm, such as fingers.
    pub(super) held: Vec<HeldJoint>,
    /// What of the choice between them may be meant otherwise, one sentence each.
    pub(super) doubts: Vec<String>,
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

/// A joint of the arm's file that moves and is none of the arm's: of a finger, a wheel, a base that drives.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HeldJoint {
    /// Its name; `joint` where it is written out.
    #[serde(rename = "joint")]
    pub name: String,
    /// Why it is none of the arm's, in a few words.
    pub why: String,
}

impl HeldJoint {
    /// All of them in one line, those of one reason together: `a, b (named as a finger is); c (follows `a`)`.
    pub fn in_words(held: &[Self]) -> String {
        let mut reasons: Vec<&str> = held.iter().map(|joint| joint.why.as_str()).collect();
        let mut seen = HashSet::new();
        reasons.retain(|why| seen.insert(*why));
        let of = |why: &str| {
            let names: Vec<&str> = held.iter().filter(|j| j.why == why).map(|j| j.name.as_str()).collect();
            format!("{} ({why})", names.join(", "))
        };
        reasons.into_iter().map(of).collect::<Vec<_>>().join("; ")
    }
}
