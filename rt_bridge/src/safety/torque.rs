//! Torque and torque rate, clamped: the last thing between a law and the arm.

use super::Limits;
use shared_mem::msg::{Joints, MAX_JOINTS};

/// Share of the rate limit that is used: the robot differences what it received in another rounding.
const RATE_SHARE: f64 = 0.999;

/// Torques that are remembered: more than a robot loses in a row before it stops by itself.
const REMEMBERED: usize = 32;
/// What single precision makes of a torque is off by no more [N m].
const ROUNDING: f64 = 5e-6;

/// Remembers the torque in force, which the next one is held to, and those sent before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TorqueGuard {
    last: Joints,
    sent: [Joints; REMEMBERED],
    newest: usize,
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
    pub fn after(tau: &Joints, limits: &Limits) -> Self {
        let mut last = [0.0; MAX_JOINTS];
        for ((last, tau), joint) in last.iter_mut().zip(tau).zip(limits.counted()) {
            *last = if tau.is_finite() { tau.clamp(-joint.torque, joint.torque) } else { 0.0 };
        }
        Self { last, sent: [last; REMEMBERED], newest: 0 }
    }

    /// Re-anchors the rate limit at the torque that the robot reports as applied, `in_force` in single precision: the newest of
    /// those sent that this can be. One that came too late never was in force, and a step from it would be a step of several
    /// periods to the robot.
    pub fn resume(&mut self, in_force: &Joints) {
        let is_in_force = |sent: &Joints| sent.iter().zip(in_force).all(|(sent, tau)| (sent - tau).abs() <= ROUNDING);
        let from_newest = (0..REMEMBERED).map(|back| (self.newest + REMEMBERED - back) % REMEMBERED);
        // A robot that does not say what is in force is taken to have got everything.
        if let Some(found) = from_newest.filter_map(|at| self.sent.get(at)).find(|sent| is_in_force(sent)) {
            self.last = *found;
        }
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
        self.newest = (self.newest + 1) % REMEMBERED;
        if let Some(slot) = self.sent.get_mut(self.newest) {
            *slot = out.tau;
        }
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
    fn a_step_is_measured_from_the_torque_that_the_robot_has() {
        let limits = Limits::fr3();
        let mut guard = TorqueGuard::after(&[0.0; MAX_JOINTS], &limits);
        let sent: Vec<Joints> = (0..5).map(|_| guard.clamp(&[20.0; MAX_JOINTS], &limits, 1e-3).tau).collect();
        guard.resume(&sent[4].map(|tau| f64::from(tau as f32)));
        let mut all_came = guard;
        assert!((all_came.clamp(&[20.0; MAX_JOINTS], &limits, 1e-3).tau[0] - sent[4][0] - 0.999).abs() < 1e-9);
        guard.resume(&sent[1].map(|tau| f64::from(tau as f32)));
        let next = guard.clamp(&[20.0; MAX_JOINTS], &limits, 1e-3).tau;
        assert!((next[0] - sent[1][0] - 0.999).abs() < 1e-9, "three did not come in time: {}", next[0]);
        // Nothing that was ever sent: a robot that does not say.
        guard.resume(&[-7.0; MAX_JOINTS]);
        assert!((guard.clamp(&[20.0; MAX_JOINTS], &limits, 1e-3).tau[0] - next[0] - 0.999).abs() < 1e-9);
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
