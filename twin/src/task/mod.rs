//! Tasks: bodies, where they may start, what counts as success, and a scripted motion that shows it. Read from a task file
//! (docs/tasks.md has every key), placed by a seed, simulated in a [`crate::world`].
//!
//! | file | owns |
//! |---|---|
//! | `file` | the keys of a task file |
//! | `read` | bodies, conditions and motions out of it, and what is wrong with it |
//! | `articulated` | bodies on joints out of URDF files |
//! | `surface` | the convex pieces of a body |
//! | `start` | where bodies start: drawn by a seed until none overlap |
//! | `arm` | the arm that carries a moved body: joints, and what it cannot do |
//! | `cell` | the cell in which it is carried out: the arm under its controller, what was identified |
//! | `camera` | pictures of an episode, drawn afterwards |
//! | `condition` | what counts as success |
//! | `motion` | where moved bodies go and what drives do, by time |
//! | `progress` | how far a run came towards success |
//! | `episode` | one run: did it come to rest, where, and was it a success |
//! | `gripper` | two fingers on geared joints as a gripper with an opening |
//! | `demonstration` | a run as the rows of a clip |
//! | `numbers` | which numbers of a run are state, surroundings and action, for whoever learns |
//! | `reported` | what a robot reports as a row of a task, and what an action asks of its joints |
//! | `steered` | a run that a person steers |
//! | `acting` | a run that a policy steers |

mod acting;
mod arm;
mod articulated;
mod built_in;
mod camera;
mod cell;
mod condition;
mod demonstration;
mod episode;
mod file;
mod gripper;
mod motion;
mod numbers;
mod progress;
mod read;
mod reported;
mod start;
mod steered;
mod surface;

pub use acting::{Acting, ActingEnd, Action};
pub use camera::{TaskCamera, TaskPicture, TaskView};
pub use cell::InCellError;
pub use demonstration::ROWS_A_SECOND;
pub use episode::{ArmEnd, BodyEnd, Episode, Place, Run};
pub use numbers::{Numbers, Signs};
pub use start::StartError;
pub use steered::{Jog, SteerError, Steered};

use crate::world::{BodyPlan, Hold, World};
use arm::Carrier;
use cell::TaskCell;
use condition::Condition;
use gripper::Gripper;
use motion::Motions;
#[cfg(feature = "teleop")]
use nalgebra::Point3;
#[cfg(feature = "teleop")]
use shared_mem::recording::RigidPose;
use shared_mem::toml_file::TomlFileError;
use start::StartRange;
use std::path::Path;

/// A task, ready to be started as often as wanted.
#[derive(Debug, Clone)]
pub struct Task {
    /// Its file's, without the ending.
    name: String,
    /// What is to be done, in words.
    instruction: String,
    /// The whole file.
    text: String,
    bodies: Vec<BodyPlan>,
    /// Red, green and blue of the bodies as far as the file gives them; the last bodies have none.
    colours: Vec<Option<[u8; 3]>>,
    world: World,
    starts: Vec<StartRange>,
    conditions: Vec<Condition>,
    motions: Motions,
    gripper: Option<Gripper>,
    cameras: Vec<TaskCamera>,
    carrier: Option<Carrier>,
    /// Where it is carried out; `None`: everything moved is where it is commanded to be.
    cell: Option<TaskCell>,
    /// For how long all conditions have to hold [s].
    hold: f64,
    /// How long an episode takes at most [s].
    horizon: f64,
}

impl Task {
    /// Reads a task file; meshes lie relative to it. The name of a task that ships with the project, `push_milk`, is that task unless
    /// there is a file of that name.
    ///
    /// # Errors
    /// [`TomlFileError`] with file, line and key of what is wrong.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        read::read(path)
    }

    /// Its name: that of its file, without the ending.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What is to be done, in words.
    pub fn instruction(&self) -> &str {
        &self.instruction
    }

    /// Corners of all bodies that may move, where these are their poses, world frame [m].
    #[cfg(feature = "teleop")]
    pub(crate) fn movable(&self, poses: &[RigidPose]) -> impl Iterator<Item = Point3<f64>> {
        let moves = |(body, _): &(&BodyPlan, &RigidPose)| !matches!(body.hold, Hold::Fixed(_));
        self.bodies.iter().zip(poses).filter(moves).flat_map(|(body, pose)| {
            let world_from_body = camera::isometry(pose);
            body.pieces
                .iter()
                .flat_map(move |piece| piece.hull.corners.iter().map(move |corner| world_from_body * piece.at * corner))
        })
    }

    /// Names of the joints of the arm that carries a moved body; empty without one.
    pub fn arm_joints(&self) -> &[String] {
        self.carrier.as_ref().map_or(&[], Carrier::joint_names)
    }

    /// The body whose drive opens and closes the gripper, by its place.
    pub fn gripper_drive(&self) -> Option<usize> {
        self.gripper.as_ref().map(Gripper::drive)
    }

    /// What counts as success, in words.
    pub fn conditions(&self) -> Vec<String> {
        self.conditions.iter().map(|condition| condition.words(&self.bodies)).collect()
    }

    /// Opening of the gripper when it is closed and when it is open [m]; `None` without one.
    pub fn gripper_range(&self) -> Option<[f64; 2]> {
        self.gripper.as_ref()?.range(&self.bodies)
    }

    /// Whether it has fingers to open and close.
    pub fn has_gripper(&self) -> bool {
        self.gripper.is_some()
    }

    /// A body and all that hangs on it by joints.
    fn carried(&self, body: usize) -> Vec<usize> {
        let mut carried = vec![body];
        for (i, plan) in self.bodies.iter().enumerate() {
            if let Hold::Joint(joint) = &plan.hold
                && joint.parent.is_some_and(|parent| carried.contains(&parent))
            {
                carried.push(i);
            }
        }
        carried
    }

    /// The text of its file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Its bodies, in their order.
    pub fn bodies(&self) -> &[BodyPlan] {
        &self.bodies
    }

    /// How long an episode takes at most [s].
    pub fn horizon(&self) -> f64 {
        self.horizon
    }
}
