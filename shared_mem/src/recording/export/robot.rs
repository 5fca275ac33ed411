//! The robot as ROS programs expect it beside any recording of one: its description, its joints, and its frames. What moves is
//! calculated by whoever knows the robot's kinematics; here it becomes messages.

use super::super::robot::{JOINT_STATES, ROBOT_DESCRIPTION, RobotModel, TF, TF_STATIC, Transform};
use super::super::ros2::JointState;
use super::bag::Bag;
use super::encode::{self, ROS_CAMERA_FRAME};
use crate::cell::Cell;
use crate::recording::JointSeries;

/// Least time between two messages on `/tf` [ns]: viewers draw no faster, and a link's frame takes a hundred bytes.
const FRAMES_NS: u64 = 10_000_000;

/// What is written of a robot, row by row of what it did.
pub(super) struct RobotTopics<'a> {
    model: &'a RobotModel,
    names: &'a [String],
    /// Frames that stay where they are, the camera's among them.
    fixed: Vec<Transform>,
    /// Whether the measured joints stand on `/joint_states` already.
    has_joint_states: bool,
    begun: bool,
    /// When frames were written last [ns].
    frames_ns: Option<u64>,
}

impl<'a> RobotTopics<'a> {
    /// Of joints of these names, in the cell that was recorded.
    pub(super) fn new(model: &'a RobotModel, names: &'a [String], cell: &Cell) -> Self {
        let fixed = model.fixed.iter().cloned().chain(Transform::of_camera(cell, ROS_CAMERA_FRAME)).collect();
        let has_joint_states = cell.topics.measured == JOINT_STATES;
        Self { model, names, fixed, has_joint_states, begun: false, frames_ns: None }
    }

    /// Writes what is due with a row of the measured joints.
    pub(super) fn put(
        &mut self,
        series: &JointSeries,
        row: usize,
        unix_ns: u64,
        bag: &mut Bag,
    ) -> Result<(), mcap::McapError> {
        if !self.begun {
            self.begun = true;
            let text = encode::text(&self.model.description);
            bag.put_latched(ROBOT_DESCRIPTION, encode::TEXT, unix_ns, &text)?;
            if !self.fixed.is_empty() {
                let frames = encode::transforms(unix_ns, &self.fixed);
                bag.put_latched(TF_STATIC, encode::TRANSFORMS, unix_ns, &frames)?;
            }
        }
        let q = series.q_row(row);
        if !self.has_joint_states {
            let (dq, tau) = (series.dq_row(row).unwrap_or(&[]), series.tau_row(row).unwrap_or(&[]));
            let message = encode::joint_state(unix_ns, self.names, [q, dq, tau]);
            bag.put(JOINT_STATES, JointState::TYPE, unix_ns, &message)?;
        }
        if self.frames_ns.is_some_and(|last| unix_ns < last.saturating_add(FRAMES_NS)) {
            return Ok(());
        }
        if let Some(frames) = (self.model.frames_at)(self.names, q) {
            self.frames_ns = Some(unix_ns);
            bag.put(TF, encode::TRANSFORMS, unix_ns, &encode::transforms(unix_ns, &frames))?;
        }
        Ok(())
    }
}
