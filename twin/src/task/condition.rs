//! What counts as success.

use crate::world::{BodyPlan, World};
use nalgebra::Vector3;

/// One of the conditions, all of which have to hold at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Condition {
    /// A body's origin lies in a box, in the world or in the axes of another body, and its z leans at most so far [rad].
    Inside { body: usize, of: Option<usize>, low: Vector3<f64>, high: Vector3<f64>, tilt: f64 },
    /// Two bodies press on each other, or do not.
    Touching { bodies: [usize; 2], wanted: bool },
    /// A joint's position lies in a range [rad or m].
    Joint { body: usize, low: f64, high: f64 },
}

impl Condition {
    pub(super) fn words(&self, bodies: &[BodyPlan]) -> String {
        let name = |body: usize| &bodies[body].name;
        match *self {
            Self::Inside { body, of: Some(other), .. } => format!("{} in place at {}", name(body), name(other)),
            Self::Inside { body, of: None, .. } => format!("{} in place", name(body)),
            Self::Touching { bodies: [a, b], wanted: true } => format!("{} touches {}", name(a), name(b)),
            Self::Touching { bodies: [a, b], wanted: false } => format!("{} apart from {}", name(a), name(b)),
            Self::Joint { body, low, high } => format!("joint of {} between {low} and {high}", name(body)),
        }
    }

    pub(super) fn holds(&self, world: &World) -> bool {
        match *self {
            Self::Inside { body, of, low, high, tilt } => {
                let pose = world.pose(body);
                let place = of.map_or(pose, |other| world.pose(other).inv_mul(&pose)).translation.vector;
                let inside = (0..3).all(|k| (low[k]..=high[k]).contains(&place[k]));
                inside && (pose.rotation * Vector3::z()).angle(&Vector3::z()) <= tilt
            }
            Self::Touching { bodies: [first, second], wanted } => world.touch(first, second) == wanted,
            Self::Joint { body, low, high } => world.joint(body).is_some_and(|at| (low..=high).contains(&at)),
        }
    }
}
