//! Joint positions and joint velocities as set points.

use super::rules::{COMMANDED, JointRules, exceeds};
use crate::safety::Trace;
use crate::serve::faults::{Fault, Verdict};
use crate::serve::wire::SetPoint;
use shared_mem::msg::joints_from;
use shared_mem::time::TICK;
use twin::arm::Joints;

/// How far from the arm's desired positions a motion may begin [rad]. The robot's own tolerance is not published; it
/// refuses 0.2. A jump smaller than this is a discontinuity.
const START: f64 = 0.05;

/// What the joints are to do.
#[derive(Debug, Clone)]
pub(in crate::serve) struct JointGenerator {
    velocities: bool,
    begun: bool,
    trace: Trace,
}

impl JointGenerator {
    pub(super) fn of_positions(q: &Joints) -> Self {
        Self { velocities: false, begun: false, trace: Trace::at_rest(*q) }
    }

    pub(super) fn of_velocities(q: &Joints) -> Self {
        Self { velocities: true, ..Self::of_positions(q) }
    }

    pub(super) fn trace(&self) -> &Trace {
        &self.trace
    }

    pub(super) fn follow(&mut self, set_point: Option<&SetPoint>, rules: &JointRules) -> Verdict {
        let last = self.trace;
        let Some(set_point) = set_point else {
            self.trace = last.onward(TICK);
            return Ok(());
        };
        let q = if self.velocities {
            let dq_c = joints_from(&set_point.dq_c);
            std::array::from_fn(|i| last.q[i] + dq_c[i] * TICK)
        } else {
            joints_from(&set_point.q_c)
        };
        if !self.begun && !self.velocities && q.iter().zip(&last.q).any(|(q, start)| exceeds((q - start).abs(), START))
        {
            return Err(Fault::JointStartPose.alone());
        }
        let next = last.after(&q, TICK);
        rules.check(&last, &next, &COMMANDED)?;
        (self.begun, self.trace) = (true, next);
        Ok(())
    }

    pub(super) fn finish(&self, rules: &JointRules) -> Verdict {
        rules.check_end(&self.trace, &COMMANDED)
    }
}
