//! What the bridge never sends, on the real and the simulated arm alike. Pure functions of numbers: no clock, no device.
//!
//! | file | owns |
//! |---|---|
//! | [`trace`] | velocity, acceleration and jerk of what was commanded, as the robot differences it |
//! | [`measured`] | the arm that is there, and where it gets when its commands are braked |
//! | [`guard`] | the verdict on the next set point: it and the braking that may follow it stay inside the limits |
//! | [`stopping`] | the way of every joint to rest |
//! | [`torque`] | torque and torque rate, clamped |
//! | [`workspace`] | where arm and tool may be |
//! | [`watchdog`] | how long silence is borne |

pub mod guard;
pub mod measured;
pub mod stopping;
pub mod torque;
pub mod trace;
pub mod watchdog;
pub mod workspace;

pub use guard::{Guard, Violation};
pub use measured::Measured;
pub use stopping::Stopping;
pub use torque::TorqueGuard;
pub use trace::Trace;
pub use twin::arm::{JointLimits, Limits, TORQUE_RATE, Trailing};
pub use watchdog::Watchdog;
pub use workspace::{Outside, Workspace};
