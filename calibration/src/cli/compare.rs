//! `calibration compare`.

use super::print_json;
use calibration::identify::object::{self, compare};
use calibration::interrupt::Interrupt;
use shared_mem::console;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Four ways of finding an object's parameters from the same strokes: least squares (what `identify object` does), a
particle swarm, CMA-ES, and gradients without the centre of mass. One table of the errors on strokes held out, one of
what each way cost, and how many strokes had to be simulated to come as near as the swarm did.

Examples:
  calibration compare strokes
  calibration compare strokes --budget 2000 --parameters arm.toml --json")]
pub(super) struct CompareArguments {
    /// Session folder.
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// Parameters that are known already: the arm's gains, effects.
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// Points that swarm and CMA-ES may try; each simulates every stroke.
    #[arg(long, value_name = "N", default_value_t = 1200, value_parser = clap::value_parser!(u32).range(1..))]
    budget: u32,
    /// Draws the strokes that are held out, and the searches.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: CompareArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let CompareArguments { session, parameters, budget, seed, json } = arguments;
    let options = object::Options { session, parameters, budget: budget as usize, seed, ..object::Options::default() };
    let found = compare::compare(&options, interrupt)?;
    console::block(found.table());
    if json { print_json(&found) } else { Ok(()) }
}
