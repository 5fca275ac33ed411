//! A run as the rows of a clip: where everything was and what was commanded, at a fixed rate.

use super::episode::{Episode, Run};
use super::start::StartError;
use super::{BodyPlan, Task};
use crate::world::{Hold, STEP};
use nalgebra::Isometry3;
use shared_mem::recording::{Episode as Recorded, EpisodeInfo, EpisodeMoment, RigidPose};

/// Rows of a recorded episode in a second.
pub const ROWS_A_SECOND: u32 = 100;

impl Task {
    /// Simulates an episode, and what is recorded of it.
    ///
    /// # Errors
    /// As [`Task::episode`].
    pub fn demonstration(&self, how: &Run) -> Result<(Episode, Recorded), StartError> {
        let of = |wanted: fn(&BodyPlan) -> bool| -> Vec<usize> {
            (0..self.bodies.len()).filter(|body| wanted(&self.bodies[*body])).collect()
        };
        let moved = of(|body| matches!(body.hold, Hold::Moved(_)));
        let joints = of(|body| matches!(body.hold, Hold::Joint(_)));
        let driven =
            of(|body| matches!(&body.hold, Hold::Joint(joint) if joint.drive.is_some() && joint.follows.is_none()));
        let mut moments = Vec::new();
        let episode = self.watched(how, |done, scene| {
            let world = scene.world;
            moments.push(EpisodeMoment {
                time_ns: (done as f64 * STEP * 1e9).round() as u64,
                poses: (0..self.bodies.len()).map(|body| rigid_pose(&world.pose(body))).collect(),
                targets: moved.iter().map(|body| rigid_pose(&scene.commanded(*body, done))).collect(),
                joints: joints.iter().filter_map(|body| world.joint(*body)).collect(),
                drives: driven.iter().filter_map(|body| world.driven_to(*body)).collect(),
                gripper: self.gripper.as_ref().and_then(|gripper| gripper.state(world, self.bodies.len())),
                arm: self.carrier.as_ref().and_then(|carrier| carrier.state(scene.way)).map(Box::new),
            });
        })?;
        let names = |bodies: &[usize]| bodies.iter().map(|body| self.bodies[*body].name.clone()).collect();
        let info = EpisodeInfo {
            task: self.name.clone(),
            seed: how.seed,
            noise_m: how.noise,
            success: episode.success,
            duration_s: episode.duration_s,
        };
        let object = self.bodies.iter().find(|body| matches!(body.hold, Hold::Free(_)));
        let recorded = Recorded {
            info,
            bodies: self.bodies.iter().map(|body| body.name.clone()).collect(),
            moved: names(&moved),
            joints: names(&joints),
            driven: names(&driven),
            object: object.map(|body| body.name.clone()),
            moments,
        };
        Ok((episode, recorded))
    }
}

fn rigid_pose(pose: &Isometry3<f64>) -> RigidPose {
    let q = pose.rotation.quaternion();
    RigidPose { position: pose.translation.vector.into(), wxyz: [q.w, q.i, q.j, q.k] }
}
