//! `twin`: the command line of the simulated cell. Arguments and wiring only; what is done stands in the library.

mod cli;

use clap::{Parser, Subcommand};
use git_version::git_version;
use shared_mem::command_line::{self, Build};
use shared_mem::{console, error_line};
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// A robot cell in simulation: mirrors a running one, replays recordings, and says how far reality is away.
#[derive(Parser)]
#[command(
    about,
    arg_required_else_help = true,
    after_help = "\
Examples:
  twin shadow --cell config/fr3_cell.toml --viewer
  twin replay session --parameters theta.toml
  twin render session --out frames
  twin task twin/tasks/push_milk.toml
  twin teleop --task twin/tasks/pick_carrot.toml --record carrot
  twin reconstruct object scan --out mug --mass 0.118
  twin reconstruct scene cell_scan --out cell_scene
  twin label-splats scan.ply --cell cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --out fr3_splats
Every verb has its own --help with examples. Logs and progress go to stderr (RUST_LOG=debug for more)."
)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Shadow(cli::shadow::Shadow),
    Replay(cli::replay::Replay),
    Render(cli::render::Render),
    Task(cli::task::Task),
    #[cfg(feature = "teleop")]
    Teleop(cli::teleop::Teleop),
    LabelSplats(cli::label_splats::LabelSplats),
    #[cfg(feature = "reconstruct")]
    Reconstruct(cli::reconstruct::Reconstruct),
}

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
    let _last_lines = console::start();
    let arguments: Arguments = match command_line::parse(&BUILD) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    // The viewer's library writes a line for each message of a viewer that it cannot read: a viewer could fill the log.
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,foxglove=off"));
    tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| console::Log).init();
    let outcome = match arguments.verb {
        Verb::Shadow(verb) => verb.run(),
        Verb::Replay(verb) => verb.run(),
        Verb::Render(verb) => verb.run(),
        Verb::Task(verb) => verb.run(),
        #[cfg(feature = "teleop")]
        Verb::Teleop(verb) => verb.run(),
        Verb::LabelSplats(verb) => verb.run(),
        #[cfg(feature = "reconstruct")]
        Verb::Reconstruct(verb) => verb.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::line(format_args!("twin: {}", error_line(error.as_ref())));
            ExitCode::FAILURE
        }
    }
}
