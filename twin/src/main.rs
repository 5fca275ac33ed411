//! The program `twin`: everything is in the library.

use git_version::git_version;
use shared_mem::command_line::Build;
use std::process::ExitCode;

const BUILD: Build = Build {
    version: env!("CARGO_PKG_VERSION"),
    commit: git_version!(args = ["--always", "--abbrev=12", "--exclude=*", "--dirty=-modified"], fallback = ""),
    features: &[
        ("viewer", cfg!(feature = "viewer")),
        ("render", cfg!(feature = "render")),
        ("teleop", cfg!(feature = "teleop")),
        ("reconstruct", cfg!(feature = "reconstruct")),
    ],
};

fn main() -> ExitCode {
    twin::cli::main(&BUILD)
}
