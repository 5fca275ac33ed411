//! `calibration benchmark`.

use super::print;
use crate::benchmark::calibrate;
use crate::benchmark::run::{Extent, Outcome, Plan, run as judge};
use crate::benchmark::score::Scores;
use crate::report::benchmark::page;
use crate::report::terminal;
use inference::interrupt::Interrupt;
use serde_json::json;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::output::Destination;
use std::path::PathBuf;
use std::time::Instant;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Worlds are drawn from their numbers: gains, object, motions, scatter, and what is wrong. The diagnosis knows
nothing of it, and they are integrated in other steps than the twin's. With --size 1 every effect is met once in each kind of
session, beside half as many worlds without any, a quarter as many with two, and disturbances that no effect describes; a
larger size repeats that with other numbers. Each world is reported on stderr as soon as it is scored.

Ctrl-C scores the worlds that are done.

--calibrate prints what labelled sessions of another engine, as tests/peers/run.py records them and has them diagnosed, make
of the measured numbers by which a diagnosis decides (calibration/src/diagnose/criteria.rs), beside the values in use.

Examples:
  calibration benchmark --short
  calibration benchmark --null 300 --json > null.json
  calibration benchmark --size 2 --report benchmark.html
  calibration benchmark --calibrate peers --json > criteria.json")]
pub struct BenchmarkArguments {
    /// Cell that all worlds share.
    #[arg(long, value_name = "CELL.TOML", default_value = "fr3")]
    cell: PathBuf,
    /// How often every effect is met.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    size: u64,
    /// A dozen worlds instead, in minutes.
    #[arg(long, conflicts_with = "size")]
    short: bool,
    /// So many worlds without anything wrong instead: how often is an effect named without cause?
    #[arg(long, value_name = "N", conflicts_with_all = ["size", "short"])]
    null: Option<u64>,
    /// Regenerates the criteria of a diagnosis from folders of labelled sessions instead.
    #[arg(long, value_name = "FOLDER", num_args = 1.., conflicts_with_all = ["size", "short", "null", "report", "clips", "seed", "cell"])]
    calibrate: Vec<PathBuf>,
    /// Clips in each session, 4 to 64; fewer than 8 of an arm alone count in parts.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(4..=64))]
    clips: u64,
    /// Number of the first world.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = inference::seed::parse)]
    seed: u64,
    /// Where the page goes.
    #[arg(long, value_name = "REPORT.HTML")]
    report: Option<PathBuf>,
    /// Replaces the file of --report.
    #[arg(long, requires = "report")]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: BenchmarkArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    if !arguments.calibrate.is_empty() {
        return regenerate(&arguments.calibrate, arguments.json);
    }
    let began = Instant::now();
    let page_file = Destination::of(arguments.report.as_deref(), arguments.force)?;
    let cell = Cell::read(&arguments.cell)?;
    let extent = match (arguments.short, arguments.null) {
        (true, _) => Extent::Short,
        (false, Some(worlds)) => Extent::Null(worlds),
        (false, None) => Extent::Full(arguments.size),
    };
    let plan = Plan { extent, clips: usize::try_from(arguments.clips)?, seed: arguments.seed };
    let Outcome { methods, left_out } = judge(&plan, &cell, interrupt);
    let seconds = began.elapsed().as_secs_f64();
    if let Some(file) = &page_file {
        let worlds = methods.first().map_or(0, |method| method.cases.len());
        let origin =
            format!("calibration benchmark: {worlds} worlds from number {} on, {seconds:.0} s", arguments.seed);
        file.write(page(&methods, &origin))?;
    }
    left_out.iter().for_each(|world| console::line(format_args!("left out: {world}")));
    let scores: Vec<_> =
        methods.iter().map(|method| json!({ "method": method.name, "scores": Scores::of(&method.cases) })).collect();
    let cases = methods.first().map(|method| &method.cases);
    let answer = json!({ "scores": scores, "cases": cases, "left_out": left_out, "seconds": seconds });
    print(arguments.json, &answer, terminal::benchmark(&methods))
}

fn regenerate(folders: &[PathBuf], json: bool) -> anyhow::Result<()> {
    let mut sessions = Vec::new();
    for folder in folders {
        sessions.extend(calibrate::read(folder)?);
    }
    let criteria = calibrate::regenerate(&sessions);
    print(json, &json!({ "criteria": criteria, "sessions": sessions.len() }), terminal::criteria(&criteria))
}
