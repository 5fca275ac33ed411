//! Motions: set points out of a queue, one a cycle, the stop for everything that goes wrong, and streams of
//! targets. Pure logic on memory set aside in advance; player and brake run in the control thread.
//!
//! | file | owns |
//! |---|---|
//! | [`player`] | the queue, the verdict of [`crate::safety::Guard`] on each set point, the motion's progress |
//! | `lost` | the command in force where set points came too late |
//! | `ease` | from there back to the plan |
//! | [`brake`] | from any admitted motion to rest inside the limits |
//! | `player/stream` | a stream of targets, followed as [`twin::arm::Follower`] plans |

pub mod brake;
mod ease;
mod lost;
pub mod player;

pub use brake::Brake;
pub use player::{Player, Target};
