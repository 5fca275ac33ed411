//! A base that moves under an arm: what lets it float, or slide and turn over the floor, is no joint of the arm's.

use super::Tree;
use nalgebra::Vector3;
use urdf_rs::{Joint, JointType};

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
    /// across them, of which the first two carry no mass.
    pub(super) fn carries_base(&self, joint: &Joint) -> bool {
        if [JointType::Floating, JointType::Planar].contains(&joint.joint_type) {
            return true;
        }
        self.planar_base().iter().any(|of_base| of_base.name == joint.name)
    }

    /// Two slides and a turn about what is across them, one behind the other from the root on, the slides without mass.
    fn planar_base(&self) -> Vec<&'a Joint> {
        let (mut found, mut link) = (Vec::new(), self.root);
        while found.len() < 3 {
            let (mut open, mut moving) = (vec![link], Vec::new());
            while let Some(link) = open.pop() {
                for joint in self.behind(link) {
                    if joint.joint_type == JointType::Fixed { open.push(&joint.child.link) } else { moving.push(joint) }
                }
            }
            let [one] = moving[..] else { return Vec::new() };
            found.push(one);
            link = &one.child.link;
        }
        let [x, y, turn] = found[..] else { return Vec::new() };
        let axis = |joint: &Joint| Vector3::from(joint.axis.xyz.0).try_normalize(1e-9).unwrap_or_default();
        let slides = |joint: &Joint| {
            let mass = self
                .robot
                .links
                .iter()
                .find(|link| link.name == joint.child.link)
                .map_or(0.0, |l| l.inertial.mass.value);
            joint.joint_type == JointType::Prismatic && mass == 0.0
        };
        let turns = [JointType::Revolute, JointType::Continuous].contains(&turn.joint_type);
        let across = [(x, y), (x, turn), (y, turn)].iter().all(|(a, b)| axis(a).dot(&axis(b)).abs() < 1e-6);
        if slides(x) && slides(y) && turns && across { found } else { Vec::new() }
    }
}
