//! Every frame of a URDF, as ROS's `robot_state_publisher` has them: a link is where its joint puts it in the link before, fixed
//! links, hands and fingers included.

use super::{isometry, rest};
use crate::arm::ModelError;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use std::path::Path;
use urdf_rs::JointType;

/// The frames of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfFrames {
    root: String,
    joints: Vec<FrameJoint>,
}

/// A link's frame in that of the link before.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFrame<'a> {
    /// The link before.
    pub parent: &'a str,
    pub child: &'a str,
    /// Its frame in that of the link before [m].
    pub parent_from_child: Isometry3<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct FrameJoint {
    name: String,
    parent: String,
    child: String,
    origin: Isometry3<f64>,
    motion: Motion,
    /// Where it is held when nobody says where it is.
    rest: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    None,
    Turns(Unit<Vector3<f64>>),
    Slides(Unit<Vector3<f64>>),
}

impl UrdfFrames {
    /// Reads a URDF's text; `name` stands for the file in errors.
    ///
    /// # Errors
    /// [`ModelError`] when it is no URDF or no tree of links.
    pub fn of(text: &str, name: &Path) -> Result<Self, ModelError> {
        let robot = super::read(text, name)?;
        let tree = super::Tree::of(&robot, name)?;
        let joint = |joint: &urdf_rs::Joint| {
            let motion = match joint.joint_type {
                JointType::Fixed => Motion::None,
                JointType::Prismatic => Motion::Slides(tree.axis(joint)?),
                JointType::Revolute | JointType::Continuous => Motion::Turns(tree.axis(joint)?),
                // One that moves in more than one way is none of the arm's: its link stays where the file puts it.
                _ => Motion::None,
            };
            Ok::<_, ModelError>(FrameJoint {
                name: joint.name.clone(),
                parent: joint.parent.link.clone(),
                child: joint.child.link.clone(),
                origin: isometry(&joint.origin),
                motion,
                rest: rest(joint),
            })
        };
        let joints = robot.joints.iter().map(joint).collect::<Result<_, _>>()?;
        Ok(Self { root: tree.root.to_owned(), joints })
    }

    /// With other names for these joints, one for each.
    pub fn renamed(mut self, described: &[String], names: &[String]) -> Self {
        for joint in &mut self.joints {
            let place = described.iter().position(|described| *described == joint.name);
            if let Some(name) = place.and_then(|place| names.get(place)) {
                joint.name.clone_from(name);
            }
        }
        self
    }

    /// Name of the link that hangs on nothing.
    pub fn root(&self) -> &str {
        &self.root
    }

    /// Frames that stay where they are while the joints of these names move: of fixed joints, and of others that nobody moves, at
    /// 0 or as near to it as their range allows.
    pub fn fixed<'a>(&'a self, moved: &'a [String]) -> impl Iterator<Item = LinkFrame<'a>> {
        let stays = move |joint: &&FrameJoint| joint.motion == Motion::None || !moved.contains(&joint.name);
        self.joints.iter().filter(stays).map(|joint| joint.at(joint.rest))
    }

    /// Frames of the joints of these names at these positions [rad, or m].
    pub fn moving<'a>(&'a self, names: &'a [String], q: &'a [f64]) -> impl Iterator<Item = LinkFrame<'a>> {
        let moved = self.joints.iter().filter(|joint| joint.motion != Motion::None);
        moved.filter_map(move |joint| {
            let position = names.iter().zip(q).find(|(name, _)| **name == joint.name).map(|(_, q)| *q)?;
            Some(joint.at(position))
        })
    }
}

impl FrameJoint {
    fn at(&self, position: f64) -> LinkFrame<'_> {
        let moved = match self.motion {
            Motion::None => Isometry3::identity(),
            Motion::Turns(axis) => {
                Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, position))
            }
            Motion::Slides(axis) => Translation3::from(axis.into_inner() * position).into(),
        };
        LinkFrame { parent: &self.parent, child: &self.child, parent_from_child: self.origin * moved }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAND: &str = "<robot name='r'><link name='base'/><link name='a'/><link name='tip'/><link name='finger'/>\
        <joint name='j' type='revolute'><parent link='base'/><child link='a'/><origin xyz='0 0 1' rpy='0 0 0.5'/><axis xyz='0 0 1'/>\
        <limit lower='-1' upper='1' effort='1' velocity='1'/></joint>\
        <joint name='t' type='fixed'><parent link='a'/><child link='tip'/><origin xyz='0.2 0 0'/></joint>\
        <joint name='f' type='prismatic'><parent link='a'/><child link='finger'/><axis xyz='0 1 0'/>\
        <limit lower='0.01' upper='0.04' effort='1' velocity='1'/></joint></robot>";

    #[test]
    fn what_moves_is_where_its_joint_puts_it_and_all_else_is_there_too() {
        let frames = UrdfFrames::of(HAND, Path::new("hand.urdf")).expect("a URDF");
        let names = ["j".to_owned()];
        assert_eq!(frames.root(), "base");
        let moving: Vec<LinkFrame<'_>> = frames.moving(&names, &[0.25]).collect();
        let [a] = moving.as_slice() else { panic!("{moving:?}") };
        assert_eq!((a.parent, a.child), ("base", "a"));
        assert!((a.parent_from_child.rotation.euler_angles().2 - 0.75).abs() < 1e-15);
        let fixed: Vec<(&str, Vector3<f64>)> =
            frames.fixed(&names).map(|frame| (frame.child, frame.parent_from_child.translation.vector)).collect();
        assert_eq!(fixed, [("tip", Vector3::new(0.2, 0.0, 0.0)), ("finger", Vector3::new(0.0, 0.01, 0.0))]);
    }

    #[test]
    fn a_link_that_floats_stays_where_the_file_puts_it() {
        let floating = HAND.replace("type='fixed'", "type='floating'");
        let frames = UrdfFrames::of(&floating, Path::new("hand.urdf")).expect("a URDF");
        assert!(frames.fixed(&["j".to_owned()]).any(|frame| (frame.parent, frame.child) == ("a", "tip")));
    }
}
