//! The simulated cell as a device: the twin's physics in a thread of its own, in lock-step with the control thread.
//!
//! ```text
//! control thread --command k--> world thread: one step of 1 ms --state k+1--> control thread, at its next tick
//!                                            \--scene--> camera thread
//!                                             \--pose--> pump
//! ```
//! The control thread never runs physics. A tick that comes before its state counts as a lost packet; a tick that is
//! missed makes simulated time wait, so that a busy machine slows the cell down instead of tearing its motion.

mod arm;
pub(crate) mod hidden;
mod world;

pub use arm::SimArm;
pub use world::{Views, World, WorldError};
