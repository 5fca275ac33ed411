//! `calibration capture`.

use super::{between, print_json};
use calibration::capture::task::Task;
use calibration::capture::{control_hit_slide, excitation};
use calibration::interrupt::Interrupt;
use calibration::keys::Keys;
use clap::Subcommand;
use shared_mem::console;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum Capture {
    /// All joints at once along sums of sines, inside every limit: what identifying the arm needs.
    Excitation(ExcitationArguments),
    /// The tool runs up to the object, hits it and lets it slide: what identifying the object and diagnosing contact need.
    ControlHitSlide(StrokeArguments),
}

/// What every capture is asked for.
#[derive(Debug, clap::Args)]
struct TaskArguments {
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
    /// How often a robot that stops itself (a reflex) is recovered without you: the arm moves again by itself then.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=20))]
    recover: u32,
}

impl TaskArguments {
    fn task(self) -> Task {
        let Self { cell, clips, out, arm, realtime, recover } = self;
        Task { cell, clips, out, arm, realtime, recover, domain: None }
    }
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The arm starts and ends at rest in the pose it holds, and stays above table and object. An amplitude that breaks a limit
of position, speed, acceleration, jerk, torque or height is made smaller; which limit it was is said for each joint.

A session that exists is continued with the next number; nothing is overwritten. At any moment p (or SIGUSR1)
pauses: the arm brakes inside its limits and holds, and p (or SIGUSR2) goes on with a fresh try of the same clip. q or
Ctrl-C ends: the arm brakes, and what was recorded is kept. A robot that stops itself ends it too; with --recover 3 it is
recovered up to three times 2 s later, the arm goes back and the clip is repeated. One that a person stopped is left alone.

Examples:
  calibration capture excitation --cell config/fr3_cell.toml --clips 4 --out session
  calibration capture excitation --cell lab/cell.toml --clips 8 --out monday --arm fci://172.16.0.2 --amplitude 0.2")]
pub(super) struct ExcitationArguments {
    #[command(flatten)]
    task: TaskArguments,
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

#[derive(Debug, clap::Args)]
#[command(after_help = "\
cell.toml needs [tool], [table] and [object]. The arm finds the object by its tracked pose, goes above it to the stroke's start, comes down, waits until all is still,
strikes, waits until the object rests, and steps back. Strokes come from all sides at all speeds, and every sixth repeats
the first, so that scatter and drift can be told from a gap. Directions are chosen so that the object stays in reach; one
that got away is asked for by hand.

A session that exists is continued with the next number; nothing is overwritten. At any moment p (or SIGUSR1)
pauses: the arm brakes inside its limits and holds, and p (or SIGUSR2) goes on with a fresh try of the same clip. q or
Ctrl-C ends: the arm brakes, and what was recorded is kept. A robot that stops itself ends it too; with --recover 3 it is
recovered up to three times 2 s later, the arm goes back and the clip is repeated. One that a person stopped is left alone.

Examples:
  calibration capture control-hit-slide --cell config/fr3_cell.toml --clips 12 --out strokes
  calibration capture control-hit-slide --cell lab/cell.toml --clips 1 --out monday --preview next.svg")]
pub(super) struct StrokeArguments {
    #[command(flatten)]
    task: TaskArguments,
    /// Draws the next stroke into this file and moves nothing.
    #[arg(long, value_name = "FILE.SVG")]
    preview: Option<PathBuf>,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(capture: Capture, interrupt: &Interrupt) -> anyhow::Result<()> {
    let _terminal = Keys::listen(interrupt);
    match capture {
        Capture::Excitation(arguments) => excite(arguments, interrupt),
        Capture::ControlHitSlide(arguments) => strike(arguments, interrupt),
    }
}

fn excite(arguments: ExcitationArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let ExcitationArguments { task, duration, amplitude, seed, json } = arguments;
    let options = excitation::Options { task: task.task(), duration, amplitude, seed };
    let summary = excitation::capture(&options, interrupt, &mut String::new)?;
    let kept = summary.clips.iter().filter(|clip| clip.kept).count();
    console::line(format_args!("{}: {kept} of {} clips kept", summary.session.display(), options.task.clips));
    if json { print_json(&summary) } else { Ok(()) }
}

fn strike(arguments: StrokeArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let StrokeArguments { task, preview, json } = arguments;
    let options = control_hit_slide::Options { task: task.task(), preview };
    let summary = control_hit_slide::capture(&options, interrupt)?;
    if options.preview.is_none() {
        let kept = summary.clips.iter().filter(|clip| clip.kept).count();
        console::line(format_args!("{}: {kept} of {} clips kept", summary.session.display(), summary.clips.len()));
    }
    if json { print_json(&summary) } else { Ok(()) }
}
