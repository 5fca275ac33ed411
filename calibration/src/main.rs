//! The program `calibration`: reads the command line, runs a verb, prints one JSON object if asked, one line if it fails.

use calibration::capture::excitation;
use calibration::demo;
use calibration::diagnose;
use calibration::interrupt::Interrupt;
use clap::{Parser, Subcommand};
use serde::Serialize;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// Records how a robot cell moves, and says where its twin differs.
#[derive(Debug, Parser)]
#[command(
    version,
    arg_required_else_help = true,
    after_help = "\
Examples:
  calibration demo --out demo
  calibration capture excitation --cell config/fr3_cell.toml --clips 4 --out session
  calibration diagnose session --report report.html
Every verb has its own --help with an example. Logs and progress go to stderr (RUST_LOG=debug for more)."
)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Moves the arm through a running bridge (or starts one) and records clips into a session folder.
    #[command(subcommand)]
    Capture(Capture),
    /// Where the twin differs from the cell, which effect causes it, and how far the gap shrinks with it.
    Diagnose(diagnose::command::Arguments),
    /// The whole story on the simulated cell: shadow, record, replay, explain.
    Demo(DemoArguments),
}

#[derive(Debug, Subcommand)]
enum Capture {
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
struct ExcitationArguments {
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

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Starts a simulated robot with hidden gains and its twin as two processes, records a session while the twin shadows the
robot, replays it with the gains of cell.toml and with the true ones, and writes FOLDER/report.html. Takes less than a minute.

Examples:
  calibration demo --out demo
  calibration demo --out demo7 --seed 7 --clips 4 --json")]
struct DemoArguments {
    /// Folder to create.
    #[arg(long, value_name = "FOLDER", default_value = "demo")]
    out: PathBuf,
    /// Draws the hidden gains and the motions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Clips to record.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=100))]
    clips: u32,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// A number from `LO / UNIT` to `HI / UNIT`.
fn between<const LO: u32, const HI: u32, const UNIT: u32>(text: &str) -> Result<f64, String> {
    let [lo, hi] = [LO, HI].map(|bound| f64::from(bound) / f64::from(UNIT));
    match text.parse::<f64>() {
        Ok(value) if (lo..=hi).contains(&value) => Ok(value),
        _ => Err(format!("give a number from {lo} to {hi}")),
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    match run(arguments.verb) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("calibration: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(verb: Verb) -> anyhow::Result<()> {
    let interrupt = Interrupt::listen()?;
    match verb {
        Verb::Capture(Capture::Excitation(arguments)) => capture(arguments, &interrupt),
        Verb::Diagnose(arguments) => {
            let found = diagnose::command::run(&arguments, &interrupt)?;
            if arguments.json { print_json(&found) } else { Ok(()) }
        }
        Verb::Demo(arguments) => show(arguments, &interrupt),
    }
}

fn capture(arguments: ExcitationArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let ExcitationArguments { cell, clips, out, arm, realtime, duration, amplitude, seed, json } = arguments;
    let options = excitation::Options { cell, clips, out, arm, realtime, duration, amplitude, seed, domain: None };
    let summary = excitation::capture(&options, interrupt, &mut String::new)?;
    let kept = summary.clips.iter().filter(|clip| clip.kept).count();
    eprintln!("{}: {kept} of {} clips kept", summary.session.display(), options.clips);
    if json { print_json(&summary) } else { Ok(()) }
}

fn show(arguments: DemoArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let DemoArguments { out, seed, clips, json } = arguments;
    let finding = demo::demo(&demo::Options { out, seed, clips }, interrupt)?;
    eprintln!("{}", finding.table());
    if json { print_json(&finding) } else { Ok(()) }
}

fn print_json(answer: &impl Serialize) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    serde_json::to_writer(&mut stdout, answer)?;
    writeln!(stdout)?;
    Ok(())
}
