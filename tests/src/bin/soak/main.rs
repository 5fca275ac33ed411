//! A robot cell that runs for a long time beside other work: what is lost, what is exceeded, what grows.
//!
//! `cargo build --release --workspace && cargo run --release -p tests --bin soak -- --minutes 60`
//!
//! Two cells run at once, each with an arm that is steered without a pause and everything recorded: a simulated arm with camera,
//! tracker and shadow twin, and a served robot that the bridge drives over FCI. Disk, memory, timers and network of the machine are
//! loaded meanwhile. A line every ten seconds goes to a table, so that a run that was cut off has left what it saw. The answer
//! is one JSON object; exit code 1 where a command or a state exceeded a limit, a fault or a brake came unasked, a row is
//! missing that the clip does not name, or memory grew after the first ten minutes.
#![allow(clippy::print_stdout)] // its answer

mod cell;
mod clip;
mod load;
mod table;

use cell::{Ended, Running};
use clap::Parser;
use load::{Load, Loaded};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use table::Table;
use tests::{Cell, lab_cell};

/// Runs cells under load and counts what goes wrong.
#[derive(Debug, Parser)]
struct Arguments {
    /// How long.
    #[arg(long, default_value_t = 60.0)]
    minutes: f64,
    /// What loads the machine meanwhile; `none` for an idle one.
    #[arg(long, value_delimiter = ',', default_value = "disk,memory,timer,network")]
    load: Vec<Load>,
    /// The table of memory, a line every ten seconds [CSV].
    #[arg(long, default_value = "target/soak.csv")]
    table: PathBuf,
}

/// Time until memory counts as grown: a sixth of a run, ten minutes at most.
fn start_of_growth(whole: Duration) -> Duration {
    (whole / 6).min(Duration::from_secs(600))
}

/// Pictures so small that a recording of an hour fits on the disk.
fn cell_toml() -> String {
    let toml = lab_cell().replace("width = 640\nheight = 480\nrate = 30.0", "width = 64\nheight = 48\nrate = 10.0");
    assert!(toml.contains("width = 64\n"), "the shipped cell has another camera");
    toml
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let whole = Duration::from_secs_f64(60.0 * arguments.minutes);
    let cell = Cell::with(&cell_toml());
    let mut running = [Running::simulated(&cell), Running::served(&cell)];
    for cell in &running {
        Cell::until("the recording begins", Duration::from_secs(20), || Cell::size(cell.clip()) > 0);
    }
    let loaded = Loaded::start(&arguments.load, &cell.path("load"));
    let mut table = Table::create(&arguments.table, start_of_growth(whole));
    let begin = Instant::now();
    let mut dead = Vec::new();
    while begin.elapsed() < whole && dead.is_empty() {
        std::thread::sleep(Duration::from_secs(1));
        dead = running.iter_mut().flat_map(Running::dead).collect();
        table.look(begin.elapsed(), &running);
    }
    drop(loaded);
    let ended = running.map(Running::end);
    report(begin.elapsed(), &arguments, &dead, &ended, &table)
}

/// Prints the answer; failure where something went wrong.
fn report(took: Duration, arguments: &Arguments, dead: &[String], ended: &[Ended], table: &Table) -> ExitCode {
    let wrong: Vec<String> =
        dead.iter().map(|name| format!("{name} ended by itself")).chain(ended.iter().flat_map(Ended::wrong)).collect();
    let grown = table.grown();
    let cells: serde_json::Map<_, _> = ended.iter().map(|cell| (cell.name.to_owned(), cell.json())).collect();
    let answer = json!({
        "minutes": took.as_secs_f64() / 60.0,
        "load": arguments.load.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "cells": cells,
        "memory": table.json(),
        "wrong": wrong,
        "grown": grown,
    });
    println!("{answer:#}");
    if wrong.is_empty() && grown.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
