//! Work in units that know nothing of each other: command lines of this program, on as many cores and machines as there are, merged
//! without gaps.
//!
//! A sweep is a folder: `units.jsonl` says what is to be done, `results/HASH.json` holds the result of each unit, written whole.
//! A unit's hash is that of its command and of every file and folder that it names, so that a result is that of its question.
//! Whatever engine starts the slices (Slurm, a shell, another machine with the same folder), one that was killed is started again
//! and goes on.
//!
//! | file | owns |
//! |---|---|
//! | `unit` | a unit: command, values, hash; slices of units |
//! | `inputs` | what commands name, as a hash |
//! | `plan` | units out of commands with placeholders |
//! | `work` | running units, a result each |
//! | `result` | the file of a result, with a checksum |
//! | `merge` | all results as one |
//! | `slurm` | a script for Slurm |

mod inputs;
mod merge;
mod plan;
mod result;
mod slurm;
mod unit;
mod work;

pub use merge::{Merged, merge};
pub use plan::{Each, commands, plan, write};
pub use slurm::{Partition, TimeLimit, Wanted, script};
pub use unit::{Slice, Unit, read};
pub use work::{Ran, Runner, process, run};

use shared_mem::input::InputError;
use shared_mem::output::OutputError;
use std::path::PathBuf;

/// A sweep cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A file cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Trials of an evaluation cannot be read.
    #[error(transparent)]
    Trials(#[from] evaluation::trial::TrialsError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A file holds something else.
    #[error("{}: {what}", file.display())]
    Content {
        /// The file or folder.
        file: PathBuf,
        /// What is wrong, and what to do.
        what: String,
    },
    /// What is asked for is none.
    #[error("{0}")]
    Asked(String),
    /// The end was asked for.
    #[error("interrupted; nothing was written, and the same command starts again")]
    Interrupted,
    #[error("{failed} of {units} units failed, the first, {number}: {why}; mend it and start the same command again")]
    Failed {
        failed: usize,
        /// Of so many.
        units: usize,
        /// Number of the first.
        number: usize,
        /// What it said.
        why: String,
    },
}
