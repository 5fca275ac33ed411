//! An arm under its controller, one control period after another: the only implementation of it. The simulated cell, replay,
//! identification and diagnosis all move their arms with it.
//!
//! | file | owns |
//! |---|---|
//! | `commands` | [`CommandTrack`]: what the robot was commanded |
//! | `plant` | [`Plant`]: arm, controller and hidden effects of a cell |
//! | `motion` | one control period of an arm |
//! | `arm` | [`ArmRollout`] over a whole clip |
//! | `start` | the state an arm was in when its recording begins |

mod arm;
mod commands;
mod motion;
mod plant;
mod start;

pub use arm::{ArmRollout, between};
pub use commands::{CommandTrack, Hole};
pub(crate) use motion::ArmMotion;
pub use motion::{Drive, Reading};
pub use plant::Plant;
