//! The program `calibration`: reads the command line, runs a verb, prints one JSON object if asked, one line if it fails.

mod cli;

use git_version::git_version;
use shared_mem::command_line::{self, Build};
use shared_mem::{console, error_line};
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

const BUILD: Build = Build {
    version: env!("CARGO_PKG_VERSION"),
    commit: git_version!(args = ["--always", "--abbrev=12", "--exclude=*", "--dirty=-modified"], fallback = ""),
    features: &[],
};

fn main() -> ExitCode {
    let _last_lines = console::start();
    let arguments: cli::Arguments = match command_line::parse(&BUILD) {
        Ok(arguments) => arguments,
        Err(code) => return code,
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
