//! The program `calibration`: reads the command line, runs a verb, prints one JSON object if asked, one line if it fails.

mod cli;

use clap::Parser as _;
use shared_mem::error_line;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let arguments = cli::Arguments::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    match cli::run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("calibration: {}", error_line(error.as_ref()));
            ExitCode::FAILURE
        }
    }
}
