//! The control thread: what runs once a millisecond and must never wait for anybody. Nothing below this module
//! allocates, locks, logs, panics or touches a file while the loop runs.
//!
//! | file | owns |
//! |---|---|
//! | `claim` | what the machine is asked for |
//! | [`control`] | the thread: real time, the loop, its end |
//! | [`cycle`] | one turn: read, check, command, hand to the pump |
//! | [`deadline`] | the timer's grid |
//! | [`idle`] | how deeply idle processors sleep |
//! | [`law`] | the joint-impedance law |
//! | [`orders`] | motions and stops on their way to the loop |
//! | [`stats`] | how well time was kept |
//! | [`process`] | what is asked of Linux by `unsafe` calls |

mod claim;
pub mod control;
pub mod cycle;
pub mod deadline;
pub mod idle;
pub mod law;
pub mod orders;
pub mod process;
pub mod stats;

/// What to do when the machine does not grant real-time scheduling and locked memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Realtime {
    /// Refuse to run.
    Enforce,
    /// Take what is granted, and say so.
    Ignore,
}
