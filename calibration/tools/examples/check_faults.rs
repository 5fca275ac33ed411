//! How often `calibration check` finds each fault of a recording, and how often it finds one where there is none: every fault is
//! put into clean sessions, seed by seed.
//!
//! `cargo run --release -p tools --example check_faults -- --trials 50 --seed 1 [SESSION...]`
//!
//! Without sessions they are simulated: motions, motions at two speeds, strokes, tosses, and sessions with an effect of the twin,
//! which is a cause and no fault. Recorded sessions that are given are taken for clean, and stand beside the simulated ones.
//!
//! `--write FOLDER` also writes each session for other programs: `tests/peers/recording_doctors.py` makes bags and data sets of them.

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use clap::Parser;
use rayon::prelude::*;
use serde_json::json;
use shared_mem::cell::{Cell, ClipEntry};
use shared_mem::progress::Progress;
use shared_mem::recording::{JointSeries, Session};
use shared_mem::{console, output};
use std::path::{Path, PathBuf};
use tools::injected::{Clean, Injected, Sort, Trial, inject, table};

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
    /// New folder for the sessions, a folder each: `clean/SESSION` and `FAULT/NUMBER`, as they are after reading.
    #[arg(long, value_name = "FOLDER")]
    write: Option<PathBuf>,
    /// Recorded sessions that are taken for clean, instead of simulated ones.
    #[arg(value_name = "SESSION")]
    sessions: Vec<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let _last_lines = console::start();
    let Arguments { trials, seed, cell, write, sessions } = Arguments::parse();
    let clean = if sessions.is_empty() { simulated(&Cell::read(&cell)?, trials, seed) } else { recorded(&sessions)? };
    let bar = Progress::new("check", (clean.len() + Injected::ALL.len()) as u64);
    let mut done = 0;
    let mut step = |what: &str| {
        done += 1;
        bar.show(done, what);
    };
    let mut all: Vec<Trial> = Vec::new();
    for (name, session) in &clean {
        if let Some(folder) = &write {
            put(&folder.join("clean").join(name.replace([' ', '/'], "_")), session, name)?;
        }
        let trial = Trial::clean(session);
        if !trial.right {
            let said: Vec<&str> = trial.beside.iter().map(|fault| fault.key()).collect();
            println!("false alarm, {name}: {}", said.join(", "));
        }
        all.push(trial);
        step("clean sessions");
    }
    // Sessions with a cause are there for false alarms alone.
    let whole: Vec<&(String, Clean)> = clean.iter().filter(|(name, _)| !name.starts_with("causes")).collect();
    for fault in Injected::ALL {
        let tried = |k: u64| {
            let number = seed + k;
            let fitting: Vec<_> = whole.iter().filter(|(_, session)| fault.fits(session)).collect();
            let (name, session) = fitting.get(number as usize % fitting.len().max(1))?;
            let trial = Trial::with(fault, session, number)?;
            let written = write.as_ref().map_or(Ok(()), |folder| {
                let folder = folder.join(format!("{fault:?}")).join(number.to_string());
                inject(fault, session, number).map_or(Ok(()), |damaged| put(&folder, &damaged, name))
            });
            Some(written.map(|()| (number, trial)))
        };
        let found: Vec<(u64, Trial)> = (0..trials).into_par_iter().filter_map(tried).collect::<anyhow::Result<_>>()?;
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

/// Writes a session for programs that know nothing of this one: cell.toml, session.json and the rows of each series as f64, little
/// endian: stamp [ns] and q, dq, tau as far as there are any, of an object stamp, position and orientation (w, x, y, z).
fn put(folder: &Path, session: &Clean, clean: &str) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut cell = session.cell.at_home_anywhere();
    cell.clips.clear();
    let mut clips = Vec::new();
    for (number, (_, clip)) in session.clips.iter().enumerate() {
        let stem = format!("clip_{number:02}");
        let object = clip.object.stamps_ns.iter().zip(&clip.object.poses);
        let object = object.map(|(stamp, pose)| [&[*stamp as f64], &pose.position()[..], &pose.wxyz()].concat());
        for (series, rows) in
            [("measured", rows(&clip.measured)), ("desired", rows(&clip.desired)), ("object", object.collect())]
        {
            let bytes: Vec<u8> = rows.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
            output::write(&folder.join(format!("{stem}.{series}.f64")), bytes)?;
        }
        let blocks = |series: &JointSeries| json!({ "dof": series.dof, "dq": !series.dq.is_empty(), "tau": !series.tau.is_empty() });
        clips.push(json!({
            "stem": stem,
            "joints": clip.joint_names,
            "measured": blocks(&clip.measured),
            "desired": blocks(&clip.desired),
            "mended": clip.warnings,
        }));
        cell.clips.push(ClipEntry { file: format!("{stem}.mcap").into(), kind: clip.kind });
    }
    let said = json!({ "clean": clean, "clips": clips });
    output::write(&folder.join("session.json"), said.to_string())?;
    Ok(output::write(&folder.join("cell.toml"), cell.to_toml())?)
}

fn rows(series: &JointSeries) -> Vec<Vec<f64>> {
    let row = |i: usize| {
        let more = [series.dq_row(i), series.tau_row(i)].into_iter().flatten();
        [&[series.stamps_ns[i] as f64], series.q_row(i)].into_iter().chain(more).flatten().copied().collect()
    };
    (0..series.len()).map(row).collect()
}
