//! The torque sensors' zeros are off.
//!
//! - Equation: `tau_J_measured = tau_J + bias`.
//! - Source: drift of strain gauges. On a Franka the controller inside uses the sensor; here the motion does not feel it.
//! - Unit: N m. Plausible: -2 to 2 (0.5 after calibration).
//! - Signature (C22): constant in every pose and at every speed; the motion stays.
//! - Confused with: friction asymmetry and payload (change the motion).

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "torque_sensor_bias",
    stage: Stage::Control,
    acts_on: Place::JointSensing,
    parameters: &[Parameter::size("bias", "N m", [-2.0, 2.0], 0.0)
        .per_joint()
        .elsewhere(Elsewhere::OfTorqueLimit([-0.1, 0.1]))],
    confusable_with: &["joint_friction_asymmetry", "payload"],
    separated: &[Separation {
        from: "joint_friction_asymmetry",
        by: "hang a known weight on the flange and rest in eight poses, torques logged",
        record: &[Experiment::Holds],
    }],
    install: |values, effects| effects.arm.torque_sensor_bias = Some(TorqueSensorBias { bias: values.joints("bias") }),
    remedy: |found| {
        let bias = found.joints("bias", "N m");
        Remedy::new(
            format!("Zero the torque sensors with nothing pulling at them, or take off their readings {bias}."),
            format!("Add to the measured torques {bias}; the motion stays as it is."),
        )
    },
    model: |_| vec![Change::Beyond("zeros of the torque sensors, which move nothing")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TorqueSensorBias {
    pub(super) bias: Joints,
}

impl ArmEffect for TorqueSensorBias {}

#[cfg(test)]
mod tests {
    use super::super::ArmEffects;
    use super::super::test_arm::{effects, first, joint, run, turning};

    #[test]
    fn the_reading_is_shifted_and_the_motion_is_not() {
        let (arm, biased) = (joint(0.07), effects("[[effect]]\nname = \"torque_sensor_bias\"\nbias = 0.25"));
        let [a, b] = [&biased, &ArmEffects::default()].map(|effects| run(&arm, effects, turning(0.1), 50, |_, _| 0.3));
        assert_eq!(a, b);
        let read = |effects: &ArmEffects| {
            let (mut state, mut memory) = effects.start(&arm, &turning(0.1), &[0.0; 8], &[0.0; 8]);
            effects.advance(&mut memory, &arm, &mut state, (&first(0.3), &[0.0; 8]), 1e-3);
            effects.tau_J(&memory)[0]
        };
        // What the sensor sees turns the link alone: 0.07 of 0.1 kg m^2.
        assert!((read(&ArmEffects::default()) - 0.3 * 0.7).abs() < 1e-12);
        assert!((read(&biased) - 0.3 * 0.7 - 0.25).abs() < 1e-12);
    }
}
