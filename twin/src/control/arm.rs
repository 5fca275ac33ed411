//! An arm simulated alone under a recorded command series.
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::{ArmMotion, CommandTrack, Drive, Reading};
use crate::arm::{ArmModel, ControlLaw, JointState, MAX_JOINTS};
use crate::effects::ArmEffects;
use shared_mem::ending;
use shared_mem::time::{TICK, TICK_NS};

/// An arm under its controller.
#[derive(Debug, Clone, Copy)]
pub struct ArmRollout<'a> {
    /// The arm that moves.
    pub arm: &'a ArmModel,
    /// The model inside the controller; the very same reference where it is exact, which saves a third of the time.
    pub nominal: &'a ArmModel,
    pub law: &'a ControlLaw,
    /// What acts besides; `arm` is then the real arm that they make of `nominal`.
    pub effects: Option<&'a ArmEffects>,
    /// In so many parts a period is integrated; 1 is how the twin does it.
    pub parts: u32,
}

impl ArmRollout<'_> {
    /// Simulates from `start` at `start_ns` and writes the state at each of the ascending stamps `at_ns` into `out`.
    ///
    /// States are what the encoders read, the start's too. Commands from before `start_ns` are taken into account where
    /// the command comes late. A stamp before `start_ns` gets the start. Stops when the shorter of `at_ns` and `out` is filled;
    /// once the process is asked to end, with NaN ([`ending`]).
    pub fn run(
        &self,
        start: &JointState,
        start_ns: u64,
        commands: &CommandTrack,
        at_ns: &[u64],
        out: &mut [JointState],
    ) {
        self.sample(start, start_ns, commands, at_ns, out, |reading| reading.state);
    }

    /// [`ArmRollout::run`] with the torques that a robot reports besides.
    pub fn readings(
        &self,
        start: &JointState,
        start_ns: u64,
        commands: &CommandTrack,
        at_ns: &[u64],
        out: &mut [Reading],
    ) {
        self.sample(start, start_ns, commands, at_ns, out, |reading| reading);
    }

    fn sample<T>(
        &self,
        start: &JointState,
        start_ns: u64,
        commands: &CommandTrack,
        at_ns: &[u64],
        out: &mut [T],
        kept: impl Fn(Reading) -> T,
    ) {
        let mut motion = ArmMotion::unstarted();
        self.start(&mut motion, start, start_ns, commands);
        let mut reading = Reading { state: *start, ..self.reading(&motion) };
        let (mut tick_ns, mut row) = (start_ns, 0);
        let mut wanted = at_ns.iter().zip(out).peekable();
        while let Some((_, out)) = wanted.next_if(|(at, _)| **at <= start_ns) {
            *out = kept(reading);
        }
        while wanted.peek().is_some() && !ending::asked() {
            row = commands.in_force(tick_ns, row);
            let before = reading;
            self.period(&mut motion, &Drive::JointImpedance { q_d: *commands.q_d(row), dq_d: *commands.dq_d(row) });
            reading = self.reading(&motion);
            while let Some((at, out)) = wanted.next_if(|(at, _)| **at <= tick_ns + TICK_NS) {
                *out = kept(reading.after(&before, (at - tick_ns) as f64 / TICK_NS as f64));
            }
            tick_ns += TICK_NS;
        }
        wanted.for_each(|(_, out)| *out = kept(Reading::unknown()));
    }
}

impl Reading {
    /// What an interrupted run answers: no number, so that nobody takes it for a prediction.
    pub(crate) fn unknown() -> Self {
        let nan = [f64::NAN; MAX_JOINTS];
        Self { state: JointState { q: nan, dq: nan }, tau_J: nan, tau_J_d: nan }
    }

    /// The reading `share` of a period after `before`; torques hold over the period that ends with `self`.
    pub(crate) fn after(&self, before: &Self, share: f64) -> Self {
        Self { state: between(&before.state, &self.state, share), ..*self }
    }
}

/// State between two ticks, `share` of the period after the first: the cubic through both positions and velocities.
pub fn between(before: &JointState, after: &JointState, share: f64) -> JointState {
    if share >= 1.0 {
        return *after;
    }
    let (s, r) = (share, 1.0 - share);
    let blend = |i: usize| {
        let (p, q, u, v) = (before.q[i], after.q[i], before.dq[i] * TICK, after.dq[i] * TICK);
        let position = r * r * (1.0 + 2.0 * s) * p + s * s * (1.0 + 2.0 * r) * q + r * s * (r * u - s * v);
        let rate = 6.0 * r * s * (q - p) + r * (r - 2.0 * s) * u + s * (s - 2.0 * r) * v;
        (position, rate / TICK)
    };
    let mut state = JointState::default();
    for i in 0..MAX_JOINTS {
        (state.q[i], state.dq[i]) = blend(i);
    }
    state
}
