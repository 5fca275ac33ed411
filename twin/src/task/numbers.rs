//! Which numbers of a run are state, surroundings and action, for whoever learns from it or acts by it: single precision, in one
//! order, by names.

use super::{Action, Task};
use crate::world::Hold;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::{Episode, EpisodeMoment, RigidPose};

/// The numbers of a task: `BODY.x` to `BODY.qz` of a pose, `gripper.width`, `BODY.joint`, `JOINT.pos` of the arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Numbers {
    bodies: Vec<String>,
    /// Moved bodies, by their place in the task.
    moved: Vec<usize>,
    /// Bodies that nothing but contacts moves.
    free: Vec<usize>,
    /// Joints with a drive that is not the gripper's: by their place among joints, among drives and among bodies.
    driven: Vec<[usize; 3]>,
    /// Joints that nothing but contacts moves, by their place among joints and among bodies.
    passive: Vec<[usize; 2]>,
    gripper: bool,
    /// Joints of the arm; none without one.
    arm: Vec<String>,
}

/// Which of the two quaternions of each rotation was written last: the next is the nearer one.
#[derive(Debug, Clone, Default)]
pub struct Signs {
    moved: Vec<Option<Quaternion<f64>>>,
    free: Vec<Option<Quaternion<f64>>>,
}

impl Numbers {
    /// Those of a task.
    pub fn of(task: &Task) -> Self {
        let gripper = task.gripper_drive();
        let mut numbers = Self {
            bodies: task.bodies().iter().map(|body| body.name.clone()).collect(),
            moved: Vec::new(),
            free: Vec::new(),
            driven: Vec::new(),
            passive: Vec::new(),
            gripper: gripper.is_some(),
            arm: task.arm_joints().to_vec(),
        };
        let (mut joints, mut drives) = (0, 0);
        for (place, body) in task.bodies().iter().enumerate() {
            match &body.hold {
                Hold::Fixed(_) => {}
                Hold::Moved(_) | Hold::Arm(_) => numbers.moved.push(place),
                Hold::Free(_) => numbers.free.push(place),
                Hold::Joint(joint) => {
                    match (joint.follows, joint.drive) {
                        (None, Some(_)) => {
                            if gripper != Some(place) {
                                numbers.driven.push([joints, drives, place]);
                            }
                            drives += 1;
                        }
                        (None, None) => numbers.passive.push([joints, place]),
                        // It has no freedom of its own.
                        (Some(_), _) => {}
                    }
                    joints += 1;
                }
            }
        }
        numbers
    }

    /// Refuses an episode of another task.
    ///
    /// # Errors
    /// What differs and what to do.
    pub fn fits(&self, episode: &Episode) -> Result<(), String> {
        let has = episode.moments.first().map(|row| [row.gripper.is_some(), row.arm.is_some()]);
        let asked = Some([self.gripper, !self.arm.is_empty()]);
        if episode.bodies == self.bodies && has == asked && episode.moved.len() == self.moved.len() {
            return Ok(());
        }
        let (recorded, known) = (episode.bodies.join(", "), self.bodies.join(", "));
        Err(format!(
            "it was recorded of {recorded}, the task is of {known}, or with another arm or gripper; give the task file it was recorded with"
        ))
    }

    fn poses(&self, bodies: &[usize]) -> Vec<String> {
        let pose =
            |body: &usize| ["x", "y", "z", "qw", "qx", "qy", "qz"].map(|axis| format!("{}.{axis}", self.bodies[*body]));
        bodies.iter().flat_map(pose).collect()
    }

    /// Names of the state's numbers, and of an action's.
    pub fn state_names(&self) -> Vec<String> {
        let mut names = self.poses(&self.moved);
        names.extend(self.gripper.then(|| "gripper.width".to_owned()));
        names.extend(self.driven.iter().map(|[_, _, body]| format!("{}.joint", self.bodies[*body])));
        names.extend(self.arm.iter().map(|joint| format!("{joint}.pos")));
        names
    }

    /// Names of the surroundings' numbers: free bodies, joints without a drive.
    pub fn surroundings_names(&self) -> Vec<String> {
        let mut names = self.poses(&self.free);
        names.extend(self.passive.iter().map(|[_, body]| format!("{}.joint", self.bodies[*body])));
        names
    }

    /// What is: moved bodies, gripper, driven joints, arm.
    pub fn state(&self, row: &EpisodeMoment, signs: &mut Signs) -> Vec<f32> {
        signs.moved.resize(self.moved.len(), None);
        let mut state = Vec::new();
        for (body, sign) in self.moved.iter().zip(&mut signs.moved) {
            *sign = Some(put_pose(&mut state, &row.poses[*body], *sign));
        }
        state.extend(row.gripper.map(|gripper| gripper.width as f32));
        state.extend(self.driven.iter().map(|[joint, ..]| row.joints[*joint] as f32));
        if let Some(arm) = &row.arm {
            state.extend(arm.q[..self.arm.len()].iter().map(|q| *q as f32));
        }
        state
    }

    /// What is around: free bodies, joints without a drive.
    pub fn surroundings(&self, row: &EpisodeMoment, signs: &mut Signs) -> Vec<f32> {
        signs.free.resize(self.free.len(), None);
        let mut around = Vec::new();
        for (body, sign) in self.free.iter().zip(&mut signs.free) {
            *sign = Some(put_pose(&mut around, &row.poses[*body], *sign));
        }
        around.extend(self.passive.iter().map(|[joint, _]| row.joints[*joint] as f32));
        around
    }

    /// What is commanded at a moment, in the order of the state; `signs` are those of the state before it.
    pub fn action(&self, next: &EpisodeMoment, signs: &Signs) -> Vec<f32> {
        let mut action = Vec::new();
        for (i, target) in next.targets.iter().enumerate() {
            put_pose(&mut action, target, signs.moved.get(i).copied().flatten());
        }
        action.extend(next.gripper.map(|gripper| gripper.width_d as f32));
        action.extend(self.driven.iter().map(|[_, drive, _]| next.drives[*drive] as f32));
        if let Some(arm) = &next.arm {
            action.extend(arm.q_d[..self.arm.len()].iter().map(|q| *q as f32));
        }
        action
    }

    /// An action out of its numbers, in the order of [`Numbers::state_names`].
    ///
    /// # Errors
    /// How many numbers are needed, or the name of one that is none.
    pub fn read(&self, values: &[f32]) -> Result<Action, String> {
        let names = self.state_names();
        if values.len() != names.len() {
            return Err(format!("an action has {} numbers ({}), not {}", names.len(), names.join(", "), values.len()));
        }
        if let Some(wrong) = values.iter().position(|value| !value.is_finite()) {
            return Err(format!("`{}` of an action is {}", names[wrong], values[wrong]));
        }
        let mut left = values.iter().map(|value| f64::from(*value));
        let mut next = || left.next().unwrap_or_default();
        let mut action = Action::default();
        for body in &self.moved {
            let [x, y, z, w, i, j, k] = std::array::from_fn(|_| next());
            let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-3);
            let turn =
                turn.ok_or_else(|| format!("the quaternion of `{}` in an action has no length", self.bodies[*body]))?;
            action.bodies.push((*body, Isometry3::from_parts(Translation3::new(x, y, z), turn)));
        }
        action.width = self.gripper.then(&mut next);
        for [_, _, body] in &self.driven {
            action.drives.push((*body, next()));
        }
        if !self.arm.is_empty() {
            let dof = self.arm.len().min(MAX_JOINTS);
            let mut joints = [0.0; MAX_JOINTS];
            joints[..dof].fill_with(&mut next);
            action.joints = Some(joints);
        }
        Ok(action)
    }
}

/// Adds a pose; of the two quaternions of its rotation the one that is nearer to another, at first that with a positive w.
fn put_pose(into: &mut Vec<f32>, pose: &RigidPose, near: Option<Quaternion<f64>>) -> Quaternion<f64> {
    let [w, i, j, k] = pose.wxyz;
    let given = Quaternion::new(w, i, j, k);
    let rotation = if given.dot(&near.unwrap_or_else(Quaternion::identity)) < 0.0 { -given } else { given };
    into.extend(pose.position.map(|v| v as f32));
    into.extend([rotation.w, rotation.i, rotation.j, rotation.k].map(|v| v as f32));
    rotation
}
