//! `twin`: the command line of the simulated cell. Arguments and wiring only; what is done stands in the library.

mod cli;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// A robot cell in simulation: mirrors a running one.
#[derive(Parser)]
#[command(version, about, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Shadow(cli::shadow::Shadow),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().verb {
        Verb::Shadow(verb) => verb.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("twin: {error:#}");
            ExitCode::FAILURE
        }
    }
}
