//! What a program says instead of working: its help, or what is wrong with its arguments.

use crate::{answer, console};
use std::fmt::Display;
use std::process::ExitCode;

/// Says `text` and gives the exit code: arguments that are wrong, on standard error with 2; help or the version that was
/// asked for, on standard output with 0, or 1 where that takes nothing.
pub fn say(arguments_are_wrong: bool, text: impl Display) -> ExitCode {
    if arguments_are_wrong {
        console::block(text);
        return ExitCode::from(2);
    }
    match answer::words(text) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::line(error);
            ExitCode::FAILURE
        }
    }
}
