//! `calibration compare`.

use super::print;
use crate::identify::object::{self, compare};
use inference::interrupt::Interrupt;
use shared_mem::output;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Five ways of finding an object's parameters from the same strokes: least squares (what `identify object` does), the same by
poses alone, a particle swarm, CMA-ES, and gradients without the centre of mass. One table of the errors on strokes held out, one of
what each way cost, and how many strokes had to be simulated to come as near as the swarm did.

Examples:
  calibration compare strokes
  calibration compare strokes --out comparison.json
  calibration compare strokes --points 2000 --parameters arm.toml --json")]
pub struct CompareArguments {
    /// Session folder.
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Parameters that are known already: the arm's gains, effects.
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// Points that swarm and CMA-ES may try; each simulates every stroke.
    #[arg(long = "points", alias = "budget", value_name = "N", default_value_t = 1200, value_parser = clap::value_parser!(u32).range(1..))]
    budget: u32,
    /// Draws the strokes that are held out, and the searches.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = inference::seed::parse)]
    seed: u64,
    /// Where the answer goes, as JSON.
    #[arg(long, value_name = "COMPARISON.JSON")]
    out: Option<PathBuf>,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: CompareArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let CompareArguments { session, cell, parameters, budget, seed, out, json } = arguments;
    let options =
        object::Options { session, cell, parameters, budget: budget as usize, seed, ..object::Options::default() };
    let found = compare::compare(&options, interrupt)?;
    if let Some(file) = &out {
        output::write(file, serde_json::to_string_pretty(&found)?)?;
    }
    print(json, &found, found.table())
}
