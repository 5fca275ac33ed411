//! The flange carries more than cell.toml says.
//!
//! - Equation: `tau = Y(q, dq, ddq) dpi` of a point mass on the flange: it is added to the arm, not to the controller's model.
//! - Source: Gautier, Khalil 1990 (inertial parameters enter linearly).
//! - Units: mass kg; centre m in the flange frame. Plausible: mass 0 to 1.5, centre within 0.15 to every side.
//! - Signature (C10): sags in rest with the gravity regressor over the pose; grows with the square of the frequency too.
//! - Confused with: torque gain, friction asymmetry (the same in every pose), base tilt.

use super::effect::ArmEffect;
use crate::arm::{ArmModel, MassProperties};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Elsewhere, Parameter};
use crate::effects::remedy::{Remedy, list, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "payload",
    stage: Stage::Control,
    acts_on: Place::ArmModel,
    parameters: &[
        Parameter::size("mass", "kg", [0.0, 1.5], 0.0).within(0.0, 100.0).elsewhere(Elsewhere::OfMass([0.0, 0.3])),
        Parameter::form("centre", "m", [-0.15, 0.15], 0.0)
            .vector(3)
            // At the flange, and in a hand.
            .begun_at(&[&[0.0, 0.0, 0.0], &[0.0, 0.0, 0.06]]),
    ],
    confusable_with: &["torque_gain", "joint_friction_asymmetry", "base_tilt"],
    separated: &[
        Separation {
            from: "torque_gain",
            by: "rest in eight poses or more, gravity pulling either way",
            record: &[Experiment::Holds],
        },
        Separation {
            from: "joint_friction_asymmetry",
            by: "rest in eight poses or more, gravity pulling either way",
            record: &[Experiment::Holds],
        },
        Separation {
            from: "base_tilt",
            by: "rest in eight poses or more, turned about the base's axis",
            record: &[Experiment::ManyHolds],
        },
    ],
    install: |values, effects| {
        effects.arm.payload = Some(Payload { mass: values.number("mass"), centre: values.vector("centre") });
    },
    remedy: |found| {
        let (mass, centre) = (found.number("mass"), found.vector::<3>("centre"));
        let tool = found.cell().tool.as_ref().map(|tool| tool.mass);
        let total = tool.map_or_else(String::new, |tool| {
            format!(", or set mass = {} under [tool] in cell.toml where the tool itself is heavier", short(tool + mass))
        });
        // A tenth of a millimetre is more than anyone can use.
        let (mass, centre) = (short(mass), list(&centre.map(|x| (1e4 * x).round() * 1e-4 + 0.0)));
        Remedy::new(
            format!(
                "Take off the {mass} kg at {centre} m of the flange frame, or set this load in the robot's own settings{total}."
            ),
            format!(
                "MuJoCo: a body on the flange with <inertial mass=\"{mass}\" pos=\"{}\">. URDF: a link with this mass and origin on a fixed joint at the flange.",
                centre.replace(['[', ']', ','], "")
            ),
        )
    },
    model: |found| vec![Change::FlangeLoad { mass: found.number("mass"), centre: found.vector("centre") }],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct Payload {
    mass: f64,
    centre: [f64; 3],
}

impl ArmEffect for Payload {
    fn change(&self, arm: &mut ArmModel) {
        arm.add_at_flange(&MassProperties::new(self.mass, self.centre, [0.0; 6]));
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_arm::effects;
    use crate::arm::{ArmModel, PointForce};

    #[test]
    fn it_weighs_on_the_joints_like_a_force_at_its_centre() {
        let effects = effects("[[effect]]\nname = \"payload\"\nmass = 0.4\ncentre = [0.01, -0.02, 0.1]");
        let arm = ArmModel::fr3();
        let q = *arm.ready();
        let point = arm.flange(&q).isometry() * nalgebra::Point3::new(0.01, -0.02, 0.1);
        let weight = PointForce { point: point.into(), force: [0.0, 0.0, -0.4 * 9.81] };
        let (more, torque) = (effects.real_arm(&arm).gravity(&q), arm.torque_of(&q, &weight));
        for i in 0..7 {
            let added = more[i] - arm.gravity(&q)[i];
            assert!((added + torque[i]).abs() < 1e-12, "joint {i}: {added} instead of {}", -torque[i]);
        }
    }
}
