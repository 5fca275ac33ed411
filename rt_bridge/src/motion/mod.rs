//! Motions: set points out of a queue, one a cycle, and the stop for everything that goes wrong. Runs in the control
//! thread: pure logic on memory set aside in advance.
//!
//! | file | owns |
//! |---|---|
//! | [`player`] | the queue, the verdict of [`crate::safety::Guard`] on each set point, the motion's progress |
//! | [`brake`] | from any admitted motion to rest inside the limits (the only `rsruckig` code) |

pub mod brake;
pub mod player;

pub use brake::Brake;
pub use player::Player;
