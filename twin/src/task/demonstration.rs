//! A run as the rows of a clip: where everything was and what was commanded, at a fixed rate.

use super::arm::CarrierCommand;
use super::episode::{Episode, Run};
use super::start::StartError;
use super::{BodyPlan, Task};
use crate::world::{Hold, STEP, World};
use nalgebra::Isometry3;
use shared_mem::recording::{Episode as Recorded, EpisodeInfo, EpisodeMoment, RigidPose};

/// Rows of a recorded episode in a second.
pub const ROWS_A_SECOND: u32 = 100;

/// Which bodies the columns of a recording are about.
#[derive(Debug)]
pub(super) struct Columns {
    moved: Vec<usize>,
    joints: Vec<usize>,
    driven: Vec<usize>,
}

impl Columns {
    pub(super) fn of(task: &Task) -> Self {
        let of = |wanted: fn(&BodyPlan) -> bool| -> Vec<usize> {
            (0..task.bodies.len()).filter(|body| wanted(&task.bodies[*body])).collect()
        };
        Self {
            moved: of(|body| matches!(body.hold, Hold::Moved(_))),
            joints: of(|body| matches!(body.hold, Hold::Joint(_))),
            driven: of(
                |body| matches!(&body.hold, Hold::Joint(joint) if joint.drive.is_some() && joint.follows.is_none()),
            ),
        }
    }

    /// The row after so many steps; `commanded` says where a moved body is commanded to be.
    pub(super) fn moment(
        &self,
        task: &Task,
        world: &World,
        done: usize,
        command: &CarrierCommand,
        commanded: impl Fn(usize) -> Isometry3<f64>,
    ) -> EpisodeMoment {
        EpisodeMoment {
            time_ns: (done as f64 * STEP * 1e9).round() as u64,
            poses: (0..task.bodies.len()).map(|body| rigid_pose(&world.pose(body))).collect(),
            targets: self.moved.iter().map(|body| rigid_pose(&commanded(*body))).collect(),
            joints: self.joints.iter().filter_map(|body| world.joint(*body)).collect(),
            drives: self.driven.iter().filter_map(|body| world.driven_to(*body)).collect(),
            gripper: task.gripper.as_ref().and_then(|gripper| gripper.state(world, task.bodies.len())),
            arm: task.carrier.as_ref().and_then(|carrier| carrier.state(command, world)).map(Box::new),
        }
    }

    pub(super) fn recorded(&self, task: &Task, info: EpisodeInfo, moments: Vec<EpisodeMoment>) -> Recorded {
        let names = |bodies: &[usize]| bodies.iter().map(|body| task.bodies[*body].name.clone()).collect();
        let object = task.bodies.iter().find(|body| matches!(body.hold, Hold::Free(_)));
        Recorded {
            info,
            bodies: task.bodies.iter().map(|body| body.name.clone()).collect(),
            moved: names(&self.moved),
            joints: names(&self.joints),
            driven: names(&self.driven),
            object: object.map(|body| body.name.clone()),
            moments,
        }
    }
}

impl Task {
    /// Simulates an episode, and what is recorded of it.
    ///
    /// # Errors
    /// As [`Task::episode`].
    pub fn demonstration(&self, how: &Run) -> Result<(Episode, Recorded), StartError> {
        let columns = Columns::of(self);
        let mut moments = Vec::new();
        let episode = self.watched(how, |done, scene| {
            moments.push(columns.moment(self, scene.world, done, scene.command, |body| scene.commanded(body, done)));
        })?;
        let info = EpisodeInfo {
            task: self.name.clone(),
            seed: how.seed,
            noise_m: how.noise,
            success: episode.success,
            duration_s: episode.duration_s,
        };
        let recorded = columns.recorded(self, info, moments);
        Ok((episode, recorded))
    }
}

pub(super) fn rigid_pose(pose: &Isometry3<f64>) -> RigidPose {
    let q = pose.rotation.quaternion();
    RigidPose { position: pose.translation.vector.into(), wxyz: [q.w, q.i, q.j, q.k] }
}
