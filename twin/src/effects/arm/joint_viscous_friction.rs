//! Friction of a joint in proportion to its speed.
//!
//! - Equation: `tau_f = viscous dq`.
//! - Source: Armstrong-Helouvry et al. 1994, section 2.1; sizes: Gaz et al. 2019 on the Panda.
//! - Unit: N m s/rad at the joint, before the torque sensor. Plausible: 0 to 10 (Panda 0 to 0.3, worn
//!   or cold gears and hobby servos more).
//! - Signature (C2): odd in velocity and linear in it; no harmonics.
//! - Confused with: the controller's damping (exactly, where only encoders are logged and the command rests), torque
//!   delay (takes damping away), command delay.

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::Remedy;
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_viscous_friction",
    stage: Stage::Control,
    acts_on: Place::Joint,
    parameters: &[Parameter::size("viscous", "N m s/rad", [0.0, 10.0], 0.0)
        .per_joint()
        .within(0.0, f64::MAX)
        .elsewhere(Elsewhere::OfTorqueLimit([0.0, 0.25]))],
    confusable_with: &["torque_delay", "command_delay"],
    separated: &[Separation {
        from: "torque_delay",
        by: "a chirp up to 40 Hz with torques logged: a delay lags the more the faster it swings, friction does not",
        record: &[Experiment::FastChirp],
    }],
    install: |values, effects| {
        effects.arm.joint_viscous_friction = Some(JointViscousFriction { viscous: values.joints("viscous") });
    },
    remedy: |found| {
        let joints = found.joints("viscous", "N m s/rad");
        Remedy::new(
            "Warm the gears up before recording: cold grease drags most; what is left belongs to the gears, so it goes into the model.",
            format!("MuJoCo: add to the joint damping {joints}. URDF and SDF: the same numbers as <dynamics damping>."),
        )
    },
    model: |found| vec![Change::Damping(found.all("viscous"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointViscousFriction {
    pub(super) viscous: Joints,
}

impl ArmEffect for JointViscousFriction {
    const IN_JOINTS: bool = true;

    fn drag(&self, joint: usize, _: f64, dq: f64) -> f64 {
        self.viscous[joint] * dq
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn a_free_joint_slows_down_exponentially() {
        let effects = effects("[[effect]]\nname = \"joint_viscous_friction\"\nviscous = 0.2");
        let last = run(&joint(0.07), &effects, turning(2.0), 500, |_, _| 0.0)[500];
        let expected = 2.0 * (-0.2 / (ROTOR + 0.07) * 0.5f64).exp();
        assert!((last.dq[0] / expected - 1.0).abs() < 1e-6, "{} instead of {expected}", last.dq[0]);
    }
}
