//! The program `twinalign`: the verbs of `rt_bridge`, `twin` and `calibration` under one name.

use clap::{Parser, Subcommand};
use git_version::git_version;
use shared_mem::command_line::{self, Build};
use std::process::ExitCode;

/// Where a robot and its simulation disagree, which effect causes it, and how far the gap shrinks.
///
/// It mirrors a Franka FR3 cell in simulation while it runs, records what both did, and explains the difference; recordings of other arms
/// are read as well.
#[derive(Parser)]
#[command(
    arg_required_else_help = true,
    after_help = "\
Examples:
  twinalign demo --out demo                           the whole story on a simulated cell
  twinalign import last_week --out session            recordings that are there already
  twinalign check session
  twinalign diagnose session --report report.html     where, which effect, how far the gap shrinks
  twinalign doctor --arm fci://172.16.0.2             before a robot moves
Every verb has its own --help with an example. The programs rt_bridge, twin and calibration hold the same verbs by their parts."
)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    #[command(flatten)]
    Calibration(calibration::cli::Verb),
    #[command(flatten)]
    Twin(twin::cli::Verb),
    #[command(flatten)]
    Bridge(rt_bridge::cli::Verb),
}

const BUILD: Build = Build {
    version: env!("CARGO_PKG_VERSION"),
    commit: git_version!(args = ["--always", "--abbrev=12", "--exclude=*", "--dirty=-modified"], fallback = ""),
    features: &[
        ("viewer", cfg!(feature = "viewer")),
        ("teleop", cfg!(feature = "teleop")),
        ("reconstruct", cfg!(feature = "reconstruct")),
        ("render", cfg!(feature = "render")),
        ("realsense", cfg!(feature = "realsense")),
        ("link", cfg!(feature = "link")),
    ],
};

fn main() -> ExitCode {
    command_line::program(&BUILD, |Arguments { verb }: Arguments| match verb {
        Verb::Calibration(verb) => calibration::cli::run(verb),
        Verb::Twin(verb) => twin::cli::run(verb),
        Verb::Bridge(verb) => rt_bridge::cli::run(verb),
    })
}
