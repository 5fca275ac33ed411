//! How often `calibration check` finds each fault of a recording, and how often it finds one where there is none: every fault is
//! put into clean sessions, seed by seed.
//!
//! `cargo run --release -p calibration --example check_faults -- --trials 50 --seed 1 [SESSION...]`
//!
//! Without sessions they are simulated: motions, motions at two speeds, strokes, tosses, and sessions with an effect of the twin,
//! which is a cause and no fault. Recorded sessions that are given are taken for clean, and stand beside the simulated ones.

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use calibration::check::injected::{Clean, Injected, Sort, Trial, table};
use clap::Parser;
use rayon::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::progress::Progress;
use shared_mem::recording::Session;
use std::path::PathBuf;

#[derive(Debug, Parser)]
struct Arguments {
    /// Trials of each fault, and clean sessions of each sort.
    #[arg(long, default_value_t = 50)]
    trials: u64,
    /// Number of the first session.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Cell that all simulated sessions share.
    #[arg(long, default_value = "config/fr3_cell.toml")]
    cell: PathBuf,
    /// Recorded sessions that are taken for clean, instead of simulated ones.
    #[arg(value_name = "SESSION")]
    sessions: Vec<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let _last_lines = console::start();
    let Arguments { trials, seed, cell, sessions } = Arguments::parse();
    let clean = if sessions.is_empty() { simulated(&Cell::read(&cell)?, trials, seed) } else { recorded(&sessions)? };
    let bar = Progress::new("check", (clean.len() + Injected::ALL.len()) as u64);
    let mut done = 0;
    let mut step = |what: &str| {
        done += 1;
        bar.show(done, what);
    };
    let mut all: Vec<Trial> = Vec::new();
    for (name, session) in &clean {
        let trial = Trial::clean(session);
        if !trial.right {
            let said: Vec<&str> = trial.beside.iter().map(|fault| fault.key()).collect();
            println!("false alarm, {name}: {}", said.join(", "));
        }
        all.push(trial);
        step("clean sessions");
    }
    // Sessions with a cause are there for false alarms alone.
    let whole: Vec<&Clean> =
        clean.iter().filter(|(name, _)| !name.starts_with("causes")).map(|(_, session)| session).collect();
    for fault in Injected::ALL {
        let tried = |k: u64| {
            let number = seed + k;
            let fitting: Vec<&&Clean> = whole.iter().filter(|session| fault.fits(session)).collect();
            let session = fitting.get(number as usize % fitting.len().max(1))?;
            Some((number, Trial::with(fault, session, number)?))
        };
        let found: Vec<(u64, Trial)> = (0..trials).into_par_iter().filter_map(tried).collect();
        for (number, _) in found.iter().filter(|(_, trial)| !trial.right) {
            println!("missed, {}: number {number}", fault.name());
        }
        all.extend(found.into_iter().map(|(_, trial)| trial));
        step(fault.name());
    }
    drop(bar);
    println!("{}", table(&all));
    Ok(())
}

fn simulated(cell: &Cell, trials: u64, seed: u64) -> Vec<(String, Clean)> {
    let sorts = [Sort::Motions, Sort::Paces, Sort::Strokes, Sort::Tosses, Sort::Causes];
    let jobs: Vec<(Sort, u64)> =
        sorts.into_iter().flat_map(|sort| (seed..seed + trials).map(move |number| (sort, number))).collect();
    let bar = Progress::new("sessions", jobs.len() as u64);
    let made = std::sync::atomic::AtomicU64::new(0);
    let make = |(sort, number): &(Sort, u64)| {
        let session = Clean::of(*sort, *number, cell);
        bar.show(made.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, "simulated");
        // An arm that a hidden effect lets fall gives no session.
        session.ok().map(|session| (format!("{sort:?} {number}").to_lowercase(), session))
    };
    jobs.par_iter().filter_map(make).collect()
}

fn recorded(folders: &[PathBuf]) -> anyhow::Result<Vec<(String, Clean)>> {
    let open = |folder: &PathBuf| Ok((folder.display().to_string(), Clean::recorded(&Session::open(folder)?)));
    folders.iter().map(open).collect()
}
