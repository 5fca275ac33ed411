//! Sparse targets for the joints: the client says where to be now and then, the robot plans how to get there. Nothing is
//! lost where nothing comes: the arm goes on to the last target and rests there.

use super::rules::JointRules;
use crate::safety::Trace;
use crate::serve::faults::{Fault, Verdict};
use crate::serve::wire::SetPoint;
use shared_mem::msg::joints_from;
use shared_mem::time::TICK;
use twin::arm::{Follower, Joints};

/// Where the joints are to go.
#[derive(Debug)]
pub(in crate::serve) struct TargetGenerator {
    reach: Follower,
    trace: Trace,
}

impl TargetGenerator {
    /// At rest at `q`, no joint faster than `fastest` [rad/s].
    pub(super) fn at_rest(q: &Joints, fastest: &[f64; 7], rules: &JointRules) -> Self {
        let reach = Follower::at_rest(q, &joints_from(fastest), rules.limits, TICK);
        Self { reach, trace: Trace::at_rest(*q) }
    }

    pub(super) fn trace(&self) -> &Trace {
        &self.trace
    }

    pub(super) fn follow(&mut self, set_point: Option<&SetPoint>) -> Verdict {
        let refused = Fault::PlanningJointLimits.alone();
        if set_point.is_some_and(|set_point| self.reach.aim(&joints_from(&set_point.q_c)).is_err()) {
            return Err(refused);
        }
        self.trace = self.trace.after(&self.reach.step().ok_or(refused)?, TICK);
        Ok(())
    }
}
