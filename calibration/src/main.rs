//! The program `calibration`: reads the command line, runs a verb, prints one JSON object if asked, one line if it fails.

mod cli;

use clap::Parser as _;
use shared_mem::{console, error_line, usage};
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let _last_lines = console::start();
    let arguments = match cli::Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return usage::say(error.use_stderr(), error.render()),
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| console::Log).init();
    match cli::run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::line(format_args!("calibration: {}", error_line(error.as_ref())));
            ExitCode::FAILURE
        }
    }
}
