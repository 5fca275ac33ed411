//! How often `calibration diagnose A --against B` is right: pairs of sessions of worlds drawn from their numbers, between which one
//! thing changed or nothing. What is done stands in a file, so that the same command goes on.
//!
//! `cargo run --release -p calibration --example against -- equal-arm --pairs 20 --seed 1 --out pairs.json`
//!
//! `equal-arm`, `equal-strokes`, `changed-arm` (payload, friction of the gears, stiffness, delay in turn), `changed-table`.

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use calibration::benchmark::pairs::{CHANGES, Changed, Outcome};
use calibration::benchmark::world::Kind;
use clap::{Parser, ValueEnum};
use inference::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::{input, output};
use std::path::PathBuf;

#[derive(Debug, Parser)]
struct Arguments {
    /// Which pairs.
    sort: Sort,
    /// Pairs.
    #[arg(long, default_value_t = 20)]
    pairs: u64,
    /// Number of the first world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Clips in each session.
    #[arg(long, default_value_t = 8)]
    clips: usize,
    /// Cell that all worlds share.
    #[arg(long, default_value = "config/fr3_cell.toml")]
    cell: PathBuf,
    /// Where the pairs go that are done; those that stand there already are not done again.
    #[arg(long)]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Sort {
    EqualArm,
    EqualStrokes,
    ChangedArm,
    ChangedTable,
}

impl Sort {
    fn changed(self, number: u64) -> Changed {
        match self {
            Self::EqualArm => Changed::Nothing(Kind::Excitation),
            Self::EqualStrokes => Changed::Nothing(Kind::Strokes),
            // Of two worlds that follow each other one has friction in both sessions.
            Self::ChangedArm => CHANGES[usize::try_from(number / 2 % 4).unwrap_or(0)],
            Self::ChangedTable => Changed::TableFriction,
        }
    }
}

fn main() -> anyhow::Result<()> {
    let Arguments { sort, pairs, seed, clips, cell, out } = Arguments::parse();
    let cell = Cell::read(&cell)?;
    let interrupt = Interrupt::listen()?;
    let mut done: Vec<Outcome> = Vec::new();
    if out.exists() {
        done = serde_json::from_slice(&input::bytes(&out, input::Kind::List)?)?;
    }
    for number in seed..seed + pairs {
        let changed = sort.changed(number);
        if done.iter().any(|pair| pair.world == number && pair.truth == changed.name()) {
            continue;
        }
        let outcome = match changed.examine(number, (clips, &cell), &interrupt) {
            _ if interrupt.asked() => break,
            Ok(outcome) => outcome,
            Err(error) => {
                println!("world {number}: {error}");
                continue;
            }
        };
        let right = if outcome.is_right() { "right" } else { "WRONG" };
        println!("{right} {}", serde_json::to_string(&outcome)?);
        done.push(outcome);
        output::write(&out, serde_json::to_vec(&done)?)?;
    }
    let right = done.iter().filter(|pair| pair.is_right()).count();
    let intervals: Vec<bool> = done.iter().filter_map(Outcome::holds).collect();
    let holding = intervals.iter().filter(|holds| **holds).count();
    let named = done.iter().filter(|pair| pair.verdict == "named").count();
    println!(
        "{right} of {} right, {named} named; {holding} of {} intervals hold the change",
        done.len(),
        intervals.len()
    );
    Ok(())
}
