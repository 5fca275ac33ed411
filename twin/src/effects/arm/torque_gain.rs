//! The motors give more or less torque than they are asked for.
//!
//! - Equation: `tau = gain tau_controller`, gravity compensation included.
//! - Source: torque constant and gear ratio off by some per cent.
//! - Unit: 1. Plausible: 0.8 to 1.2 (calibrated drives 0.95 to 1.05).
//! - Signature (C11): in proportion to the total torque; sags or rises with the gravity torque of the pose.
//! - Confused with: payload, and a stiffness where gravity does not act.

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "torque_gain",
    stage: Stage::Control,
    acts_on: Place::TorquePath,
    parameters: &[Parameter::size("gain", "1", [0.8, 1.2], 1.0).per_joint().within(0.0, 10.0)],
    confusable_with: &["payload", "joint_load_friction"],
    separated: &[],
    install: |values, effects| effects.arm.torque_gain = Some(TorqueGain { gain: values.joints("gain") }),
    remedy: |found| {
        let gain = found.joints("gain", "1");
        let inverse = found.joints_by("gain", &|gain| short(gain.recip()));
        Remedy::new(
            format!("Calibrate the torque constants, or multiply the torque that is asked for by {inverse}."),
            format!("Multiply the torque of each actuator by {gain} (MuJoCo: gear)."),
        )
    },
    model: |found| vec![Change::TorqueGain(found.all("gain"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TorqueGain {
    gain: Joints,
}

impl ArmEffect for TorqueGain {}

impl TorqueGain {
    pub(super) fn apply(&self, tau: &Joints) -> Joints {
        std::array::from_fn(|i| self.gain[i] * tau[i])
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn the_joint_accelerates_by_the_gain() {
        let effects = effects("[[effect]]\nname = \"torque_gain\"\ngain = 0.95");
        let last = run(&joint(0.07), &effects, turning(0.0), 100, |_, _| 0.3)[100];
        assert!((last.dq[0] - 0.95 * 0.3 * 0.1 / (ROTOR + 0.07)).abs() < 1e-12, "{}", last.dq[0]);
    }
}
