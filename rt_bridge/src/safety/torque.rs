//! Torque and torque rate, clamped: the last thing between a law and the arm.

use super::Limits;
use shared_mem::msg::{Joints, MAX_JOINTS};

/// Share of the rate limit that is used: the robot differences what it received in another rounding.
const RATE_SHARE: f64 = 0.999;

/// Remembers the torque sent last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TorqueGuard {
    last: Joints,
}

/// What is sent, and whether it is less than what was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clamped {
    /// Torque [N m].
    pub tau: Joints,
    /// `true` when a limit held it back.
    pub held_back: bool,
}

impl TorqueGuard {
    /// The torque sent last was `tau`, brought inside the limits.
    #[must_use]
    pub fn after(tau: &Joints, limits: &Limits) -> Self {
        let mut last = [0.0; MAX_JOINTS];
        for ((last, tau), joint) in last.iter_mut().zip(tau).zip(limits.counted()) {
            *last = if tau.is_finite() { tau.clamp(-joint.torque, joint.torque) } else { 0.0 };
        }
        Self { last }
    }

    /// The nearest torque to `wanted` inside torque and rate limits, `period_s` after the last one. A number that is not
    /// finite asks for 0.
    pub fn clamp(&mut self, wanted: &Joints, limits: &Limits, period_s: f64) -> Clamped {
        let mut out = Clamped { tau: [0.0; MAX_JOINTS], held_back: false };
        for (((tau, last), wanted), joint) in out.tau.iter_mut().zip(&self.last).zip(wanted).zip(limits.counted()) {
            let goal = if wanted.is_finite() { *wanted } else { 0.0 };
            let step = RATE_SHARE * joint.torque_rate * period_s;
            *tau = goal.clamp(-joint.torque, joint.torque).clamp(last - step, last + step);
            out.held_back |= *tau != *wanted;
        }
        self.last = out.tau;
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_input_makes_a_torque_or_a_step_beyond_the_limits(
            wishes in prop::collection::vec(prop::array::uniform8(prop::num::f64::ANY), 1..40),
            start in prop::array::uniform8(prop::num::f64::ANY),
        ) {
            let limits = Limits::fr3();
            let mut guard = TorqueGuard::after(&start, &limits);
            let mut last = guard.last;
            for wish in wishes {
                let sent = guard.clamp(&wish, &limits, 1e-3).tau;
                for (i, joint) in limits.counted().enumerate() {
                    prop_assert!(sent[i].abs() <= joint.torque);
                    prop_assert!((sent[i] - last[i]).abs() <= joint.torque_rate * 1e-3);
                }
                last = sent;
            }
        }
    }

    #[test]
    fn a_torque_inside_the_limits_passes_untouched() {
        let mut guard = TorqueGuard::default();
        let wanted = [0.5; MAX_JOINTS];
        let sent = guard.clamp(&wanted, &Limits::fr3(), 1e-3);
        assert_eq!(sent.tau[..7], wanted[..7]);
        assert!(!sent.held_back);
        assert!(guard.clamp(&[2.0; MAX_JOINTS], &Limits::fr3(), 1e-3).held_back);
    }
}
