//! `calibration capture`.

use super::{between, print_json};
use calibration::capture::excitation;
use calibration::interrupt::Interrupt;
use clap::Subcommand;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum Capture {
    /// All joints at once along sums of sines, inside every limit: what identifying the arm needs.
    Excitation(ExcitationArguments),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The arm starts and ends at rest in the pose it holds, and stays above table and object. An amplitude that breaks a limit
of position, speed, acceleration, jerk, torque or height is made smaller; which limit it was is said for each joint.

A session that exists is continued with the next number; nothing is overwritten. Ctrl-C brakes the arm, waits for rest
and keeps what was recorded.

Examples:
  calibration capture excitation --cell config/fr3_cell.toml --clips 4 --out session
  calibration capture excitation --cell lab/cell.toml --clips 8 --out monday --arm fci://172.16.0.2 --amplitude 0.2")]
pub(super) struct ExcitationArguments {
    /// What the laboratory knows about its cell.
    #[arg(long, value_name = "CELL.TOML")]
    cell: PathBuf,
    /// Clips to add.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    clips: u32,
    /// Session folder; created, or continued.
    #[arg(long, value_name = "SESSION")]
    out: PathBuf,
    /// Arm for the bridge that is started when none runs: sim or fci://HOST [default: sim].
    #[arg(long)]
    arm: Option<String>,
    /// Whether that bridge refuses to run without real-time guarantees: enforce or ignore [default: the bridge's own].
    #[arg(long, value_parser = ["enforce", "ignore"])]
    realtime: Option<String>,
    /// Length of each clip's motion [s], 2 to 600.
    #[arg(long, value_name = "S", default_value_t = 8.0, value_parser = between::<2, 600, 1>)]
    duration: f64,
    /// Largest excursion of each joint from the pose the arm stands in [rad], 0.01 to 1.5.
    #[arg(long, value_name = "RAD", default_value_t = 0.25, value_parser = between::<1, 150, 100>)]
    amplitude: f64,
    /// Seed of the motions; clip number N of a session is drawn from seed + N.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(capture: Capture, interrupt: &Interrupt) -> anyhow::Result<()> {
    match capture {
        Capture::Excitation(arguments) => excite(arguments, interrupt),
    }
}

fn excite(arguments: ExcitationArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let ExcitationArguments { cell, clips, out, arm, realtime, duration, amplitude, seed, json } = arguments;
    let options = excitation::Options { cell, clips, out, arm, realtime, duration, amplitude, seed, domain: None };
    let summary = excitation::capture(&options, interrupt, &mut String::new)?;
    let kept = summary.clips.iter().filter(|clip| clip.kept).count();
    eprintln!("{}: {kept} of {} clips kept", summary.session.display(), options.clips);
    if json { print_json(&summary) } else { Ok(()) }
}
