//! What the arm does while nobody commands it: come to rest inside its limits, then hold that pose.

use crate::motion::Brake;
use crate::safety::{Limits, Trace};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::time::TICK;
use twin::arm::Joints;

/// The arm's own set points.
#[derive(Debug)]
pub(super) struct Hold {
    brake: Brake,
    trace: Trace,
    dq_d: Joints,
    braking: bool,
}

impl Hold {
    /// At rest at `q`.
    pub(super) fn at_rest(limits: Limits, q: &Joints) -> Self {
        Self { brake: Brake::new(limits, TICK), trace: Trace::at_rest(*q), dq_d: [0.0; MAX_JOINTS], braking: false }
    }

    /// Stops what was to move as `trace`.
    pub(super) fn stop(&mut self, trace: &Trace) {
        self.brake.begin(trace);
        (self.trace, self.braking) = (*trace, true);
    }

    /// Stops an arm that was not led by set points: it is at `q` with `dq`.
    pub(super) fn catch(&mut self, q: &Joints, dq: &Joints) {
        self.stop(&Trace { v: *dq, ..Trace::at_rest(*q) });
    }

    /// Lets go of the pose held so far and holds `q`.
    pub(super) fn settle(&mut self, q: &Joints) {
        (self.trace, self.dq_d, self.braking) = (Trace::at_rest(*q), [0.0; MAX_JOINTS], false);
    }

    /// Brings a pose that is held one period closer to `goal`, no joint faster than `speed` [rad/s]. `false` once it is
    /// there.
    pub(super) fn approach(&mut self, goal: &Joints, speed: f64) -> bool {
        let from = self.trace.q;
        let step: Joints = std::array::from_fn(|i| (goal[i] - from[i]).clamp(-speed * TICK, speed * TICK));
        self.trace = Trace::at_rest(std::array::from_fn(|i| from[i] + step[i]));
        self.dq_d = step.map(|step| step / TICK);
        let moves = step.iter().any(|step| *step != 0.0);
        if !moves {
            self.settle(goal);
        }
        moves
    }

    /// One period on.
    pub(super) fn step(&mut self) {
        if self.braking {
            let step = self.brake.step();
            self.trace =
                if step.at_rest { Trace::at_rest(step.point.q_d) } else { self.trace.after(&step.point.q_d, TICK) };
            (self.dq_d, self.braking) = (step.point.dq_d, !step.at_rest);
        }
    }

    /// `true` once the arm is commanded to stand still.
    pub(super) fn rests(&self) -> bool {
        !self.braking
    }

    pub(super) fn trace(&self) -> &Trace {
        &self.trace
    }

    /// Desired velocities [rad/s].
    pub(super) fn dq_d(&self) -> &Joints {
        &self.dq_d
    }
}
