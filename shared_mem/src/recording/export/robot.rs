//! The robot as ROS programs expect it beside any recording of one: its description, its joints, and its frames. What moves is
//! calculated by whoever knows the robot's kinematics; here it becomes messages.

use super::super::ros2::JointState;
use super::encode;
use super::rosbag::Bag;
use crate::recording::JointSeries;

/// Topics that every ROS program knows.
pub(super) const JOINT_STATES: &str = "/joint_states";
pub(super) const TF: &str = "/tf";
pub(super) const TF_STATIC: &str = "/tf_static";
pub(super) const ROBOT_DESCRIPTION: &str = "/robot_description";
/// Least time between two messages on `/tf` [ns]: viewers draw no faster, and a link's frame takes a hundred bytes.
const FRAMES_NS: u64 = 10_000_000;

/// A frame in another.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    /// The frame that it is given in.
    pub parent: String,
    /// Its name.
    pub child: String,
    /// [m]
    pub position: [f64; 3],
    /// `w, x, y, z`
    pub wxyz: [f64; 4],
}

/// The frames that move at these positions [rad] of these joints; `None` where they are not the robot's.
pub type FramesAt<'a> = &'a dyn Fn(&[String], &[f64]) -> Option<Vec<Transform>>;

/// A robot of which the kinematics are known.
#[derive(Clone, Copy)]
pub struct RobotModel<'a> {
    /// Its URDF.
    pub description: &'a str,
    /// Names of its joints from base to flange: those of recordings that only number them.
    pub joints: &'a [String],
    /// Frames that stay where they are.
    pub fixed: &'a [Transform],
    /// Frames that move.
    pub frames_at: FramesAt<'a>,
}

impl<'a> RobotModel<'a> {
    /// Its names for joints that are only numbered; the recorded ones otherwise.
    pub(super) fn names(&self, recorded: &'a [String]) -> &'a [String] {
        let numbered = recorded.iter().enumerate().all(|(i, name)| *name == format!("joint{}", i + 1));
        if numbered && recorded.len() == self.joints.len() { self.joints } else { recorded }
    }
}

/// What is written of a robot, row by row of what it did.
pub(super) struct RobotTopics<'a> {
    model: RobotModel<'a>,
    names: &'a [String],
    /// Whether the measured joints stand on `/joint_states` already.
    has_joint_states: bool,
    begun: bool,
    /// When frames were written last [ns].
    frames_ns: Option<u64>,
}

impl<'a> RobotTopics<'a> {
    /// Of joints of these names, whose measured rows go on `measured`.
    pub(super) fn new(model: RobotModel<'a>, names: &'a [String], measured: &str) -> Self {
        Self { model, names, has_joint_states: measured == JOINT_STATES, begun: false, frames_ns: None }
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
            let text = encode::text(self.model.description);
            bag.put_latched(ROBOT_DESCRIPTION, encode::TEXT, unix_ns, &text)?;
            if !self.model.fixed.is_empty() {
                let frames = encode::transforms(unix_ns, self.model.fixed);
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
