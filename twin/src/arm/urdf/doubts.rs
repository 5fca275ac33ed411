//! Numbers of a URDF that no arm has: limits that are none, are swapped or look like degrees, and inertias that no body can have. The arm is
//! read all the same, and each is said.

use super::{Tree, range};
use nalgebra::Matrix3;
use urdf_rs::{Joint, JointType};

/// An arm's joint that turns farther to one side [rad] may be written in degrees: two whole turns, which cables bear at most.
const FARTHEST: f64 = 4.0 * std::f64::consts::PI;
/// Numbers beyond stand for no limit at all [rad or m].
const UNLIMITED: f64 = 1e4;
/// Share of the largest moment by which rounding spoils an inertia: files give three digits.
const ROUNDING: f64 = 0.01;

impl<'a> Tree<'a> {
    /// What is odd in the numbers of the arm's joints and of the bodies behind them, one sentence each.
    pub(super) fn odd_numbers(&self, joints: &[&'a Joint]) -> Vec<String> {
        let named = |is_odd: fn(&Joint) -> bool| {
            let odd = joints.iter().filter(|joint| is_odd(joint)).map(|joint| joint.name.as_str());
            Some(odd.collect::<Vec<_>>().join(", ")).filter(|names| !names.is_empty())
        };
        let missing = named(is_without_range).map(|names| {
            format!(
                "<limit> of the URDF gives {names} no range (`lower` and `upper` are equal or missing): without stops in the simulated arm and \
                 in a capture's plan; write the arm's own into the URDF"
            )
        });
        let swapped = named(|joint| joint.joint_type != JointType::Continuous && joint.limit.lower > joint.limit.upper)
            .map(|names| {
                format!("`lower` is above `upper` in <limit> of {names}: taken turned round; correct the URDF")
            });
        let degrees = named(is_in_degrees).map(|names| {
            format!(
                "<limit> of the URDF lets {names} turn by more than two turns to one side, as limits in degrees do; a URDF has radians: \
                 correct it where they are degrees, its `velocity` too"
            )
        });
        let bodies = self.odd_bodies(joints).map(|links| {
            format!(
                "the <inertia> of {links} is none that a body can have (a moment is negative, or larger than the sum of both others); it is used \
                 as it is: correct the URDF"
            )
        });
        [missing, swapped, degrees, bodies].into_iter().flatten().collect()
    }

    /// Links that move with the arm and whose inertia no body has.
    fn odd_bodies(&self, joints: &[&'a Joint]) -> Option<String> {
        let mut open: Vec<&str> = joints.first().map(|joint| joint.child.link.as_str()).into_iter().collect();
        let mut odd = Vec::new();
        while let Some(name) = open.pop() {
            open.extend(self.behind(name).map(|joint| joint.child.link.as_str()));
            let link = self.robot.links.iter().find(|link| link.name == name);
            odd.extend(link.filter(|link| is_impossible(&link.inertial.inertia)).map(|link| link.name.as_str()));
        }
        (!odd.is_empty()).then(|| odd.join(", "))
    }
}

fn is_without_range(joint: &Joint) -> bool {
    joint.joint_type != JointType::Continuous
        && range(joint).is_none_or(|range| !range.iter().all(|end| end.is_finite()))
}

fn is_in_degrees(joint: &Joint) -> bool {
    let farthest = range(joint).map_or(0.0, |[lower, upper]| lower.abs().max(upper.abs()));
    joint.joint_type == JointType::Revolute && (FARTHEST + ROUNDING..UNLIMITED).contains(&farthest)
}

fn is_impossible(i: &urdf_rs::Inertia) -> bool {
    let matrix = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    let mut moments: [f64; 3] = matrix.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let [least, middle, largest] = moments;
    let beyond = ROUNDING * largest.abs();
    // Icub's files hold moments of 1e-35: next to nothing is no fault.
    largest.abs().max(least.abs()) > 1e-12 && (least < -beyond || largest > least + middle + beyond)
}
