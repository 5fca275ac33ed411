//! The robot's base leans, so gravity pulls otherwise than the controller compensates.
//!
//! - Equation: `gravity_base = R(tilt)^-1 (0, 0, -g)`, `tilt` turning the base frame about its x and y axes.
//! - Source: the gravity term of the equations of motion.
//! - Unit: rad. Plausible: -0.1 to 0.1 (a careful installation: 0.01).
//! - Signature: static, in proportion to the horizontal levers of the arm's mass; joint 1 feels it only here.
//! - Confused with: payload, friction asymmetry, torque gain.

use super::effect::ArmEffect;
use crate::arm::ArmModel;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, gravity, leaning, list};
use nalgebra::Vector3;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "base_tilt",
    stage: Stage::Control,
    acts_on: Place::ArmModel,
    parameters: &[Parameter::size("tilt", "rad", [-0.1, 0.1], 0.0).vector(2).within(-0.5, 0.5)],
    confusable_with: &["payload", "joint_friction_asymmetry", "torque_gain"],
    separated: &[],
    install: |values, effects| effects.arm.base_tilt = Some(BaseTilt { tilt: values.vector("tilt") }),
    remedy: |found| {
        let tilt = found.vector("tilt");
        let gravity = list(&gravity(tilt));
        Remedy::new(
            format!(
                "Level the robot's base {}, or tell its controller that gravity is {gravity} m/s^2 in the base frame.",
                leaning(tilt)
            ),
            format!(
                "Gravity {gravity} m/s^2 in the base frame (MuJoCo: <option gravity>), or the base turned by {} rad about x and y; the controller goes on to compensate an upright one.",
                list(&tilt)
            ),
        )
    },
    model: |found| vec![Change::ArmGravity(gravity(found.vector("tilt")))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct BaseTilt {
    /// About the base's x and y axes [rad].
    tilt: [f64; 2],
}

impl ArmEffect for BaseTilt {
    fn change(&self, arm: &mut ArmModel) {
        arm.lean_base(Vector3::new(self.tilt[0], self.tilt[1], 0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{effects, joint};
    use crate::arm::MassProperties;

    #[test]
    fn a_joint_about_the_vertical_feels_the_weight_times_the_sine_of_the_lean() {
        let effects = effects("[[effect]]\nname = \"base_tilt\"\ntilt = [0.0, 0.1]");
        let mut arm = joint(0.07);
        // A kilogram half a metre out along y. Leaning about y towards +x, it is pulled along +x: clockwise from above.
        arm.add_at_flange(&MassProperties::new(1.0, [0.0, 0.5, 0.0], [0.0; 6]));
        let held = effects.real_arm(&arm).gravity(&[0.0; 8])[0];
        assert!((held - 9.81 * 0.5 * 0.1f64.sin()).abs() < 1e-12, "{held}");
        assert_eq!(arm.gravity(&[0.0; 8])[0], 0.0);
    }
}
