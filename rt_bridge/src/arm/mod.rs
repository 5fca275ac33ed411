//! The one door between the control thread and an arm: real, simulated or recorded. Owns what an arm promises and how
//! it fails; the loop that calls it is `rt::cycle`.
//!
//! Units are those of [`ArmState`] and [`ArmCommand`]. Of the calls here only `start`, `stop` and `recover` may block or
//! allocate; `read` and `command` run once a cycle in the control thread.

mod fault;
mod reflex;

pub use fault::{ArmFault, ConnectError};
pub use reflex::ReflexErrors;

use shared_mem::msg::arm::{ArmCommand, ArmState, CommandInterface};

/// Who says when a cycle begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// The control thread's own grid of deadlines, this far apart [ns]. `read` must not block.
    Timer {
        /// Distance of two deadlines [ns].
        period_ns: u64,
    },
    /// The arm: `read` sleeps until its next packet.
    Device,
}

/// What a `read` brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Read {
    /// A new state; it wants one command.
    Fresh,
    /// Nothing in time: counted as a lost packet, no command is sent.
    Missing,
    /// The arm has come to its end (a recording that was played through). No fault.
    End,
}

/// Whose `q_d` and `dq_d` a published state carries. Either way they are those that the law acts with on that state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Desired {
    /// The control thread overwrites what `read` filled in with its own command of the cycle.
    Commanded,
    /// The arm is a recording and follows nobody: what `read` filled in is published as state and as command.
    Recorded,
}

/// An arm that is commanded once a cycle.
///
/// `read` fills `stamp_ns` (arrival), `device_ns`, `mode`, `q`, `dq`, `q_d`, `dq_d`, `tau_J`, `tau_J_d`, `tau_ext`, `O_T_EE`
/// and `success_rate`; `cycle`, `session`, `dof` and the motion's progress are filled by the caller.
pub trait Arm: Send {
    /// Number of joints, at most `MAX_JOINTS`.
    fn dof(&self) -> usize;

    /// Who says when a cycle begins.
    fn clock(&self) -> Clock;

    /// Whether the arm goes on with its last acceleration in a period for which no position command came; `false` for one
    /// that waits where it was commanded to be.
    fn extrapolates(&self) -> bool {
        false
    }

    /// Makes the arm follow commands of `interface`. Called by the control thread before its first cycle and after
    /// [`Arm::recover`]; may block and allocate.
    ///
    /// # Errors
    /// [`ArmFault`] when the arm refuses; its state can still be read.
    fn start(&mut self, interface: CommandInterface) -> Result<Desired, ArmFault>;

    /// The next state. With [`Clock::Device`] sleeps until it arrives, but never longer than a second; with
    /// [`Clock::Timer`] returns at once or after a short spin.
    ///
    /// # Errors
    /// [`ArmFault::Reflex`] and [`ArmFault::UserStopped`] once, at the transition: `state` is filled, the arm is no longer
    /// commanded, later reads go on. [`ArmFault::Disconnected`] and [`ArmFault::Silent`]: there is nothing more to read.
    fn read(&mut self, state: &mut ArmState) -> Result<Read, ArmFault>;

    /// Hands over the one command that answers the last fresh state. Must neither block nor allocate.
    ///
    /// # Errors
    /// [`ArmFault`] when it could not be handed over.
    fn command(&mut self, command: &ArmCommand) -> Result<(), ArmFault>;

    /// Ends commanding in the arm's own orderly way; the arm is at rest already. May block, at most a second.
    fn stop(&mut self);

    /// Clears a reflex so that `start` can succeed. Called before `start` when the arm is in a reflex; may block, at most 12
    /// seconds, and allocate.
    ///
    /// # Errors
    /// [`ArmFault`] when a person has to act first.
    fn recover(&mut self) -> Result<(), ArmFault>;
}
