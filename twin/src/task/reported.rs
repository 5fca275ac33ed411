//! A task on a robot: what the robot reports as a row of the task, and what an action asks of its joints.

use super::demonstration::rigid_pose;
use super::{Action, Task};
use crate::arm::Joints;
use crate::world::Hold;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::gripper::GripperState;
use shared_mem::recording::EpisodeMoment;

/// A pose that is missed by more is out of reach [m, rad].
const MISSED: [f64; 2] = [2e-3, 1e-2];

impl Task {
    /// Refuses a task that a robot cannot act in.
    ///
    /// # Errors
    /// What it has that nobody on a robot could move or report.
    pub fn suits_a_robot(&self) -> Result<(), String> {
        if self.carrier.is_none() {
            return Err("it has no arm; give it an [arm] block (docs/tasks.md)".to_owned());
        }
        let gripper = self.gripper_drive();
        let other = self.bodies.iter().enumerate().find(|(body, plan)| {
            matches!(&plan.hold, Hold::Joint(joint) if joint.drive.is_some() && joint.follows.is_none())
                && Some(*body) != gripper
        });
        match other {
            Some((_, plan)) => Err(format!("`{}` has a drive that is no gripper's, which no robot moves", plan.name)),
            None => Ok(()),
        }
    }

    /// What a robot reports as a row: the arm, what it carries, the gripper. Of other bodies nothing is known: they stand where the
    /// task file has them.
    pub fn reported(&self, arm: &ArmState, gripper: Option<&GripperState>) -> EpisodeMoment {
        let carrier = self.carrier.as_ref();
        let pose = |body: usize| match (carrier, &self.bodies[body].hold) {
            (Some(carrier), _) if carrier.body == body => carrier.body_at(&arm.q),
            (_, Hold::Fixed(at) | Hold::Moved(at) | Hold::Free(at)) => *at,
            (_, Hold::Joint(joint)) => joint.at,
            (_, Hold::Arm(arm)) => arm.body_at_start(),
        };
        EpisodeMoment {
            time_ns: 0,
            poses: (0..self.bodies.len()).map(|body| rigid_pose(&pose(body))).collect(),
            targets: Vec::new(),
            joints: Vec::new(),
            drives: Vec::new(),
            gripper: self.gripper.is_some().then(|| gripper.copied().unwrap_or_default()),
            arm: Some(Box::new(*arm)),
        }
    }

    /// Joints of the arm that an action asks for, near to others; `None` where it asks for none.
    ///
    /// # Errors
    /// That a pose is out of reach.
    pub fn joints_of(&self, action: &Action, from: &Joints) -> Result<Option<Joints>, String> {
        if let Some(joints) = action.joints {
            return Ok(Some(joints));
        }
        let Some(carrier) = &self.carrier else { return Ok(None) };
        let Some((_, body)) = action.bodies.iter().find(|(body, _)| *body == carrier.body) else { return Ok(None) };
        let found = carrier.nearest(from, &carrier.flange_for(body));
        if found.off > MISSED[0] || found.turned > MISSED[1] {
            let [x, y, z] = body.translation.vector.into();
            return Err(format!("it does not reach ({x:.3}, {y:.3}, {z:.3}) m"));
        }
        Ok(Some(found.q))
    }
}
