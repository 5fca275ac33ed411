//! Why no arm can be made of what was given, and how to mend it.

use super::MAX_JOINTS;
use shared_mem::input::InputError;
use std::path::PathBuf;

/// No arm can be made of what was given.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// cell.toml describes no arm.
    #[error("cell.toml has no [robot] block; add one, for example `model = \"fr3\"`")]
    NoRobot,
    /// The URDF is missing, no file, or too large.
    #[error("{0} (`robot.urdf` in cell.toml)")]
    Input(#[from] InputError),
    /// The URDF makes no sense.
    #[error("{}: {what}; give a URDF that a robot_state_publisher accepts (xacro must be expanded first)", path.display())]
    Read {
        path: PathBuf,
        /// What the reader said.
        what: String,
    },
    /// The URDF describes something else than one serial chain.
    #[error("{}: {what}", path.display())]
    Chain {
        path: PathBuf,
        /// Joint or link, and how to mend it.
        what: String,
    },
    /// More joints than a message carries.
    #[error(
        "the arm has {0} movable joints; 1 to {MAX_JOINTS} are supported: say with `joints` which are the arm's, from base to flange"
    )]
    Joints(usize),
    /// A vector of cell.toml does not fit the arm.
    #[error("`{key}` in cell.toml holds {given} values; this arm has {dof} joints: give one for each")]
    Length {
        key: &'static str,
        given: usize,
        /// Joints of the arm.
        dof: usize,
    },
    /// A joint moves nothing.
    #[error(
        "joint `{0}` moves no inertia; give its link an <inertial> in the URDF, or `rotor_inertia` in [controller] of cell.toml"
    )]
    Massless(String),
}
