//! Friction of a joint that differs between the two directions.
//!
//! - Equation: `tau_f = offset`, whatever the direction: with Coulomb friction beside it, `coulomb + offset` one way and
//!   `coulomb - offset` the other.
//! - Source: the friction offset of Gaz et al. 2019, equation of the Panda's joint friction.
//! - Unit: N m at the joint, before the torque sensor. Plausible: -1 to 1 (Panda -0.3 to 0.3).
//! - Signature (C5): even in velocity, flat over speed and over pose.
//! - Confused with: payload and base tilt (even as well, but follow the pose), torque sensor bias (leaves the motion alone).

use crate::arm::Joints;
use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_friction_asymmetry",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[Parameter::size("offset", "N m", [-1.0, 1.0], 0.0).per_joint()],
    confusable_with: &["payload", "base_tilt", "torque_sensor_bias"],
    install: |values, effects| {
        effects.arm.joint_friction_asymmetry = Some(JointFrictionAsymmetry { offset: values.joints("offset") });
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointFrictionAsymmetry {
    pub(super) offset: Joints,
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn the_two_directions_differ_by_twice_the_offset() {
        let effects = effects(
            "[[effect]]\nname = \"joint_friction_asymmetry\"\noffset = 0.1\n\
             [[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = 0.3\ncreep = 0.0",
        );
        let slowed = |dq: f64| (dq - run(&joint(0.07), &effects, turning(dq), 50, |_, _| 0.0)[50].dq[0]).abs();
        let torque = |dq: f64| slowed(dq) * (ROTOR + 0.07) / 0.05;
        assert!((torque(1.0) - 0.4).abs() < 1e-9, "{}", torque(1.0));
        assert!((torque(-1.0) - 0.2).abs() < 1e-9, "{}", torque(-1.0));
    }
}
