//! Any serial-chain arm: kinematics, equations of motion, the joint controllers of cell.toml, and their step in time.
//!
//! Nothing here allocates after construction, so the control thread of the bridge may call all of it. Joint arrays are
//! [`Joints`]: as long as a message's, of which the first [`ArmModel::dof`] count. Units SI, frames as in
//! [`shared_mem::frames`]: everything is in the base frame unless a name says otherwise.
//!
//! | file | owns |
//! |---|---|
//! | `model` | [`ArmModel`]: what an arm is, and how cell.toml, tool and payload make one |
//! | `chain`, `error` | what a source tells of one, and why none can be made of it |
//! | `fr3` | numbers of the built-in Franka FR3 |
//! | `urdf` | the way in from a URDF file, every frame of one, and its links as bodies (the only code that asks `urdf-rs`) |
//! | `limits` | [`Limits`]: how far, fast and hard each joint may go |
//! | `inertia` | mass properties of bodies |
//! | `kinematics` | flange, Jacobian |
//! | `inverse_kinematics` | joints that bring the flange to a pose, or within their limits as near to it as they can |
//! | `follower` | [`Follower`]: the way to a target that may change at any time (the only `rsruckig` code of the product but the capture's plans) |
//! | `balls` | [`ArmBalls`]: the space that links and tool take |
//! | `dynamics` | gravity, Coriolis, mass matrix, accelerations |
//! | `control` | [`ControlLaw`]: from command to torque |
//! | `gains` | where its gains may lie |
//! | `step` | integration over time |
//! | `trailing` | [`Trailing`]: how an arm comes after its commands under a law that feeds no acceleration forward |
//! | `yielding` | how the flange moves and gives way to a push |
//! | `transmission` | the same with friction, yielding and play between motor and link |
//! | `kernel`, `spatial` | the arithmetic below |

mod balls;
mod chain;
mod control;
mod dry_friction;
mod dynamics;
mod error;
mod follower;
mod fr3;
mod gains;
mod inertia;
mod inverse_kinematics;
mod kernel;
mod kinematics;
mod limits;
mod model;
mod parts;
mod spatial;
mod step;
mod trailing;
mod transmission;
mod urdf;
mod yielding;

pub use balls::{ArmBalls, Extent, MOST_BALLS};
pub use chain::HeldJoint;
pub use control::{ControlLaw, GainError};
pub use dry_friction::Presliding;
pub use dynamics::PointForce;
pub use error::ModelError;
pub use follower::Follower;
pub use gains::{damping_range, stiffness_range};
pub use inertia::MassProperties;
pub use inverse_kinematics::{Nearest, pose_difference};
pub use kinematics::Jacobian;
pub use limits::{JointLimits, Limits, TORQUE_RATE};
pub use model::ArmModel;
pub(crate) use model::FREE_FALL;
pub use parts::Part;
pub use shared_mem::msg::{Joints, MAX_JOINTS};
pub use trailing::{Trail, Trailing};
pub use transmission::{Passed, Slip, Spring, Transmission};
pub use urdf::{
    LinkFrame, UrdfBody, UrdfForm, UrdfFrames, UrdfJoint, UrdfShape, with_elements, with_files_found_from,
    with_joint_friction, with_joint_numbers,
};
pub use yielding::{FlangeMotion, Yielding};

/// Positions and velocities of all joints.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointState {
    /// Positions [rad] (or [m] where a joint slides).
    pub q: Joints,
    /// Velocities [rad/s] (or [m/s]).
    pub dq: Joints,
}

impl JointState {
    /// At rest at `q`.
    pub fn at_rest(q: Joints) -> Self {
        Self { q, dq: [0.0; MAX_JOINTS] }
    }
}
