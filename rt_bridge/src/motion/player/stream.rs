//! A stream of targets: its way is planned here, a set point a cycle, and each passes the guard like that of any motion. It
//! ends where it falls silent, is stopped or meets a limit: the arm is braked then and holds.

use super::{Activity, Player};
use crate::remark::{BrakeReason, Newest, Refusal, Remark};
use crate::safety::{Limits, Trace, Violation};
use shared_mem::msg::arm::MotionStatus;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::target::SILENCE_NS;
use shared_mem::msg::{Joints, MAX_JOINTS};
use std::mem::{Discriminant, discriminant};
use twin::arm::Follower;

/// Share of the highest speeds where a sender asks for none.
const USUAL_SPEED: f64 = 0.25;

/// The least share: slower ones look like a fault.
const SLOWEST: f64 = 0.02;

/// Where the joints are to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// The stream that it belongs to.
    pub stream: u64,
    /// Positions [rad]. `None`: it does not count, or is a pose of a stream that cannot steer now; it shows that somebody sends.
    pub q: Option<Joints>,
    /// Share of the highest speeds, up to 1; 0: a quarter.
    pub speed: f64,
}

/// What is known of a stream from cycle to cycle.
#[derive(Debug)]
pub(super) struct Stream {
    follower: Follower,
    /// Periods since its last target.
    silent: u32,
    longest_silence: u32,
    /// Whose refusal was said already, of each kind.
    refused: Newest<(u64, Discriminant<Refusal>)>,
    /// Streams of which a target was passed over since one counted, which was said.
    passed_over: Newest<u64>,
}

impl Stream {
    /// Nobody's yet. Allocates.
    pub(super) fn new(limits: &Limits, period_s: f64) -> Self {
        Self {
            follower: Follower::calm(&[0.0; MAX_JOINTS], limits, period_s),
            silent: 0,
            longest_silence: (SILENCE_NS as f64 * 1e-9 / period_s) as u32,
            refused: Newest::default(),
            passed_over: Newest::default(),
        }
    }

    pub(super) fn go_on_from(&mut self, trace: &Trace, period_s: f64) {
        let velocity = std::array::from_fn(|i| trace.velocity_now(i, period_s));
        self.follower.go_on_from(&trace.q, &velocity, &trace.a);
    }
}

impl Player {
    /// Takes in a target. Returns what there is to say about it: of many that are refused alike, only of the first.
    pub fn aim(&mut self, target: &Target) -> Option<Remark> {
        let goes_on = self.activity == Activity::Following && target.stream == self.motion;
        if !goes_on {
            self.silence.hear();
        }
        if self.is_dropped(target.stream) {
            return None;
        }
        if !goes_on && let Err(why) = self.may_begin(target.stream) {
            let is_new = self.stream.refused.note((target.stream, discriminant(&why)));
            return is_new.then_some(Remark::Refused { motion: target.stream, why });
        }
        let q = &target.q?;
        self.stream.silent = 0;
        if !goes_on {
            self.stream.go_on_from(&self.trace, self.guard.period_s);
        }
        if let Err(why) = self.reaches(q, target.speed) {
            let is_new = self.stream.passed_over.note(target.stream);
            return is_new.then_some(Remark::PassedOver { motion: target.stream, why });
        }
        self.stream.passed_over = Newest::default();
        if goes_on {
            return None;
        }
        (self.motion, self.played, self.stream.refused) = (target.stream, 0, Newest::default());
        (self.activity, self.status) = (Activity::Following, MotionStatus::Playing);
        Some(Remark::Began { motion: target.stream })
    }

    fn may_begin(&self, stream: u64) -> Result<(), Refusal> {
        match self.activity {
            _ if stream == 0 => Err(Refusal::NoId),
            Activity::Halted => Err(Refusal::NotCommanded),
            _ if !self.silence.is_over() => Err(Refusal::Stopped),
            Activity::Holding if self.ease.is_over() => Ok(()),
            _ => Err(Refusal::Busy { playing: self.motion }),
        }
    }

    /// Goes for a target, where the arm may rest there.
    fn reaches(&mut self, q: &Joints, speed: f64) -> Result<(), Violation> {
        for (i, joint) in self.guard.limits.counted().enumerate() {
            let number = u8::try_from(i + 1).unwrap_or(u8::MAX);
            if !q[i].is_finite() {
                return Err(Violation::NotFinite { joint: number });
            }
            let [low, high] = joint.targets();
            if !(low..=high).contains(&q[i]) {
                return Err(Violation::Position { joint: number });
            }
        }
        let there = Trace::at_rest(*q);
        if !self.guard.workspace.keeps(&there, &self.guard.limits, self.guard.period_s, &self.outside) {
            return Err(Violation::Workspace);
        }
        // What is no number is no share either.
        self.stream.follower.set_speed(if speed > 0.0 { speed.clamp(SLOWEST, 1.0) } else { USUAL_SPEED });
        let aimed = self.stream.follower.aim(q);
        aimed.map_err(|joint| Violation::Velocity { joint: u8::try_from(joint + 1).unwrap_or(u8::MAX) })
    }

    /// The next set point on the way.
    pub(super) fn follow(&mut self) -> (SetPoint, Option<Remark>) {
        self.stream.silent = self.stream.silent.saturating_add(1);
        if self.stream.silent > self.stream.longest_silence {
            return self.fall_silent();
        }
        let Some(q) = self.stream.follower.step() else {
            let remark = self.stop(BrakeReason::NoWay);
            return (self.braked(), remark);
        };
        let dof = self.guard.limits.dof;
        let velocity = self.stream.follower.velocity();
        let mut point = SetPoint { q_d: self.trace.q, dq_d: [0.0; MAX_JOINTS] };
        for (i, (q, dq)) in q.iter().zip(velocity).enumerate().take(dof) {
            (point.q_d[i], point.dq_d[i]) = (*q, dq);
        }
        match self.guard.check(&self.trace, &point, &self.outside, self.arm.as_ref()) {
            Ok(next) => {
                (self.trace, self.planned) = (next, next);
                self.played = self.played.saturating_add(1);
                (point, None)
            }
            Err(violation) => {
                let remark = self.stop(BrakeReason::Limit(violation));
                (self.braked(), remark)
            }
        }
    }

    /// Its sender is silent: at rest that is the end; on the way it is a fault.
    fn fall_silent(&mut self) -> (SetPoint, Option<Remark>) {
        if !self.trace.is_at_rest(self.guard.limits.dof, self.guard.period_s) {
            let remark = self.stop(BrakeReason::Silent);
            return (self.braked(), remark);
        }
        (self.activity, self.status) = (Activity::Holding, MotionStatus::Done);
        self.planned = Trace::at_rest(self.trace.q);
        self.rest();
        (self.hold(), Some(Remark::Done { motion: self.motion }))
    }
}
