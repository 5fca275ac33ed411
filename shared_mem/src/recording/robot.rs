//! A robot as viewers want it: its description, and where its links are as it moves.

use crate::cell::Cell;

/// Topics that every ROS program and every viewer of recordings knows.
pub const JOINT_STATES: &str = "/joint_states";
/// Frames that move.
pub const TF: &str = "/tf";
/// Frames that stay where they are.
pub const TF_STATIC: &str = "/tf_static";
/// The URDF.
pub const ROBOT_DESCRIPTION: &str = "/robot_description";

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

impl Transform {
    /// Where cell.toml has the camera, as a frame of this name.
    pub(super) fn of_camera(cell: &Cell, child: &str) -> Option<Self> {
        let pose = cell.camera.as_ref()?.base_from_camera()?;
        let (parent, child) = (cell.base_frame().to_owned(), child.to_owned());
        Some(Self { parent, child, position: pose.position(), wxyz: pose.wxyz() })
    }

    /// A frame that lies on another.
    pub(super) fn same(parent: &str, child: &str) -> Self {
        let (parent, child) = (parent.to_owned(), child.to_owned());
        Self { parent, child, position: [0.0; 3], wxyz: [1.0, 0.0, 0.0, 0.0] }
    }
}

/// The frames that move at these positions [rad] of these joints; `None` where they are not the robot's.
pub type FramesAt = Box<dyn Fn(&[String], &[f64]) -> Option<Vec<Transform>> + Send + Sync>;

/// A robot of which the kinematics are known.
pub struct RobotModel {
    /// Its URDF.
    pub description: String,
    /// Name of the link that hangs on nothing.
    pub root: String,
    /// Names of its joints from base to flange: those of recordings that only number them.
    pub joints: Vec<String>,
    /// Its frames that stay where they are.
    pub fixed: Vec<Transform>,
    /// Its frames that move.
    pub frames_at: FramesAt,
}

impl RobotModel {
    /// Its names for joints that are only numbered; the recorded ones otherwise.
    pub(super) fn names<'a>(&'a self, recorded: &'a [String]) -> &'a [String] {
        let numbered = recorded.iter().enumerate().all(|(i, name)| *name == format!("joint{}", i + 1));
        if numbered && recorded.len() == self.joints.len() { &self.joints } else { recorded }
    }
}

impl std::fmt::Debug for RobotModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RobotModel").field("root", &self.root).field("joints", &self.joints).finish_non_exhaustive()
    }
}
