//! How far an episode came towards its success: from 0, as at the start, to 1.

use super::Task;
use super::condition::Condition;
use crate::world::World;
use nalgebra::Vector3;

impl Condition {
    /// How far it is from holding, in units of its own: 0 where it holds.
    fn distance(&self, world: &World) -> f64 {
        match *self {
            Self::Inside { body, of, low, high, tilt } => {
                let pose = world.pose(body);
                let place = of.map_or(pose, |other| world.pose(other).inv_mul(&pose)).translation.vector;
                let out = Vector3::from_fn(|k, _| (low[k] - place[k]).max(place[k] - high[k]).max(0.0));
                let leans = ((pose.rotation * Vector3::z()).angle(&Vector3::z()) - tilt).max(0.0);
                // A body that lies on its side is a tenth of a metre away.
                out.norm() + 0.1 * leans
            }
            Self::Touching { .. } => f64::from(u8::from(!self.holds(world))),
            Self::Joint { body, low, high } => world.joint(body).map_or(1.0, |at| (low - at).max(at - high).max(0.0)),
        }
    }
}

/// The farthest that an episode has come.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Progress {
    /// How far each condition was from holding at the start.
    from: Vec<f64>,
    best: f64,
}

impl Progress {
    /// At the start.
    pub(super) fn begin(task: &Task, world: &World) -> Self {
        Self { from: task.conditions.iter().map(|condition| condition.distance(world)).collect(), best: 0.0 }
    }

    /// Looks how far it is now: the mean over conditions that did not hold at the start, of the share of the way done.
    pub(super) fn look(&mut self, task: &Task, world: &World) {
        let open = self.from.iter().zip(&task.conditions).filter(|(from, _)| **from > 0.0);
        let (sum, count) = open.fold((0.0, 0.0), |(sum, count), (from, condition)| {
            (sum + (1.0 - condition.distance(world) / from).clamp(0.0, 1.0), count + 1.0)
        });
        if count > 0.0 {
            self.best = self.best.max(sum / count);
        }
    }

    /// The farthest; 1 for a success alone.
    pub(super) fn best(&self, success: bool) -> f64 {
        if success { 1.0 } else { self.best.min(0.99) }
    }
}

impl Task {
    /// Conditions that do not hold now, in words.
    pub(super) fn missed(&self, world: &World) -> Vec<String> {
        let open = self.conditions.iter().filter(|condition| !condition.holds(world));
        open.map(|condition| condition.words(&self.bodies)).collect()
    }
}
