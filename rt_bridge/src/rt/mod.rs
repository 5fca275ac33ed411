//! The control thread: what runs once a millisecond and must never wait for anybody. Nothing below this module
//! allocates, locks, logs, panics or touches a file while the loop runs.

pub mod deadline;
pub mod player;
pub mod process;
pub mod remark;
pub mod stats;

/// What to do when the machine does not grant real-time scheduling and locked memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Realtime {
    /// Refuse to run.
    Enforce,
    /// Take what is granted, and say so.
    Ignore,
}
