//! The program `calibration`: everything is in the library.

use git_version::git_version;
use shared_mem::command_line::Build;
use std::process::ExitCode;

const BUILD: Build = Build {
    version: env!("CARGO_PKG_VERSION"),
    commit: git_version!(args = ["--always", "--abbrev=12", "--exclude=*", "--dirty=-modified"], fallback = ""),
    features: &[],
};

fn main() -> ExitCode {
    calibration::cli::main(&BUILD)
}
