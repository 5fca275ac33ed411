//! Motion generators: what becomes of a client's set points, one a cycle. A set point is judged as the robot judges it, by
//! backward differences over its 1 ms and against the values that the state echoes, and one that does not come is
//! replaced by going on with the last acceleration.
//!
//! | file | owns |
//! |---|---|
//! | [`joint`] | joint positions and joint velocities |
//! | [`targets`] | sparse targets of the joints, which the robot plans to |
//! | [`cartesian`] | poses and twists of the end effector, with or without elbow |
//! | [`rules`] | how fast joints and end effector may go and change |

pub(super) mod cartesian;
pub(super) mod joint;
pub(super) mod rules;
mod targets;

use super::faults::Verdict;
use super::kinematics::Frame;
use super::settings::Settings;
use super::wire::{GeneratorKind, MotionRequest, SetPoint};
use crate::safety::Trace;
use cartesian::{CartesianGenerator, CartesianTrace};
use joint::JointGenerator;
use rules::JointRules;
use targets::TargetGenerator;
use twin::arm::{ArmModel, Joints};

/// What a generator needs to know about the arm.
#[derive(Clone, Copy)]
pub(super) struct Surroundings<'a> {
    /// The frame that the client commands.
    pub(super) ee: Frame<'a>,
    pub(super) rules: &'a JointRules,
}

impl<'a> Surroundings<'a> {
    /// The frame as `settings` have it, on an arm as the robot knows it.
    pub(super) fn new(model: &'a ArmModel, rules: &'a JointRules, settings: &Settings) -> Self {
        Self { ee: Frame { model, on_flange: settings.F_T_EE() }, rules }
    }
}

/// The generator of a running motion.
#[derive(Debug)]
pub(super) enum Generator {
    /// Torques alone: nothing is generated.
    None,
    Joint(JointGenerator),
    Targets(Box<TargetGenerator>),
    Cartesian(Box<CartesianGenerator>),
}

impl Generator {
    /// The one that `request` is about, starting at rest at `q`.
    pub(super) fn at_rest(request: &MotionRequest, q: &Joints, around: &Surroundings) -> Self {
        if let Some(fastest) = &request.targets {
            return Self::Targets(Box::new(TargetGenerator::at_rest(q, fastest, around.rules)));
        }
        match request.generator {
            GeneratorKind::None => Self::None,
            GeneratorKind::JointPosition => Self::Joint(JointGenerator::of_positions(q)),
            GeneratorKind::JointVelocity => Self::Joint(JointGenerator::of_velocities(q)),
            GeneratorKind::CartesianPose => Self::Cartesian(Box::new(CartesianGenerator::of_poses(q, around))),
            GeneratorKind::CartesianVelocity => Self::Cartesian(Box::new(CartesianGenerator::of_twists(q, around))),
        }
    }

    /// One cycle on: to where the client says, or on with the last acceleration where it says nothing.
    pub(super) fn follow(&mut self, set_point: Option<&SetPoint>, around: &Surroundings) -> Verdict {
        match self {
            Self::None => Ok(()),
            Self::Joint(joint) => joint.follow(set_point, around.rules),
            Self::Targets(targets) => targets.follow(set_point),
            Self::Cartesian(cartesian) => cartesian.follow(set_point, around),
        }
    }

    /// Whether the motion may end here: whoever ends it has to have come to rest.
    pub(super) fn finish(&self, around: &Surroundings) -> Verdict {
        match self {
            // The robot, which plans to targets by itself, also brakes by itself.
            Self::None | Self::Targets(_) => Ok(()),
            Self::Joint(joint) => joint.finish(around.rules),
            Self::Cartesian(cartesian) => cartesian.finish(around.rules),
        }
    }

    /// How the joints are to move; none where torques alone are commanded.
    pub(super) fn joints(&self) -> Option<&Trace> {
        match self {
            Self::None => None,
            Self::Joint(joint) => Some(joint.trace()),
            Self::Targets(targets) => Some(targets.trace()),
            Self::Cartesian(cartesian) => Some(cartesian.joints()),
        }
    }

    /// How the end effector was commanded to move, where it was.
    pub(super) fn end_effector(&self) -> Option<&CartesianTrace> {
        match self {
            Self::Cartesian(cartesian) => Some(cartesian.trace()),
            Self::None | Self::Joint(_) | Self::Targets(_) => None,
        }
    }
}
