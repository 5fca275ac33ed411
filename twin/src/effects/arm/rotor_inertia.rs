//! The rotors are heavier to turn than cell.toml says.
//!
//! - Equation: `tau_f = extra ddq` at each joint, on top of the nominal rotor inertia.
//! - Source: reflected inertia `n^2 J` of motor and gear; `n` the gear ratio, `J` at the motor.
//! - Unit: kg m^2 at the joint. Plausible: -0.1 to 0.3. Down to -0.2, an arm's heaviest rotors; where the joint's own is
//!   lighter, nothing of it is left.
//! - Signature (C9): grows with the square of the frequency, even in velocity, the same in every pose.
//! - Confused with: payload (depends on the pose), joint elasticity, a stiffness at one frequency.

use super::effect::ArmEffect;
use crate::arm::{ArmModel, Joints};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::{Remedy, list};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "rotor_inertia",
    stage: Stage::Control,
    acts_on: Place::ArmModel,
    parameters: &[Parameter::size("extra", "kg m^2", [-0.1, 0.3], 0.0)
        .per_joint()
        .within(-0.2, f64::MAX)
        .elsewhere(Elsewhere::OfInertia([-0.5, 1.0]))],
    confusable_with: &["payload", "joint_elasticity"],
    separated: &[
        Separation {
            from: "payload",
            by: "the same kind of fast motion in three poses, because a payload's inertia changes with the pose; move the arm by hand before each",
            record: &[Experiment::NewMotion, Experiment::NewMotion, Experiment::NewMotion],
        },
        Separation {
            from: "joint_elasticity",
            by: "a chirp up to 40 Hz: look for a resonance",
            record: &[Experiment::FastChirp],
        },
    ],
    install: |values, effects| effects.arm.rotor_inertia = Some(RotorInertia { extra: values.joints("extra") }),
    remedy: |found| {
        let extra = found.all("extra");
        let known =
            found.cell().controller.as_ref().map(|controller| controller.rotor_inertia.clone()).unwrap_or_default();
        let joints = found.joints("extra", "kg m^2");
        let whole: Vec<f64> =
            known.iter().enumerate().map(|(i, rotor)| rotor + extra.get(i).unwrap_or(&extra[0])).collect();
        let set = if whole.is_empty() { format!("add {joints}") } else { format!("rotor_inertia = {}", list(&whole)) };
        Remedy::new(
            format!("In cell.toml under [controller]: {set}."),
            format!("MuJoCo: add to the joint armature {joints}. URDF has no word for it."),
        )
    },
    model: |found| vec![Change::Armature(found.all("extra"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct RotorInertia {
    extra: Joints,
}

impl ArmEffect for RotorInertia {
    fn change(&self, arm: &mut ArmModel) {
        arm.add_rotor_inertia(&self.extra);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn the_joint_accelerates_less_and_gravity_stays() {
        let effects = effects("[[effect]]\nname = \"rotor_inertia\"\nextra = 0.05");
        let real = effects.real_arm(&joint(0.07));
        let last = run(&real, &effects, turning(0.0), 100, |_, _| 0.3)[100];
        let expected = 0.3 * 0.1 / (ROTOR + 0.07 + 0.05);
        assert!((last.dq[0] - expected).abs() < 1e-12, "{} instead of {expected}", last.dq[0]);
        let arm = crate::arm::ArmModel::fr3();
        assert_eq!(effects.real_arm(&arm).gravity(arm.ready()), arm.gravity(arm.ready()));
    }
}
