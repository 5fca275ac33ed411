//! The drives run out of voltage: at standstill they give so much torque, and less the faster the joint turns.
//!
//! - Equation: `tau = clip(tau + d dq, -limit, limit) - d dq`, `d` the controller's damping, after delay and gain. What a servo with a
//!   pulse-width modulated voltage is short of when it turns is what its motor induces itself, and that damping is nothing else.
//! - Source: equation of the DC motor, `tau = k_t / R (u - k_e dq)` with `|u|` up to the supply's voltage, `d = k_t k_e / R`.
//! - Unit: N m at standstill, the stall torque less what the controller keeps back. Plausible: 1 to 87, neutral without bound
//!   (`inf`).
//! - Signature (C19): flat tops where errors are large, above all in fast motion; nothing below.
//! - Confused with: torque saturation (the same at all speeds), torque gain.

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "voltage_saturation",
    stage: Stage::Control,
    acts_on: Place::TorquePath,
    parameters: &[Parameter::size("limit", "N m", [0.1, 87.0], f64::INFINITY)
        .per_joint()
        .within(0.0, f64::MAX)
        .elsewhere(Elsewhere::OfTorqueLimit([0.05, 1.0]))
        .searched(Search::Limit)],
    confusable_with: &["torque_saturation", "torque_gain"],
    separated: &[Separation {
        from: "torque_saturation",
        by: "a chirp: a limit of the voltage leaves the less torque the faster the joint turns, a limit of the torque always as much",
        record: &[Experiment::Chirp],
    }],
    install: |values, effects| {
        effects.arm.voltage_saturation = Some(VoltageSaturation { limit: values.joints("limit") });
    },
    remedy: |found| {
        let limit = found.joints("limit", "N m");
        Remedy::new(
            format!(
                "Ask for less than {limit} at standstill (slower, lighter, lower gains), or give the drives a higher voltage; check that the supply does not sag."
            ),
            format!(
                "MuJoCo: forcerange {limit} on the actuators that act as the position's spring, and the damping as joint damping beside them. URDF and SDF hold no such limit."
            ),
        )
    },
    model: |_| vec![Change::Beyond("a largest torque that falls with the joint's speed")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct VoltageSaturation {
    limit: Joints,
}

impl ArmEffect for VoltageSaturation {}

impl VoltageSaturation {
    /// `damped`: the controller's damping times the joints' velocities [N m].
    pub(super) fn apply(&self, tau: &Joints, damped: &Joints) -> Joints {
        std::array::from_fn(|i| (tau[i] + damped[i]).clamp(-self.limit[i], self.limit[i]) - damped[i])
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, first, joint};
    use crate::arm::{ControlLaw, JointState};
    use crate::control::{ArmMotion, ArmRollout, Drive};
    use shared_mem::cell::ControllerKind;

    #[test]
    fn a_servo_far_from_its_target_speeds_up_to_where_its_damping_takes_the_limit() {
        let effects = effects("[[effect]]\nname = \"voltage_saturation\"\nlimit = 0.2");
        let (arm, nominal, damping) = (joint(0.07), joint(0.07), 0.4);
        let law = ControlLaw {
            kind: ControllerKind::JointPd,
            stiffness: first(50.0),
            damping: first(damping),
            torque_limit: first(f64::INFINITY),
        };
        let rollout = ArmRollout { arm: &arm, nominal: &nominal, law: &law, effects: Some(&effects), parts: 1 };
        let far = Drive::JointImpedance { q_d: first(100.0), dq_d: first(0.0) };
        let mut motion = ArmMotion::unstarted();
        rollout.put(&mut motion, &JointState::default(), &first(100.0), &first(0.0));
        for _ in 0..2000 {
            rollout.period(&mut motion, &far);
        }
        // (I d/dt + d) dq = limit
        let expected = 0.2 / damping * (1.0 - (-damping * 2.0 / (ROTOR + 0.07)).exp());
        assert!((motion.state.dq[0] / expected - 1.0).abs() < 0.01, "{} instead of {expected}", motion.state.dq[0]);
    }

    #[test]
    fn what_the_drive_can_give_is_given() {
        let effect = super::VoltageSaturation { limit: first(2.0) };
        for (tau, damped, given) in [(1.9, 0.0, 1.9), (-2.5, 0.0, -2.0), (1.5, 1.0, 1.0), (-2.5, 1.0, -2.5)] {
            assert_eq!(effect.apply(&first(tau), &first(damped))[0], given);
        }
    }
}
