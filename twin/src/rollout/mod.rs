//! A cell simulated under a recorded command series: the inner loop of replay, identification and diagnosis.
//!
//! [`CellRollout`] is a worker for one cell: arm, tool, object, table and effects. It is made once, takes other
//! parameters cheaply, and from then on starts, runs, is stopped and resumed without allocating. [`Workers`] runs many
//! jobs on all cores. [`crate::control::ArmRollout`] is the arm alone, for callers that hold its model themselves.
//!
//! Time runs on a grid of 1 ms control ticks from the start stamp. At a tick the controller sees the state of that
//! moment and the newest command, and its torque holds until the next tick. Predictions between ticks are interpolated,
//! so the recording's stamps may be anything. Stamps are integer nanoseconds, everything else SI in the base frame.
//! The same input gives the same bits on any number of threads.
//!
//! | file | owns |
//! |---|---|
//! | `cell` | [`CellRollout`] |
//! | `trace` | what a rollout is asked for and what it answers |
//! | `workers` | [`Workers`]: many jobs on all cores |

mod cell;
mod trace;
mod workers;

pub use cell::{CellRollout, Checkpoint};
pub use trace::{CellTrace, ContactSpan, Course, ObjectState};
pub use workers::Workers;
