//! The program `rt_bridge`: arguments in, exit code out. Everything else is in the library.

use git_version::git_version;
use shared_mem::command_line::Build;
use std::process::ExitCode;

const BUILD: Build = Build {
    version: env!("CARGO_PKG_VERSION"),
    commit: git_version!(args = ["--always", "--abbrev=12", "--exclude=*", "--dirty=-modified"], fallback = ""),
    features: &[
        ("render", cfg!(feature = "render")),
        ("realsense", cfg!(feature = "realsense")),
        ("link", cfg!(feature = "link")),
    ],
};

fn main() -> ExitCode {
    rt_bridge::cli::main(&BUILD)
}
