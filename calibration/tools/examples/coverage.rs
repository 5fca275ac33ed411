//! How often printed intervals hold the truth: sessions of worlds drawn from their numbers, identified or diagnosed, a line
//! for every number that was printed with an interval. What is done stands in a file, so that the same command goes on.
//!
//! `cargo run --release -p tools --example coverage -- SUBJECT --sessions 100 --seed 1 --out sessions.json`
//!
//! `SUBJECT`: `arm` (with `--also EFFECT` in worlds in which that effect acts), `object`, `diagnose-arm`, `diagnose-object`.

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use clap::{Parser, ValueEnum};
use serde::{Deserialize, Serialize};
use shared_mem::cell::Cell;
use shared_mem::interrupt::Interrupt;
use shared_mem::{console, input, output};
use std::path::PathBuf;
use std::time::Instant;
use tools::coverage::{Session, Subject, table};
use worlds::world::Kind;

#[derive(Debug, Parser)]
struct Arguments {
    /// Whose intervals.
    subject: Name,
    /// Sessions.
    #[arg(long, default_value_t = 100)]
    sessions: u64,
    /// Number of the first world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Clips in each session.
    #[arg(long, default_value_t = 8)]
    clips: usize,
    /// An effect that acts and is searched besides (`arm`).
    #[arg(long)]
    also: Option<String>,
    /// Cell that all worlds share.
    #[arg(long, default_value = "config/fr3_cell.toml")]
    cell: PathBuf,
    /// Where the sessions go that are done; those that stand there already are not done again.
    #[arg(long)]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Name {
    Arm,
    Object,
    DiagnoseArm,
    DiagnoseObject,
}

/// What is kept.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    /// What was asked for, but for the number of sessions.
    asked: String,
    sessions: Vec<Session>,
}

fn main() -> anyhow::Result<()> {
    let Arguments { subject, sessions, seed, clips, also, cell, out } = Arguments::parse();
    let subject = match subject {
        Name::Arm => Subject::Arm(also),
        Name::Object => Subject::Object,
        Name::DiagnoseArm => Subject::Diagnosis(Kind::Excitation),
        Name::DiagnoseObject => Subject::Diagnosis(Kind::Strokes),
    };
    let cell = Cell::read(&cell)?;
    let interrupt = Interrupt::listen()?;
    let asked = format!("{subject:?}, {clips} clips");
    let mut kept = Kept { asked: asked.clone(), sessions: Vec::new() };
    if out.exists() {
        kept = serde_json::from_slice(&input::bytes(&out, input::Kind::List)?)?;
    }
    anyhow::ensure!(kept.asked == asked, "{}: holds sessions of {}; give another --out", out.display(), kept.asked);
    let began = Instant::now();
    let mut done = 0;
    for number in seed..seed + sessions {
        if kept.sessions.iter().any(|session| session.world == number) {
            continue;
        }
        let session = subject.examine(&subject.world(number, &cell)?, clips, &interrupt);
        if interrupt.asked() {
            break;
        }
        done += 1;
        let (inside, all) = (session.printed.iter().filter(|printed| printed.holds()).count(), session.printed.len());
        println!("world {number}: {inside} of {all} hold the truth {}", session.left_out.as_deref().unwrap_or(""));
        let left = (seed + sessions - 1 - number) as f64 * began.elapsed().as_secs_f64() / f64::from(done);
        console::line(format_args!("{:.0} s so far, about {left:.0} s left", began.elapsed().as_secs_f64()));
        kept.sessions.push(session);
        output::write(&out, serde_json::to_vec(&kept)?)?;
        output::write(&out.with_extension("txt"), table(&kept.sessions, subject.level()))?;
    }
    print!("{}", table(&kept.sessions, subject.level()));
    Ok(())
}
