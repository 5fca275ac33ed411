//! The motors act late on the controller's torque.
//!
//! - Equation: `tau(t) -> tau(t - delay)`; a fraction of a tick is spread so that the mean torque over each tick is right.
//! - Source: current loop and bus between controller and motor. Small-delay limit: damping falls to `d - k delay`.
//! - Unit: s. Plausible: 0 to 0.003. Possible: up to 0.1.
//! - Signature (C14): less damping, ringing after fast motion; nothing at rest.
//! - Confused with: a lower damping, viscous friction (adds what this takes), joint elasticity (rings too).

use super::effect::ArmEffect;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, milliseconds, short};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "torque_delay",
    stage: Stage::Control,
    acts_on: Place::TorquePath,
    parameters: &[Parameter::size("delay", "s", [0.0, 0.003], 0.0).within(0.0, 0.1)],
    confusable_with: &["joint_viscous_friction", "joint_elasticity"],
    separated: &[],
    install: |values, effects| effects.arm.torque_delay = Some(TorqueDelay { delay: values.number("delay") }),
    remedy: |found| {
        let delay = found.number("delay");
        Remedy::new(
            format!(
                "Shorten the way from controller to drives by {}, or raise the damping of each joint by its stiffness times {} s, which is what the delay takes away.",
                milliseconds(delay),
                short(delay)
            ),
            format!("Hold torques back by {} between controller and joints.", milliseconds(delay)),
        )
    },
    model: |_| vec![Change::Beyond("torque that comes later than the control law asks for it")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TorqueDelay {
    /// [s]
    pub(super) delay: f64,
}

impl ArmEffect for TorqueDelay {}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn a_pulse_of_torque_comes_late_and_whole() {
        let effects = effects("[[effect]]\nname = \"torque_delay\"\ndelay = 0.0025");
        let states = run(&joint(0.07), &effects, turning(0.0), 20, |tick, _| if tick == 5 { 1.0 } else { 0.0 });
        let gained = 1e-3 / (ROTOR + 0.07);
        assert_eq!(states[7].dq[0], 0.0, "nothing before 5 + 2 ticks");
        assert!((states[8].dq[0] - 0.5 * gained).abs() < 1e-12, "{}", states[8].dq[0]);
        assert!((states[20].dq[0] - gained).abs() < 1e-12, "{}", states[20].dq[0]);
    }
}
