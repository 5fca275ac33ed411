//! `[robot]`, `[tool]`, `[table]`, `[topics]`.

use super::within;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The arm: a built-in model, a URDF, or only joint names where no model is known.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [robot] block")]
pub struct Robot {
    /// Built-in model: `"fr3"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// URDF file, relative to cell.toml.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf: Option<PathBuf>,
    /// Names of the joints in recordings. Beside `urdf`, from base to flange: names of its own say which of its joints are the arm's, where
    /// fingers, wheels or a second arm hang there, too; other names are what recordings call the arm's. Alone, in the order of
    /// the recordings, where no model is known: one second-order model a joint then.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
    /// Name of the base frame, in recordings, bags and viewers alike; absent: the first link of the model, else `base`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_frame: Option<String>,
}

/// The tool: a solid capsule along the flange's z axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [tool] block")]
pub struct Tool {
    /// Mass, spread evenly over the capsule [kg].
    pub mass: f64,
    /// Flange to the end of the tip [m]. The capsule's axis runs from the flange's origin to `length - radius`, with caps of
    /// `radius` at both ends.
    pub length: f64,
    /// Radius [m].
    pub radius: f64,
}

/// The table: a horizontal plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [table] block")]
pub struct Table {
    /// Height of its surface in the base frame [m].
    pub height: f64,
}

impl Table {
    pub(super) fn check(&self) -> Result<(), String> {
        within("table.height", &[self.height], -10.0, 10.0)
    }
}

/// Where a ROS 2 bag keeps what is needed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a [topics] block")]
pub struct Topics {
    /// `sensor_msgs/JointState`: q, dq and, where logged, `tau_J`.
    pub measured: String,
    /// `sensor_msgs/JointState`: q_d, dq_d and, where logged, `tau_J_d`.
    pub desired: String,
    /// `geometry_msgs/PoseStamped`: geometric centre in the base frame.
    pub object_pose: String,
}

impl Default for Topics {
    fn default() -> Self {
        Self {
            measured: "/franka_robot_state_broadcaster/measured_joint_states".into(),
            desired: "/franka_robot_state_broadcaster/desired_joint_states".into(),
            object_pose: "/object/pose".into(),
        }
    }
}

impl Topics {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl Robot {
    /// Whether nothing is known of the arm but the names of its joints.
    pub fn joints_only(&self) -> bool {
        self.urdf.is_none() && !self.joints.is_empty()
    }

    pub(super) fn check(&self) -> Result<(), String> {
        let ways =
            usize::from(self.model.is_some()) + usize::from(self.urdf.is_some()) + usize::from(self.joints_only());
        if ways != 1 || self.model.is_some() && !self.joints.is_empty() {
            return Err("`[robot]` needs exactly one of `model = \"fr3\"`, `urdf = \"file.urdf\"` (with `joints = [names]` where \
                        recordings name its joints otherwise) or `joints = [names]` alone"
                .into());
        }
        match self.model.as_deref() {
            None | Some("fr3") => Ok(()),
            Some(other) => {
                Err(format!("`robot.model = \"{other}\"` is not built in; use \"fr3\" or give `urdf = \"file.urdf\"`"))
            }
        }
    }
}

impl Tool {
    pub(super) fn check(&self) -> Result<(), String> {
        within("tool.mass", &[self.mass], 0.0, 50.0)?;
        within("tool.length", &[self.length], 1e-3, 2.0)?;
        within("tool.radius", &[self.radius], 1e-4, 0.5)?;
        if self.length <= self.radius {
            return Err("`tool.length` must exceed `tool.radius`: it is measured to the end of the tip".into());
        }
        Ok(())
    }
}
