//! A policy on a robot, through a running bridge: what the bridge shows is what the policy sees, and what it asks for goes to the bridge
//! as a stream of targets, so that the bridge's limits hold.
//!
//! | file | owns |
//! |---|---|
//! | `stream` | the thread that repeats targets while the policy thinks |
//! | `robot` | one episode |

mod robot;
mod stream;

pub use robot::{Acted, ActedError, Robot};
