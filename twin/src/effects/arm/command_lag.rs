//! The command is smoothed before the controller.
//!
//! - Equation: `time_constant dy/dt + y = r` for `q_d` and for `dq_d`, exact for a command that holds over a tick.
//! - Source: the low-pass filters of robot interfaces (100 Hz on a Franka: 1.6 ms), trajectory smoothing of servos.
//! - Unit: s. Plausible: 0 to 0.05 (1 to 8 ms on a Franka).
//! - Signature (C15): gain falls and phase lags with frequency.
//! - Confused with: command delay (in slow motion exactly; a chirp to 10 Hz tells by the gain).

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, milliseconds, short};
use shared_mem::time::TICK;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "command_lag",
    stage: Stage::Control,
    acts_on: Place::CommandPath,
    parameters: &[Parameter::size("time_constant", "s", [0.0, 0.05], 0.0).within(0.0, 10.0)],
    confusable_with: &["command_delay", "joint_viscous_friction", "tracker_smoothing"],
    separated: &[],
    install: |values, effects| {
        let time_constant = values.number("time_constant");
        let share = -(-TICK / time_constant).exp_m1();
        effects.arm.command_lag = Some(CommandLag { time_constant, share });
    },
    remedy: |found| {
        let constant = found.number("time_constant");
        let (time, cutoff) = (milliseconds(constant), short((std::f64::consts::TAU * constant).recip()));
        Remedy::new(
            format!(
                "Raise or switch off the low-pass in the command's way: it acts like one of {cutoff} Hz (time constant {time})."
            ),
            format!(
                "A first-order low-pass of time constant {} s before the controller (MuJoCo: dyntype=\"filterexact\" dynprm=\"{}\" on the position actuators).",
                short(constant),
                short(constant)
            ),
        )
    },
    model: |found| vec![Change::CommandLag(found.number("time_constant"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CommandLag {
    /// [s]
    time_constant: f64,
    /// Share of the way to the command that is made in a tick.
    share: f64,
}

impl ArmEffect for CommandLag {}

impl CommandLag {
    /// Until 1e-9 of a command is left [s].
    pub(super) fn settling_time(&self) -> f64 {
        self.time_constant * 1e9f64.ln()
    }

    pub(super) fn follow(&self, lagging: &mut Joints, command: &Joints) -> Joints {
        for (y, r) in lagging.iter_mut().zip(command) {
            *y += self.share * (r - *y);
        }
        *lagging
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{effects, first, joint};
    use crate::arm::JointState;

    #[test]
    fn a_step_is_followed_exponentially() {
        let effects = effects("[[effect]]\nname = \"command_lag\"\ntime_constant = 0.02");
        let still = JointState::default();
        let (_, mut memory) = effects.start(&joint(0.07), &still, &still.q, &still.dq);
        for tick in 1..100 {
            let (q_d, _) = effects.command(&mut memory, &first(1.0), &first(0.0));
            let expected = 1.0 - (-f64::from(tick) * 1e-3 / 0.02).exp();
            assert!((q_d[0] - expected).abs() < 1e-12, "{tick}: {} instead of {expected}", q_d[0]);
        }
    }
}
