//! An arm simulated under a recorded command series: the inner loop of replay and of every identification.
//!
//! Time runs on a grid of 1 ms control ticks from the start stamp. At a tick the controller sees the state of that
//! moment and the newest command, and its torque holds until the next tick. Predictions between ticks are interpolated,
//! so the recording's stamps may be anything. Stamps are integer nanoseconds, everything else SI in the base frame.
//!
//! Nothing is allocated once [`CommandTrack`] stands; the same input gives the same bits on any number of threads.

mod commands;
mod start;

pub use commands::{CommandTrack, Hole};

use crate::arm::{ArmModel, ControlLaw, JointState, Joints, MAX_JOINTS};
use crate::effects::{ArmEffects, ArmMemory};

/// Period of the controller [ns].
pub const TICK_NS: u64 = 1_000_000;
/// Period of the controller [s].
pub const TICK: f64 = 1e-3;

/// An arm under its controller.
#[derive(Debug, Clone, Copy)]
pub struct ArmRollout<'a> {
    /// The arm that moves.
    pub arm: &'a ArmModel,
    /// The model inside the controller; the very same reference where it is exact, which saves a third of the time.
    pub nominal: &'a ArmModel,
    /// The controller.
    pub law: &'a ControlLaw,
    /// What acts besides; `arm` is then the real arm that they make of `nominal`.
    pub effects: Option<&'a ArmEffects>,
}

impl ArmRollout<'_> {
    /// Simulates from `start` at `start_ns` and writes the state at each of the ascending stamps `at_ns` into `out`.
    ///
    /// States are what the encoders read, the start's too. Commands from before `start_ns` are taken into account where
    /// the command comes late. A stamp before `start_ns` gets the start. Stops when the shorter of `at_ns` and `out` is filled.
    pub fn run(
        &self,
        start: &JointState,
        start_ns: u64,
        commands: &CommandTrack,
        at_ns: &[u64],
        out: &mut [JointState],
    ) {
        match self.effects {
            None => {
                let mut state = *start;
                self.sample(start, start_ns, commands, at_ns, out, |q_d, dq_d| {
                    self.tick(&mut state, q_d, dq_d);
                    state
                });
            }
            Some(effects) => {
                let (mut state, mut memory) = effects.start(self.arm, start, commands.q_d(0), commands.dq_d(0));
                self.catch_up(effects, &mut memory, start_ns, commands);
                self.sample(start, start_ns, commands, at_ns, out, |q_d, dq_d| {
                    self.tick_with(effects, &mut memory, &mut state, q_d, dq_d)
                });
            }
        }
    }

    /// Lets `tick` pass for every control period and writes what it answers, interpolated, into `out`.
    fn sample(
        &self,
        start: &JointState,
        start_ns: u64,
        commands: &CommandTrack,
        at_ns: &[u64],
        out: &mut [JointState],
        mut tick: impl FnMut(&Joints, &Joints) -> JointState,
    ) {
        let (mut state, mut tick_ns, mut row) = (*start, start_ns, 0);
        let mut wanted = at_ns.iter().zip(out).peekable();
        while let Some((_, out)) = wanted.next_if(|(at, _)| **at <= start_ns) {
            *out = *start;
        }
        while wanted.peek().is_some() {
            row = commands.in_force(tick_ns, row);
            let before = state;
            state = tick(commands.q_d(row), commands.dq_d(row));
            while let Some((at, out)) = wanted.next_if(|(at, _)| **at <= tick_ns + TICK_NS) {
                *out = between(&before, &state, (at - tick_ns) as f64 / TICK_NS as f64);
            }
            tick_ns += TICK_NS;
        }
    }

    fn tick(&self, state: &mut JointState, q_d: &Joints, dq_d: &Joints) {
        if std::ptr::eq(self.arm, self.nominal) {
            self.arm.controlled_step(state, self.law, q_d, dq_d, TICK);
        } else {
            let tau = self.law.torque(self.nominal, state, q_d, dq_d);
            self.arm.step(state, &tau, TICK);
        }
    }

    /// One control period under effects; answers what the encoders read at its end.
    fn tick_with(
        &self,
        effects: &ArmEffects,
        memory: &mut ArmMemory,
        state: &mut JointState,
        q_d: &Joints,
        dq_d: &Joints,
    ) -> JointState {
        let (q_d, dq_d) = effects.command(memory, q_d, dq_d);
        let reading = effects.measured(memory, state);
        let asked = self.law.torque(self.nominal, &reading, &q_d, &dq_d);
        let tau = effects.motor_torque(memory, &asked);
        effects.advance(memory, self.arm, state, (&tau, &[0.0; MAX_JOINTS]), TICK);
        effects.measured(memory, state)
    }

    /// Lets the commands of the time before `start_ns` that may still be on their way pass.
    fn catch_up(&self, effects: &ArmEffects, memory: &mut ArmMemory, start_ns: u64, commands: &CommandTrack) {
        let mut row = 0;
        for tick in (1..=effects.command_ticks()).rev() {
            let Some(tick_ns) = start_ns.checked_sub(tick * TICK_NS) else { continue };
            row = commands.in_force(tick_ns, row);
            let _ = effects.command(memory, commands.q_d(row), commands.dq_d(row));
        }
    }
}

/// State between two ticks, `share` of the period after the first: the cubic through both positions and velocities.
#[must_use]
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
