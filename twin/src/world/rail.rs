//! One joint within a step: its dry friction, its limits and its drive, as impulses on its one freedom.

use super::plan::{Drive, JointPlan};
use super::tree::Trees;

/// A position beyond a limit goes back by this share of the excess in a step.
const RECOVERY: f64 = 0.1;

/// A joint with a freedom of its own.
#[derive(Debug, Clone)]
pub(super) struct Rail {
    pub(super) body: usize,
    pub(super) freedom: usize,
    tree: usize,
    friction: f64,
    pub(super) limits: [f64; 2],
    pub(super) drive: Option<Drive>,
    /// Of friction, drive, lower and upper limit, from the step before [N m s or N s].
    impulses: [f64; 4],
    answer: f64,
    /// Least and largest velocity that the limits leave in this step.
    room: [f64; 2],
    wanted: f64,
}

impl Rail {
    pub(super) fn new(body: usize, plan: &JointPlan, freedom: usize, tree: usize) -> Self {
        Self {
            body,
            freedom,
            tree,
            friction: plan.friction,
            limits: plan.limits,
            drive: plan.drive,
            impulses: [0.0; 4],
            answer: 0.0,
            room: [f64::NEG_INFINITY, f64::INFINITY],
            wanted: 0.0,
        }
    }

    /// Takes up the impulses of the step before.
    pub(super) fn begin(&mut self, trees: &mut Trees, dt: f64) {
        self.answer = trees.answer(self.tree, self.freedom);
        let position = trees.positions[self.freedom];
        let [low, high] = self.limits;
        let back = |inside: f64| if inside > 0.0 { -inside / dt } else { -inside * RECOVERY / dt };
        self.room = [back(position - low), -back(high - position)];
        if let Some(drive) = &self.drive {
            self.wanted = ((drive.target - position) / dt).clamp(-drive.speed, drive.speed);
        }
        trees.push(self.tree, self.freedom, self.impulses.iter().sum());
    }

    /// Finds the impulses that go with what everything else does now; the largest change of the velocity.
    pub(super) fn relax(&mut self, trees: &mut Trees, dt: f64) -> f64 {
        let before = trees.velocities[self.freedom];
        let most = self.drive.map_or(0.0, |drive| drive.force) * dt;
        let dry = self.friction * dt;
        let blocks = [
            (0.0, -dry, dry),
            (self.wanted, -most, most),
            (self.room[0], 0.0, f64::INFINITY),
            (self.room[1], f64::NEG_INFINITY, 0.0),
        ];
        for (impulse, (goal, low, high)) in self.impulses.iter_mut().zip(blocks) {
            if low == high {
                continue;
            }
            let wanted = *impulse + (goal - trees.velocities[self.freedom]) / self.answer;
            let now = wanted.clamp(low, high);
            trees.push(self.tree, self.freedom, now - *impulse);
            *impulse = now;
        }
        (trees.velocities[self.freedom] - before).abs()
    }
}
