//! Where bodies start: drawn by a seed, again as long as bodies overlap.

use super::Task;
use crate::world::World;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_pcg::Pcg64;

/// Drawings before it is given up.
const DRAWINGS: usize = 1000;

/// Where a body may start: so far from its position, turned by so much about the vertical through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StartRange {
    pub(super) body: usize,
    pub(super) nominal: Isometry3<f64>,
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
    pub(super) yaw: [f64; 2],
}

/// Bodies where they start.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    pub(super) world: World,
    /// That was drawn for each body [rad].
    pub(super) yaws: Vec<f64>,
}

/// A task cannot start.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StartError {
    /// Bodies overlap in every drawing.
    #[error("`{first}` and `{second}` overlap where they start{drawings}; move one of them, or widen `start`")]
    Crowded {
        /// One of the two.
        first: String,
        second: String,
        /// How often it was tried, where there was a choice.
        drawings: String,
    },
    /// All conditions hold before anything has been done.
    #[error("all of it holds at the start already; ask for something that has to be brought about")]
    AlreadyDone,
}

impl Task {
    /// The bodies where a seed has them start.
    ///
    /// # Errors
    /// [`StartError`] when bodies overlap in all drawings, and when nothing is left to do.
    pub(super) fn placed(&self, seed: u64) -> Result<Placed, StartError> {
        let mut generator = Pcg64::new(u128::from(seed), 0x7461_736b);
        let mut world = self.world.clone();
        let mut yaws = vec![0.0; self.bodies.len()];
        let mut last = [0, 0];
        for _ in 0..DRAWINGS {
            for range in &self.starts {
                let mut draw = |[low, high]: [f64; 2]| {
                    if low < high { generator.random_range(low..high) } else { low }
                };
                let (x, y, yaw) = (draw(range.x), draw(range.y), draw(range.yaw));
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
                let place = range.nominal.translation.vector + Vector3::new(x, y, 0.0);
                world.put(range.body, Isometry3::from_parts(Translation3::from(place), turn * range.nominal.rotation));
                yaws[range.body] = yaw;
            }
            match world.overlap() {
                None => {
                    let mut after = world.clone();
                    after.step();
                    let done = self.conditions.iter().all(|condition| condition.holds(&after));
                    return if done { Err(StartError::AlreadyDone) } else { Ok(Placed { world, yaws }) };
                }
                Some(pair) => last = pair,
            }
            if self.starts.is_empty() {
                break;
            }
        }
        let [first, second] = last.map(|body| self.bodies[body].name.clone());
        let drawings =
            if self.starts.is_empty() { String::new() } else { format!(" in {DRAWINGS} drawings out of {DRAWINGS}") };
        Err(StartError::Crowded { first, second, drawings })
    }
}
