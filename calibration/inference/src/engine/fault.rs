//! What may be wrong with an engine, each in one line with a remedy.

use std::process::ExitStatus;

/// An engine cannot be used, or not any more.
#[derive(Debug, Clone, thiserror::Error)]
pub enum EngineError {
    /// The system would not start it.
    #[error("cannot start the engine `{command}`: {why}; start it by hand and see what is missing")]
    Start { command: String, why: String },
    /// It ended while an answer was waited for.
    #[error("the engine `{command}` ended with {status}{words}; start it by hand and see what it says")]
    Ended {
        command: String,
        status: ExitStatus,
        /// The last line it wrote to standard error, after a colon; empty where there is none.
        words: String,
    },
    /// It does not answer.
    #[error(
        "the engine `{command}` has not answered for {seconds} s{words}; allow more with --engine-limit, or see where it hangs"
    )]
    Silent { command: String, seconds: u64, words: String },
    /// Something else than messages stands on its standard output.
    #[error(
        "the engine `{command}` wrote {bytes:?} where a message begins: let it print to standard error alone, as docs/engine.md says"
    )]
    NoMessage { command: String, bytes: String },
    /// A message that is not the one that was asked for.
    #[error("the engine `{command}` {what}; docs/engine.md says what every message holds")]
    Wrong { command: String, what: String },
    /// It cannot simulate what is in the clips.
    #[error(
        "the engine `{command}` simulates an arm alone: its greeting has no `object`, and these clips have one; add it as version 2 of \
         docs/engine.md says, or record the arm alone (`calibration capture excitation`)"
    )]
    NoObject { command: String },
    /// No engine is asked for objects without an arm.
    #[error(
        "--engine simulates an arm and what it hits, and in {count} of these clips an object moves by itself (`kind = \"free_motion\"`); take \
         them out of cell.toml, or leave --engine out"
    )]
    NoArm { count: usize },
    /// It says itself that it cannot go on.
    #[error("the engine `{command}`: {why}")]
    Refused { command: String, why: String },
    /// The user asked for the end.
    #[error("interrupted; start again")]
    Ending,
}
