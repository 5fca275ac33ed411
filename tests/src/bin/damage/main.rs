//! Damaged files, thousands of them: every program must end with an answer or one line that names the file, never with a
//! panic or a signal, within bounds of time and memory.
//!
//! `cargo build --release --workspace && cargo run --release -p tests --bin damage -- --count 3000 --seed 1`
//!
//! Well-formed files of every kind are made here; case `n` of a seed damages one of them and runs one verb on it. A case
//! depends on its number alone, so a long run can be done in slices (`--seed 1 --count 500`, `--seed 501 --count 500`, ...) and
//! any case repeated (`--seed N --count 1`). What a case was is kept in `--keep` when it goes wrong. Exit code 1 when one did.
#![allow(clippy::print_stdout)] // its answer

mod changes;
mod files;
mod run;
mod verbs;

use clap::Parser;
use run::{Limits, Outcome, Wrong};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Runs the programs on damaged files.
#[derive(Debug, Parser)]
struct Arguments {
    /// Cases.
    #[arg(long, default_value_t = 3000)]
    count: u64,
    /// Number of the first case.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Cases at a time.
    #[arg(long, default_value_t = 2)]
    jobs: u64,
    /// Starts no more cases after so many seconds; the summary says where to go on.
    #[arg(long, default_value_t = 1_000_000)]
    stop_after: u64,
    /// Processor time that a case may take [s].
    #[arg(long, default_value_t = 30)]
    seconds: u64,
    /// Memory that a case may take [MiB].
    #[arg(long, default_value_t = 2048)]
    memory: u64,
    /// Programs that are run.
    #[arg(long, value_delimiter = ',', default_value = "twin,calibration,rt_bridge")]
    programs: Vec<String>,
    /// Folder for the files of cases that went wrong.
    #[arg(long, default_value = "target/damage")]
    keep: PathBuf,
}

/// What came of all cases.
#[derive(Debug, Default)]
struct Tally {
    cases: u64,
    answered: u64,
    refused: u64,
    wrong: BTreeMap<&'static str, Vec<u64>>,
    /// Most memory [MiB] and processor time [s] of a case, with its number.
    memory: (u64, u64),
    seconds: (f64, u64),
}

impl Tally {
    fn add(&mut self, number: u64, outcome: &Outcome) {
        self.cases += 1;
        self.answered += u64::from(outcome.code == Some(0));
        self.refused += u64::from(outcome.code == Some(1));
        for wrong in &outcome.wrong {
            self.wrong.entry(wrong.name()).or_default().push(number);
        }
        if outcome.memory_mib > self.memory.0 {
            self.memory = (outcome.memory_mib, number);
        }
        if outcome.cpu.as_secs_f64() > self.seconds.0 {
            self.seconds = (outcome.cpu.as_secs_f64(), number);
        }
    }

    fn summary(&self, next: u64) -> serde_json::Value {
        let of = |wrong: Wrong| self.wrong.get(wrong.name()).map_or(&[][..], Vec::as_slice);
        serde_json::json!({
            "cases": self.cases, "answered": self.answered, "refused": self.refused,
            "panics": of(Wrong::Panic), "signals": of(Wrong::Signal), "too_long": of(Wrong::TooLong),
            "too_much_memory": of(Wrong::TooMuchMemory), "exit_codes": of(Wrong::ExitCode), "messages": of(Wrong::Message),
            "most_memory_mib": {"value": self.memory.0, "case": self.memory.1},
            "most_seconds": {"value": self.seconds.0, "case": self.seconds.1},
            "next_seed": next,
        })
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let whole = tempfile::tempdir().expect("a temporary folder");
    files::write(whole.path());
    let verbs = verbs::all(&arguments.programs);
    let limits = Limits { cpu: Duration::from_secs(arguments.seconds), memory_mib: arguments.memory };
    let (next, tally, began) = (AtomicU64::new(arguments.seed), Mutex::new(Tally::default()), Instant::now());
    let end = arguments.seed + arguments.count;
    std::thread::scope(|scope| {
        for _ in 0..arguments.jobs {
            scope.spawn(|| {
                while began.elapsed().as_secs() < arguments.stop_after {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= end {
                        break;
                    }
                    let outcome = run::case(number, whole.path(), &verbs, &limits, &arguments.keep);
                    let mut tally = tally.lock().expect("no case panics");
                    tally.add(number, &outcome);
                    for wrong in &outcome.wrong {
                        eprintln!("case {number}: {}: {}", wrong.name(), outcome.told);
                    }
                    if tally.cases % 100 == 0 {
                        let wrong: usize = tally.wrong.values().map(Vec::len).sum();
                        eprintln!("{} cases in {:.0} s, {wrong} wrong", tally.cases, began.elapsed().as_secs_f64());
                    }
                }
            });
        }
    });
    let tally = tally.into_inner().expect("no case panics");
    println!("{}", tally.summary(arguments.seed + tally.cases));
    if tally.wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
