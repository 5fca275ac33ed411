//! The motors cannot give more than so much torque.
//!
//! - Equation: `tau = clip(tau, -limit, limit)`, after delay and gain; on top of the limit that cell.toml knows.
//! - Source: current limit of the drives; 87 and 12 N m on the FR3's joints by data sheet.
//! - Unit: N m. Plausible: 1 to 87, neutral without bound (`inf`).
//! - Signature (C19): nothing below the limit, flat tops above; peaks only.
//! - Confused with: voltage saturation (less in fast motion), torque gain (acts at every torque), command delay (in fast motion).

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter, Search};
use crate::effects::remedy::Remedy;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "torque_saturation",
    stage: Stage::Control,
    acts_on: Place::TorquePath,
    parameters: &[Parameter::size("limit", "N m", [0.1, 87.0], f64::INFINITY)
        .per_joint()
        .within(0.0, f64::MAX)
        .elsewhere(Elsewhere::OfTorqueLimit([0.05, 1.0]))
        .searched(Search::Limit)],
    confusable_with: &["voltage_saturation", "torque_gain", "command_delay"],
    separated: &[],
    install: |values, effects| effects.arm.torque_saturation = Some(TorqueSaturation { limit: values.joints("limit") }),
    remedy: |found| {
        let limit = found.joints("limit", "N m");
        Remedy::new(
            format!(
                "Keep the torques below {limit} (slower or lighter), look why the drives give no more, and put the numbers into torque_limit under [controller] in cell.toml."
            ),
            format!("MuJoCo: forcerange of the actuators {limit} either way. URDF: <limit effort>."),
        )
    },
    model: |found| vec![Change::TorqueLimit(found.all("limit"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TorqueSaturation {
    limit: Joints,
}

impl ArmEffect for TorqueSaturation {}

impl TorqueSaturation {
    pub(super) fn apply(&self, tau: &Joints) -> Joints {
        std::array::from_fn(|i| tau[i].clamp(-self.limit[i], self.limit[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{ROTOR, effects, joint, run, turning};

    #[test]
    fn torques_beyond_the_limit_count_as_the_limit_and_others_as_themselves() {
        let effects = effects("[[effect]]\nname = \"torque_saturation\"\nlimit = 0.2");
        let gained = |tau: f64| run(&joint(0.07), &effects, turning(0.0), 100, |_, _| tau)[100].dq[0];
        let expected = |tau: f64| tau * 0.1 / (ROTOR + 0.07);
        assert!((gained(-0.9) - expected(-0.2)).abs() < 1e-12);
        assert!((gained(0.1) - expected(0.1)).abs() < 1e-12);
    }
}
