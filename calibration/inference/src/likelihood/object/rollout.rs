//! One clip in the twin: the arm comes, hits, the object slides until it rests. Base frame, SI, stamps of the recording.
//!
//! A run has three parts, and the first two are kept: until the first touch nothing but the arm and the place of the
//! object counts; until the tool lets go the clip's nuisance parameters do not. So what differs by friction from clip to clip
//! costs the last part alone.

use super::cache::{Approach, ArmKey, ClipCache, Hit};
use super::clip::ObjectClip;
use super::nuisance::Values;
use super::outcome::{Outcome, Path};
use crate::estimate::Impossible;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::ending;
use shared_mem::frames::Pose;
use shared_mem::theta::{ObjectTheta, Theta};
use shared_mem::time::TICK_NS;
use std::sync::Arc;
use twin::arm::JointState;
use twin::control::CommandTrack;
use twin::replay::object_start;
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};
use twin::scene::ObjectModel;

/// The simulation ends when the object has rested for so many periods [1], a choice, and no recorded pose moves any more.
const REST_PERIODS: usize = 50;

/// What a simulation of one clip needs.
pub(super) struct Job<'a> {
    pub(super) cell: &'a Cell,
    pub(super) clip: &'a ObjectClip,
    pub(super) theta: &'a Theta,
    pub(super) own: &'a Values,
    /// When the joints are asked for [ns].
    pub(super) joints_ns: &'a [u64],
    pub(super) worker: &'a mut CellRollout,
    pub(super) cache: &'a ClipCache,
}

pub(super) fn impossible(error: impl std::fmt::Display) -> Impossible {
    Impossible(error.to_string())
}

/// A run that was interrupted has no answer, and its clock stands still.
fn not_interrupted() -> Result<(), Impossible> {
    if ending::asked() { Err(impossible("interrupted")) } else { Ok(()) }
}

impl Job<'_> {
    /// Simulates the clip.
    pub(super) fn run(mut self) -> Result<Outcome, Impossible> {
        self.worker.set_parameters(self.theta).map_err(impossible)?;
        let object = ObjectModel::new(self.cell, Some(self.theta)).map_err(impossible)?;
        let object = object.ok_or_else(|| impossible("the cell has no object"))?;
        match self.clip.recorded.kind {
            ClipKind::FreeMotion => self.let_go(&object),
            ClipKind::ControlHitSlide | ClipKind::Excitation => self.hit(&object),
        }
    }

    /// Where the object stands before it is hit.
    pub(super) fn standing(&self, object: &ObjectModel) -> Result<Isometry3<f64>, Impossible> {
        let series = self.clip.undistorted(&self.worker.cell().camera_effects());
        let rest = object_start::resting(&series, object, self.cell).ok_or_else(|| impossible("no object poses"))?;
        Ok(rest.isometry())
    }

    /// What was commanded, and the state in which the arm begins under the worker's parameters.
    pub(super) fn begun(&self) -> Result<(&CommandTrack, JointState), Impossible> {
        let commands = self.clip.commands.as_ref().ok_or_else(|| impossible("no commands"))?;
        let arm = self.worker.arm().ok_or_else(|| impossible("the cell has no arm"))?;
        let first = arm.start_state(&self.clip.recorded.measured, 0, commands);
        Ok((commands, first.ok_or_else(|| impossible("no measured joints"))?))
    }

    fn hit(&mut self, object: &ObjectModel) -> Result<Outcome, Impossible> {
        let camera = self.worker.cell().camera_effects();
        let start = self.standing(object)?;
        let hit = self.until_release(start)?;
        let (mut path, mut joints) = (hit.path.clone(), hit.joints.clone());
        if let Some(checkpoint) = &hit.checkpoint {
            self.with_own_friction(object)?;
            self.worker.resume(checkpoint);
            let (clip, mut rested) = (self.clip, 0);
            while self.worker.now_ns() < clip.end_ns && !(rested > REST_PERIODS && self.worker.now_ns() > clip.rest_ns)
            {
                not_interrupted()?;
                self.tick(&mut joints);
                let still = self.keep(&mut path)?;
                rested = if still { rested + 1 } else { 0 };
            }
        }
        let joints = joints.joints.iter().map(|reading| reading.state.q).collect();
        Ok(Outcome { object: path, joints, contact_ns: hit.contact_ns, camera })
    }

    /// From the start, or from what is kept, to the moment at which the tool has let go.
    fn until_release(&mut self, start: Isometry3<f64>) -> Result<Arc<Hit>, Impossible> {
        let cache = self.cache;
        cache.hits.at((self.theta.clone(), start), || {
            let key = ArmKey::new(self.theta, start);
            let approach = cache.approaches.at(key.clone(), || self.approach(&key, &start))?;
            let mut joints = approach.joints.clone();
            let mut path = Path { start_ns: approach.contact_ns.unwrap_or(0), poses: vec![start] };
            let mut checkpoint = None;
            if let Some(from) = &approach.checkpoint {
                self.worker.resume(from);
                while self.worker.now_ns() < self.clip.free_ns {
                    not_interrupted()?;
                    self.tick(&mut joints);
                    self.keep(&mut path)?;
                }
                checkpoint = Some(self.worker.checkpoint());
            }
            Ok(Hit { path, joints, checkpoint, contact_ns: approach.contact_ns })
        })
    }

    fn approach(&mut self, key: &ArmKey, start: &Isometry3<f64>) -> Result<Approach, Impossible> {
        self.worker.set_parameters(&key.theta()).map_err(impossible)?;
        let (_, first) = self.begun()?;
        let object = ObjectState::at_rest(Pose::from_isometry(*start));
        let commands = self.clip.commands.as_ref();
        self.worker.start(self.clip.recorded.measured.stamps_ns[0], Some(&first), Some(&object), commands);
        let mut joints = CellTrace::default();
        let end_ns = [self.clip.end_ns];
        let course = Course { commands, joints_ns: self.joints_ns, poses_ns: &end_ns };
        let contact_ns = self.worker.run_until_contact(&course, &mut joints);
        not_interrupted()?;
        let checkpoint = contact_ns.map(|_| self.worker.checkpoint());
        self.worker.set_parameters(self.theta).map_err(impossible)?;
        Ok(Approach { joints, checkpoint, contact_ns })
    }

    /// An object that somebody let go.
    fn let_go(&mut self, object: &ObjectModel) -> Result<Outcome, Impossible> {
        let camera = self.worker.cell().camera_effects();
        let series = self.clip.undistorted(&camera);
        let motion = object_start::moving(&series, object, self.cell).ok_or_else(|| impossible("too few poses"))?;
        let pose = motion.pose.isometry();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.own.start_yaw);
        let pose = Isometry3::from_parts((pose.translation.vector + self.own.start).into(), turn * pose.rotation);
        let state = ObjectState {
            pose: Pose::from_isometry(pose),
            velocity: motion.velocity + self.own.velocity,
            angular_velocity: motion.angular_velocity + self.own.spin,
        };
        self.with_own_friction(object)?;
        // What is reported first was one latency earlier.
        let start_ns = self.clip.recorded.object.stamps_ns[0].saturating_sub(camera.latency_ns());
        self.worker.start(start_ns, None, Some(&state), None);
        let (mut path, mut rested) = (Path { start_ns, poses: vec![pose] }, 0);
        while self.worker.now_ns() < self.clip.end_ns && rested <= REST_PERIODS {
            not_interrupted()?;
            self.worker.tick(None);
            rested = if self.keep(&mut path)? { rested + 1 } else { 0 };
        }
        Ok(Outcome { object: path, joints: Vec::new(), contact_ns: None, camera })
    }

    fn tick(&mut self, joints: &mut CellTrace) {
        let course = Course { commands: self.clip.commands.as_ref(), joints_ns: self.joints_ns, poses_ns: &[] };
        self.worker.run_until(self.worker.now_ns() + TICK_NS, &course, joints);
    }

    /// Notes where the object is; whether it rests.
    fn keep(&self, path: &mut Path) -> Result<bool, Impossible> {
        let state = self.worker.object().ok_or_else(|| impossible("the cell has no object"))?;
        let pose = state.pose.isometry();
        if !pose.translation.vector.iter().all(|v| v.abs() < 1e3) {
            return Err(impossible("the simulated object flew away"));
        }
        path.poses.push(pose);
        Ok(state.velocity == Vector3::zeros() && state.angular_velocity == Vector3::zeros())
    }

    fn with_own_friction(&mut self, object: &ObjectModel) -> Result<(), Impossible> {
        let factor = self.own.ln_friction.exp();
        let mut theta = self.theta.clone();
        theta.object.get_or_insert_with(ObjectTheta::default).friction = Some(object.friction * factor);
        self.worker.set_parameters(&theta).map_err(impossible)
    }
}
