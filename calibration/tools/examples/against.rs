//! How often `calibration diagnose A --against B` is right: pairs of sessions of worlds drawn from their numbers, between which one
//! thing changed or nothing. What is done stands in a file, so that the same command goes on.
//!
//! `cargo run --release -p tools --example against -- equal-arm --pairs 20 --seed 1 --out pairs.json`
//!
//! `equal-arm`, `equal-strokes`, `changed-arm` (payload, friction of the gears, stiffness, delay in turn), `changed-table`.

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use calibration::benchmark::trial::sealed;
use calibration::diagnose::against::{Comparison, Pair, compare_clips};
use calibration::diagnose::{self, Options, Status};
use clap::{Parser, ValueEnum};
use serde::{Deserialize, Serialize};
use shared_mem::cell::Cell;
use shared_mem::interrupt::Interrupt;
use shared_mem::{input, output};
use std::path::PathBuf;
use worlds::changed::{CHANGES, Changed};
use worlds::session::record;
use worlds::world::Kind;

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

/// What came of one pair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Outcome {
    /// Number of the world.
    world: u64,
    /// What changed; empty where nothing did.
    truth: String,
    /// True change of its first number.
    size: f64,
    verdict: String,
    /// What it names.
    changes: Vec<String>,
    /// The change that was found of the first number of what changed, with its interval; none where it was not found.
    found: Option<(f64, [f64; 2])>,
    /// Share of B's gap that closes.
    shrink: f64,
    /// Wall-clock time [s].
    seconds: f64,
}

/// Has a pair of so many clips each compared.
fn examine(changed: Changed, number: u64, clips: usize, cell: &Cell, interrupt: &Interrupt) -> anyhow::Result<Outcome> {
    let (worlds, size) = changed.worlds(number, cell);
    let [a, b] = [sealed(&worlds[0], record(&worlds[0], clips)?), sealed(&worlds[1], record(&worlds[1], clips)?)];
    let pair = Pair::of([a.1, b.1], false, Vec::new());
    let options = Options { seed: number, ..Options::default() };
    let found = compare_clips([&a.0, &b.0], &pair, &options, interrupt)?;
    Ok(outcome(changed, number, size, &found))
}

fn outcome(changed: Changed, number: u64, size: f64, found: &Comparison) -> Outcome {
    let kind = match found.verdict.kind {
        diagnose::Kind::None => "none",
        diagnose::Kind::Named => "named",
        diagnose::Kind::Class => "class",
        diagnose::Kind::Unexplained => "unexplained",
        diagnose::Kind::NotTestable => "not_testable",
    };
    let named = found.candidates.iter().find(|candidate| {
        candidate.name == changed.name() && matches!(candidate.status, Status::Named | Status::Possible)
    });
    let first = named.and_then(|candidate| candidate.parameters.values().next());
    Outcome {
        world: number,
        truth: changed.name().to_owned(),
        size,
        verdict: kind.to_owned(),
        changes: found.verdict.changes.clone(),
        found: first.map(|values| (values.change[0], values.ci95[0])),
        shrink: found.gap.shrink.value,
        seconds: found.seconds,
    }
}

impl Outcome {
    /// Whether what it says is right: the change named, alone or in a class; nothing where nothing changed.
    fn is_right(&self) -> bool {
        if self.truth.is_empty() {
            return !matches!(self.verdict.as_str(), "named" | "class");
        }
        match self.verdict.as_str() {
            "named" => self.changes == [self.truth.clone()],
            "class" => self.changes.contains(&self.truth),
            _ => false,
        }
    }

    /// Whether the interval holds the true change; none where it was not found.
    fn holds(&self) -> Option<bool> {
        self.found.map(|(_, [low, high])| (low..=high).contains(&self.size))
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
        let outcome = match examine(changed, number, clips, &cell, &interrupt) {
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
