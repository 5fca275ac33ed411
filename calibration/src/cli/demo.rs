//! `calibration demo`.

use super::print;
use crate::demo;
use inference::interrupt::Interrupt;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Starts a simulated robot with hidden gains and a hidden effect, and its twin, as two processes; records a session while the
twin shadows the robot; diagnoses it; replays it with cell.toml and with what was found; and writes FOLDER/report.html and
FOLDER/diagnosis.html. Takes a minute or two.

Examples:
  calibration demo --out demo
  calibration demo --out demo7 --seed 7 --clips 8 --json")]
pub struct DemoArguments {
    /// Folder to create.
    #[arg(long, value_name = "FOLDER", default_value = "demo")]
    out: PathBuf,
    /// Replaces what an earlier demo wrote there.
    #[arg(long)]
    force: bool,
    /// Draws the hidden gains, the hidden effect and the motions.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = inference::seed::parse)]
    seed: u64,
    /// Clips to record; a diagnosis needs at least four.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(4..=100))]
    clips: u32,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: DemoArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let DemoArguments { out, force, seed, clips, json } = arguments;
    let finding = demo::demo(&demo::Options { out, force, seed, clips }, interrupt)?;
    print(json, &finding, finding.table())
}
