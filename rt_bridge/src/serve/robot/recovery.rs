//! An arm that its own controller does not hold: the brakes, and the way back to an idle robot.
//!
//! Recovery brings any arm back: it opens the brakes once the arm stands, lets the arm give way for a moment, so that it does
//! not press on against what it ran into, and leads joints that are beyond their range slowly back into it. Where the
//! brakes had to close, load and stiffness become those at power-on, because one of them may be what moved the arm.

use super::{Mode, RECOVER, Reply, Robot};
use crate::arm::ReflexErrors;
use crate::serve::notices::About;
use crate::serve::watch::is_outside;
use crate::serve::wire::{AutomaticErrorRecoveryStatus, MoveStatus};
use twin::arm::Joints;

/// How long a recovering arm gives way [ms]: the joints' damping lets go of a table within a tenth of that.
const YIELD: u32 = 200;
/// How long the way back into the range may take [ms].
const WAY_BACK: u32 = 60_000;
/// How fast it is [rad/s], and how far inside the range it ends at least [rad].
const SPEED: f64 = 0.2;
const INSIDE: f64 = 0.01;

impl Robot {
    /// Closes the brakes on an arm that shows `errors` while nobody commands it.
    pub(super) fn brake(&mut self, errors: ReflexErrors) {
        self.notices.warn(About::Robot, format_args!("the arm does not hold still ({errors}); its brakes close"));
        if let Some((id, _)) = self.waiting.take() {
            self.answer_move(id, MoveStatus::ReflexAborted);
        }
        if let Mode::Recovering { id, .. } = self.mode {
            self.recovered(id, AutomaticErrorRecoveryStatus::ReflexAborted);
        }
        if !matches!(self.mode, Mode::Reflex) {
            self.tally.reflexes += 1;
            self.reflex_reason = errors;
        }
        self.errors = ReflexErrors::from_bits(self.errors.bits() | errors.bits());
        self.mode = Mode::Reflex;
        self.braked = true;
    }

    /// Takes the request `id` for a recovery.
    pub(super) fn recover(&mut self, id: u32) {
        let status = match self.mode {
            Mode::Idle => AutomaticErrorRecoveryStatus::Success,
            Mode::Moving(_) | Mode::Recovering { .. } => AutomaticErrorRecoveryStatus::CommandNotPossibleRejected,
            Mode::Reflex => {
                self.mode = Mode::Recovering { id: Some(id), passed: 0 };
                return;
            }
        };
        self.outbox.before_state.push(Reply { number: RECOVER, id, payload: vec![status.to_u8()] });
    }

    /// One millisecond of a recovery.
    pub(super) fn go_on_recovering(&mut self) {
        if !matches!(self.mode, Mode::Recovering { .. }) {
            return;
        }
        if self.braked {
            if !self.body.stands() {
                return;
            }
            self.open_brakes();
        }
        let Mode::Recovering { id, passed } = &mut self.mode else { return };
        if !self.hold.rests() {
            return;
        }
        *passed += 1;
        let (id, passed) = (*id, *passed);
        if passed <= YIELD {
            self.hold.settle(&self.body.measured.q);
        } else if passed > YIELD + WAY_BACK {
            self.mode = Mode::Reflex;
            self.recovered(id, AutomaticErrorRecoveryStatus::ManualErrorRecoveryRequiredRejected);
        } else if !self.hold.approach(&self.inside(), SPEED) && !is_outside(&self.body, &self.rules) {
            self.body.touched.forget_collisions();
            self.errors = ReflexErrors::default();
            self.mode = Mode::Idle;
            self.recovered(id, AutomaticErrorRecoveryStatus::Success);
        }
    }

    fn open_brakes(&mut self) {
        let Self { settings, at_power_on, .. } = self;
        settings.load = at_power_on.load;
        (settings.joint_stiffness, settings.cartesian_stiffness) =
            (at_power_on.joint_stiffness, at_power_on.cartesian_stiffness);
        self.hand_on_settings();
        self.hold.settle(&self.body.measured.q);
        self.braked = false;
    }

    /// The pose that is held, with the joints at or beyond the ends of their range a little inside it.
    fn inside(&self) -> Joints {
        let mut q = self.hold.trace().q;
        for (q, limits) in q.iter_mut().zip(self.rules.limits.counted()) {
            *q = q.clamp(limits.q_min + INSIDE, limits.q_max - INSIDE);
        }
        q
    }

    /// Answers the request for the recovery, where its client is still there.
    fn recovered(&mut self, id: Option<u32>, status: AutomaticErrorRecoveryStatus) {
        self.outbox.after_state.extend(id.map(|id| Reply { number: RECOVER, id, payload: vec![status.to_u8()] }));
    }
}
