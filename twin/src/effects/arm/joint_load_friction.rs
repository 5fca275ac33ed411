//! Dry friction of a gear that grows with the torque it transmits.
//!
//! - Equation: `tau_f = coefficient |tau_motor| sgn(dq)`; at rest up to that;
//!   `creep` as in Coulomb friction. The motor's torque stands for the gear's
//!   load; the two differ by the friction itself and what turns the rotor.
//! - Source: Dohring et al. 1993; load-dependent term of Rhoban's BAM actuator models.
//! - Unit: 1. Plausible: 0.01 to 0.25 (hobby servos the upper end).
//! - Signature (C6): odd in velocity; its size follows the gravity torque over the pose.
//! - Confused with: Coulomb, Stribeck and presliding friction (alike in one pose), torque gain, payload.

use super::effect::ArmEffect;
use super::joint_coulomb_friction::CREEP;
use crate::arm::{Joints, Slip};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::Remedy;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_load_friction",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[
        Parameter::size("coefficient", "1", [0.0, 0.25], 0.0)
            .per_joint()
            .within(0.0, 1.0)
            .elsewhere(Elsewhere::Range([0.0, 0.8])),
        CREEP,
    ],
    confusable_with: &[
        "joint_coulomb_friction",
        "joint_presliding_friction",
        "joint_stribeck_friction",
        "torque_gain",
        "payload",
    ],
    separated: &[],
    install: |values, effects| {
        effects.arm.joint_load_friction =
            Some(JointLoadFriction { coefficient: values.joints("coefficient"), creep: values.joints("creep") });
    },
    remedy: |found| {
        let joints = found.joints("coefficient", "1");
        Remedy::new(
            "Carry less or work nearer to the base, where the gears bear less torque; the rest belongs to the gears.",
            format!(
                "Set the joint friction anew each step to this share of the motor's torque: {joints} (MuJoCo: frictionloss; URDF has no word for it)."
            ),
        )
    },
    model: |_| vec![Change::Beyond("dry friction that follows the torque")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointLoadFriction {
    coefficient: Joints,
    pub(super) creep: Joints,
}

impl ArmEffect for JointLoadFriction {
    const IN_JOINTS: bool = true;

    fn dry_friction(&self, joint: usize, slip: Slip) -> f64 {
        self.coefficient[joint] * slip.motor_torque.abs()
    }

    fn creep(&self, joint: usize) -> f64 {
        self.creep[joint]
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn a_share_of_the_torque_is_lost_in_motion_and_nothing_without_load() {
        let effects = effects("[[effect]]\nname = \"joint_load_friction\"\ncoefficient = 0.2\ncreep = 0.0");
        let driven = run(&joint(0.07), &effects, turning(0.1), 100, |_, _| 0.5)[100];
        assert!((driven.dq[0] - (0.1 + 0.8 * 0.5 / (ROTOR + 0.07) * 0.1)).abs() < 1e-9, "{}", driven.dq[0]);
        let free = run(&joint(0.07), &effects, turning(0.1), 100, |_, _| 0.0)[100];
        assert!((free.dq[0] - 0.1).abs() < 1e-12, "{}", free.dq[0]);
    }
}
