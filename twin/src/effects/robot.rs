//! How strong effects on an arm may be on this robot. The ranges of the registry are those of the FR3 and its kin; another
//! robot's follow from what it is known to be: torque limits, inertia seen at its joints, mass of its links.

use super::parameter::{Elsewhere, Parameter};
use crate::arm::{ArmModel, Joints};

/// What of a robot says how strong effects on it may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    like_the_fr3: bool,
    torque_limit: Joints,
    inertia: Joints,
    mass: f64,
}

impl Robot {
    /// Of an arm.
    #[must_use]
    pub fn of(arm: &ArmModel) -> Self {
        let matrix = arm.mass_matrix(arm.ready());
        Self {
            like_the_fr3: arm.is_built_like(&ArmModel::fr3()),
            torque_limit: *arm.torque_limit(),
            inertia: std::array::from_fn(|joint| matrix[joint][joint]),
            mass: arm.moving_mass(),
        }
    }

    /// Where nothing is known of an arm, or there is none: the registry's own ranges.
    #[must_use]
    pub fn unknown() -> Self {
        Self { like_the_fr3: true, torque_limit: Joints::default(), inertia: Joints::default(), mass: 0.0 }
    }

    /// Values of a parameter that are met in practice, of this joint (from 0) or of the whole arm.
    ///
    /// ```
    /// use twin::arm::ArmModel;
    /// use twin::effects::{Robot, find};
    ///
    /// let friction = &find("joint_coulomb_friction").expect("an effect on the arm").parameters[0];
    /// let [lowest, highest] = Robot::of(&ArmModel::fr3()).range(friction, Some(0)); // N m
    /// assert!(lowest >= 0.0 && highest > lowest);
    /// assert_eq!([lowest, highest], friction.plausible, "the registry's ranges are those of the FR3");
    /// ```
    pub fn range(&self, parameter: &Parameter, joint: Option<usize>) -> [f64; 2] {
        let joint = joint.unwrap_or(0);
        let times = |share: [f64; 2], whole: f64| {
            if whole.is_finite() && whole > 0.0 { share.map(|share| share * whole) } else { parameter.plausible }
        };
        let [lo, hi] = match parameter.elsewhere {
            _ if self.like_the_fr3 => parameter.plausible,
            Elsewhere::Same => parameter.plausible,
            Elsewhere::Range(range) => range,
            Elsewhere::OfTorqueLimit(share) => times(share, self.torque_limit[joint]),
            Elsewhere::OfInertia(share) => times(share, self.inertia[joint]),
            Elsewhere::OfMass(share) => times(share, self.mass),
        };
        [lo.max(parameter.possible[0]), hi.min(parameter.possible[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::find;
    use shared_mem::cell::Cell;
    use std::path::Path;

    fn servo() -> Robot {
        let text = "[robot]\njoints = [\"a\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [2.0]\ndamping = [0.1]\nrotor_inertia = [0.004]\ntorque_limit = [0.6]\n";
        let cell = Cell::parse(text, Path::new("cell.toml")).expect("a cell");
        Robot::of(&ArmModel::from_cell(&cell).expect("a servo"))
    }

    fn range(robot: &Robot, effect: &str, parameter: &str, joint: Option<usize>) -> [f64; 2] {
        let effect = find(effect).expect("an effect");
        robot.range(effect.parameters.iter().find(|p| p.name == parameter).expect("a parameter"), joint)
    }

    #[test]
    fn a_servo_has_the_friction_of_its_own_torque_and_the_fr3_its_own_numbers() {
        let fr3 = Robot::of(&ArmModel::fr3());
        assert_eq!(range(&fr3, "joint_coulomb_friction", "coulomb", Some(6)), [0.0, 3.0]);
        assert_eq!(range(&fr3, "payload", "mass", None), [0.0, 1.5]);
        let servo = servo();
        let [lo, hi] = range(&servo, "joint_coulomb_friction", "coulomb", Some(0));
        assert!(lo == 0.0 && (hi - 0.25 * 0.6).abs() < 1e-12, "{hi}");
        assert!(range(&servo, "joint_load_friction", "coefficient", Some(0))[1] > 0.6, "a worn servo loses half");
        let [lo, hi] = range(&servo, "rotor_inertia", "extra", Some(0));
        assert!((lo + 0.002).abs() < 1e-9 && (hi - 0.004).abs() < 1e-9, "{lo} {hi}");
        // Only rotors move there: nothing says how much such a robot carries.
        assert_eq!(range(&servo, "payload", "mass", None), [0.0, 1.5]);
        assert_eq!(range(&servo, "command_delay", "delay", None), range(&fr3, "command_delay", "delay", None));
    }
}
