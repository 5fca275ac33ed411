//! A base that moves under an arm: what lets it float, or slide and turn over the floor, is no joint of the arm's.

use super::{Tree, isometry};
use nalgebra::{UnitQuaternion, Vector3};
use urdf_rs::{Joint, JointType};

/// A link by which a base slides or turns has less than this share of the mass that it carries: it stands for no part. A gantry's beam has
/// a tenth and more.
const LIGHT: f64 = 0.01;

impl<'a> Tree<'a> {
    /// Joints of a base that moves: those that let it float or slide over the floor.
    pub(super) fn moving_base(&self) -> Vec<(&'a Joint, String)> {
        let mut moving = Vec::new();
        let mut open = vec![self.root];
        while let Some(link) = open.pop() {
            for joint in self.behind(link) {
                if self.carries_base(joint) {
                    moving.push((joint, "lets the base move".to_owned()));
                }
                if joint.joint_type == JointType::Fixed || self.carries_base(joint) {
                    open.push(&joint.child.link);
                }
            }
        }
        moving
    }

    /// Whether a joint at the root is no joint of an arm, but of a base that moves: one of many ways, or one of two slides and a turn
    /// across them, of which the first two carry next to no mass of their own.
    pub(super) fn carries_base(&self, joint: &Joint) -> bool {
        if [JointType::Floating, JointType::Planar].contains(&joint.joint_type) {
            return true;
        }
        let of_base = self.across_the_floor();
        self.are_without_mass(&of_base) && of_base.iter().any(|of_base| of_base.name == joint.name)
    }

    /// Joints that move over the floor as a base does, and carry masses of their own: an arm on a gantry has them too.
    pub(super) fn perhaps_of_base(&self) -> Vec<&'a Joint> {
        let of_base = self.across_the_floor();
        if self.are_without_mass(&of_base) { Vec::new() } else { of_base }
    }

    /// Two slides and a turn about what is across them, in any order, one behind the other from the root on.
    fn across_the_floor(&self) -> Vec<&'a Joint> {
        let (mut found, mut axes, mut link) = (Vec::new(), Vec::new(), self.root);
        let mut turn = UnitQuaternion::identity();
        while found.len() < 3 {
            let (mut open, mut moving) = (vec![(link, turn)], Vec::new());
            while let Some((link, turn)) = open.pop() {
                for joint in self.behind(link) {
                    let there = turn * isometry(&joint.origin).rotation;
                    if joint.joint_type == JointType::Fixed {
                        open.push((&joint.child.link, there));
                    } else {
                        moving.push((joint, there));
                    }
                }
            }
            let [(one, there)] = moving[..] else { return Vec::new() };
            axes.push(there * Vector3::from(one.axis.xyz.0).try_normalize(1e-9).unwrap_or_default());
            found.push(one);
            (link, turn) = (&one.child.link, there);
        }
        let slides = found.iter().filter(|joint| joint.joint_type == JointType::Prismatic).count();
        let turning = [JointType::Revolute, JointType::Continuous];
        let turns = found.iter().filter(|joint| turning.contains(&joint.joint_type)).count();
        let across = [(0, 1), (0, 2), (1, 2)].iter().all(|(a, b)| axes[*a].dot(&axes[*b]).abs() < 1e-6);
        if slides == 2 && turns == 1 && across { found } else { Vec::new() }
    }

    /// Whether what the first two of these joints carry has next to no mass, against all that hangs on it.
    fn are_without_mass(&self, joints: &[&'a Joint]) -> bool {
        joints.iter().take(2).all(|joint| {
            let (mut own, mut all) = (0.0, 0.0);
            let mut open = vec![(joint.child.link.as_str(), true)];
            while let Some((name, is_own)) = open.pop() {
                let link = self.robot.links.iter().find(|link| link.name == name);
                let mass = link.map_or(0.0, |link| link.inertial.mass.value);
                all += mass;
                own += if is_own { mass } else { 0.0 };
                let behind = self.behind(name);
                open.extend(
                    behind.map(|joint| (joint.child.link.as_str(), is_own && joint.joint_type == JointType::Fixed)),
                );
            }
            own <= LIGHT * all
        })
    }
}
