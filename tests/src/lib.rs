//! What the scenarios in `tests/` share: the programs as processes in a private domain of shared memory, and a folder for their files.
//!
//! The programs are those that `cargo test --workspace` builds beside the tests. Timing figures are never asserted here:
//! the machine that runs tests is slow and shared.

mod bench;
pub mod constants;
mod judge;
pub mod measures;
pub mod modules;
mod program;
pub mod sources;
pub mod teleop;
pub mod texts;

pub use bench::{Cell, lab_cell};
pub use judge::Judge;
pub use program::{Finished, Program, program_path};
