//! Friction of a joint that differs between the two directions.
//!
//! - Equation: `tau_f = offset`, whatever the direction: with Coulomb friction beside it, `coulomb + offset` one way and
//!   `coulomb - offset` the other. With `fading` above 0 it is `offset |tanh(dq / fading)|`: a difference between two
//!   frictions is none where the joint rests.
//! - Source: the friction offset of Gaz et al. 2019, equation of the Panda's joint friction; friction levels of their own
//!   for each direction: Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 2.
//! - Units: offset N m at the joint, before the torque sensor; fading rad/s. Plausible: offset -1 to 1 (Panda -0.3 to 0.3).
//! - Signature (C5): even in velocity, flat over speed and over pose.
//! - Confused with: payload and base tilt (even as well, but follow the pose), torque sensor bias (leaves the motion alone).

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::{Remedy, with_unit};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_friction_asymmetry",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("offset", "N m", [-1.0, 1.0], 0.0).per_joint().elsewhere(Elsewhere::OfTorqueLimit([-0.1, 0.1])),
        Parameter::form("fading", "rad/s", [0.0, 0.05], 0.0)
            .within(0.0, f64::MAX)
            // At rest as in motion, and none at rest.
            .begun_at(&[&[0.0], &[0.01]]),
    ],
    confusable_with: &["payload", "base_tilt", "torque_sensor_bias"],
    separated: &[],
    install: |values, effects| {
        effects.arm.joint_friction_asymmetry =
            Some(JointFrictionAsymmetry { offset: values.joints("offset"), fading: values.number("fading") });
    },
    remedy: |found| {
        let (offset, force) = (found.joints("offset", "N m"), found.joints_by("offset", &|tau| with_unit(-tau, "N m")));
        Remedy::new(
            format!("Add to the commanded torque {offset} as a feed-forward; look for a cable or hose that pulls."),
            format!("MuJoCo: a constant joint force (qfrc_applied) of {force}. URDF has no word for it."),
        )
    },
    model: |found| {
        if found.number("fading") > 0.0 {
            return vec![Change::Beyond("friction that differs between the two directions, and is the same at rest")];
        }
        vec![Change::ConstantTorque(found.all("offset").into_iter().map(|offset| -offset).collect())]
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointFrictionAsymmetry {
    offset: Joints,
    fading: f64,
}

impl ArmEffect for JointFrictionAsymmetry {
    const IN_JOINTS: bool = true;

    fn drag(&self, joint: usize, _: f64, dq: f64) -> f64 {
        let share = if self.fading > 0.0 { (dq / self.fading).tanh().abs() } else { 1.0 };
        self.offset[joint] * share
    }
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

    #[test]
    fn a_difference_that_fades_is_none_at_rest_and_all_of_it_in_motion() {
        let effects = effects("[[effect]]\nname = \"joint_friction_asymmetry\"\noffset = 0.1\nfading = 0.01\n");
        let rested = run(&joint(0.07), &effects, turning(0.0), 100, |_, _| 0.0)[100];
        assert_eq!((rested.q[0], rested.dq[0]), (0.0, 0.0), "it moves by itself");
        let lost = |dq: f64| (dq - run(&joint(0.07), &effects, turning(dq), 50, |_, _| 0.0)[50].dq[0]) / 0.05;
        for dq in [1.0, -1.0] {
            assert!((lost(dq) * (ROTOR + 0.07) - 0.1).abs() < 1e-9, "{}", lost(dq));
        }
    }
}
