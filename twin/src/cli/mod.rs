//! The verbs of the program `twin`, one file each: arguments and what is printed, nothing that simulates.

#[cfg(feature = "reconstruct")]
mod articulated;
#[cfg(feature = "reconstruct")]
mod asset_folder;
pub(crate) mod label_splats;
pub(crate) mod look;
#[cfg(feature = "reconstruct")]
pub(crate) mod reconstruct;
pub(crate) mod render;
pub(crate) mod replay;
pub(crate) mod shadow;
#[cfg(feature = "teleop")]
pub(crate) mod show;
pub(crate) mod task;
#[cfg(feature = "teleop")]
pub(crate) mod teleop;

use anyhow::Context as _;
use clap::{Parser, Subcommand};
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
  twin shadow --cell fr3 --viewer
  twin replay session --parameters theta.toml
  twin show session
  twin render session --out frames
  twin task push_milk
  twin teleop --task pick_carrot --record carrot
  twin reconstruct object scan --out mug --mass 0.118
  twin reconstruct scene cell_scan --out cell_scene
  twin label-splats scan.ply --cell cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --out fr3_splats
Every verb has its own --help with examples. Logs and progress go to stderr (RUST_LOG=debug for more)."
)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

// No documentation here: the program's own help would be replaced by it.
#[derive(Subcommand)]
pub enum Verb {
    Shadow(shadow::Shadow),
    Replay(replay::Replay),
    #[cfg(feature = "teleop")]
    Show(show::Show),
    Render(render::Render),
    Task(task::Task),
    #[cfg(feature = "teleop")]
    Teleop(teleop::Teleop),
    LabelSplats(label_splats::LabelSplats),
    #[cfg(feature = "reconstruct")]
    Reconstruct(reconstruct::Reconstruct),
}

/// Reads the command line and does what it says.
pub fn main(build: &Build) -> ExitCode {
    command_line::program(build, |arguments: Arguments| run(arguments.verb))
}

/// Does what a verb says.
pub fn run(verb: Verb) -> ExitCode {
    // The viewer's library writes a line for each message of a viewer that it cannot read: a viewer could fill the log.
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,foxglove=off"));
    tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| console::Log).init();
    let outcome = match verb {
        Verb::Shadow(verb) => verb.run(),
        Verb::Replay(verb) => verb.run(),
        #[cfg(feature = "teleop")]
        Verb::Show(verb) => verb.run(),
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
            console::line(format_args!("error: {}", error_line(error.as_ref())));
            ExitCode::FAILURE
        }
    }
}

/// The name of a host by which a page is opened.
#[cfg(feature = "teleop")]
fn host_name(text: &str) -> Result<String, String> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
    if !text.is_empty() && text.chars().all(is_name) {
        Ok(text.to_owned())
    } else {
        Err("give a host's name without http:// and port, as bench.lab.example".to_owned())
    }
}

/// For verbs that do not stop by themselves at Ctrl-C: ends the program, without leaving unfinished files. Those that are
/// finished stay.
fn discard_on_signal() -> anyhow::Result<()> {
    let end = || {
        shared_mem::output::discard_unfinished();
        console::line("interrupted; files that were finished stay");
        console::flush();
        std::process::exit(1);
    };
    ctrlc::set_handler(end).context("cannot listen for Ctrl-C")
}
