//! The verb `demo`: the whole story on the simulated cell. A robot whose gains nobody was told is shadowed by a twin that
//! believes cell.toml; a session is recorded; replayed with cell.toml and with the truth, it shows what the gap was made of.

mod hidden;
mod replay;
mod stage;

use crate::capture::excitation::{self, Summary};
use crate::interrupt::Interrupt;
use crate::report::Story;
use anyhow::{Context as _, bail};
use replay::{Replay, Trace, replay, trace};
use serde::Serialize;
use serde_json::Value;
use shared_mem::cell::Cell;
use stage::{Answers, Stage, worst};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The cell that ships with the project.
const CELL: &str = include_str!("../../../config/fr3_cell.toml");
/// Length of a clip's motion [s]: one period of the slowest sine.
const DURATION: f64 = 6.0;
/// Excursion of each joint [rad].
const AMPLITUDE: f64 = 0.25;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder to create.
    pub out: PathBuf,
    /// Draws the hidden gains and the motions.
    pub seed: u64,
    /// Clips to record.
    pub clips: u32,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The finding in one sentence.
    pub text: String,
    /// The page.
    pub report: PathBuf,
    /// The recorded session.
    pub session: PathBuf,
    /// The hidden gains.
    pub hidden: PathBuf,
    /// What drew them.
    pub seed: u64,
    /// Clips recorded.
    pub clips: usize,
    /// RMS of twin minus robot.
    pub gap: Gap,
    /// What `rt_bridge run` answered.
    pub bridge: Value,
    /// What `twin shadow` answered.
    pub twin: Value,
    /// Wall-clock time of the whole [s].
    pub seconds: f64,
}

/// RMS of twin minus robot by joint [rad].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// Replayed with the gains of cell.toml.
    pub before: Vec<f64>,
    /// Replayed with the true gains.
    pub after: Vec<f64>,
    /// Largest over one second, live.
    pub live: Vec<f64>,
}

/// Files of one demo.
struct Files {
    out: PathBuf,
    cell: PathBuf,
    hidden: PathBuf,
    session: PathBuf,
}

/// Runs the demo.
///
/// # Errors
/// One line with what happened and what to do, and the last words of a program that failed; no program is left running.
pub fn demo(options: &Options, interrupt: &Interrupt) -> anyhow::Result<Finding> {
    let start = Instant::now();
    let files = prepare(options)?;
    eprintln!("hidden from the twin: gains in {}", files.hidden.display());
    let (captured, answers, live) = record(options, &files, interrupt)?;
    let kept: Vec<&Path> = captured.clips.iter().filter(|c| c.kept).map(|c| c.file.as_path()).collect();
    if interrupt.asked() {
        bail!("ended early; what was recorded stays in {}", files.session.display());
    }
    let Some(first) = kept.first() else {
        bail!("no clip was good enough to keep; run the demo again on a less busy machine");
    };
    eprintln!("replaying with the gains of cell.toml and with the true ones");
    let story = compare(options, &files, &files.session.join(first), live, interrupt)?;
    let report = files.out.join("report.html");
    std::fs::write(&report, story.page()).with_context(|| format!("cannot write {}", report.display()))?;
    Ok(Finding {
        text: story.sentence(),
        report,
        clips: kept.len(),
        session: files.session,
        hidden: files.hidden,
        seed: options.seed,
        gap: Gap { before: story.before, after: story.after, live: story.live },
        bridge: answers.bridge,
        twin: answers.twin,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Creates the folder with what the laboratory knows and what it does not.
fn prepare(options: &Options) -> anyhow::Result<Files> {
    let out = options.out.clone();
    if out.read_dir().is_ok_and(|mut entries| entries.next().is_some()) {
        bail!("{} is not empty; choose another folder with --out, or remove it", out.display());
    }
    std::fs::create_dir_all(&out).with_context(|| format!("cannot create {}", out.display()))?;
    let files =
        Files { cell: out.join("cell.toml"), hidden: out.join("hidden_theta.toml"), session: out.join("session"), out };
    std::fs::write(&files.cell, CELL).with_context(|| format!("cannot write {}", files.cell.display()))?;
    let controller = Cell::read(&files.cell)?.controller.context("the shipped cell has no [controller]")?;
    let hidden = hidden::gains(&controller, options.seed).to_toml();
    std::fs::write(&files.hidden, hidden).with_context(|| format!("cannot write {}", files.hidden.display()))?;
    Ok(files)
}

/// Runs bridge and twin and captures a session through them.
fn record(options: &Options, files: &Files, interrupt: &Interrupt) -> anyhow::Result<(Summary, Answers, Vec<f64>)> {
    let domain = format!("demo-{}", std::process::id());
    eprintln!("starting the simulated robot and its twin as two processes");
    let mut stage = Stage::start(&files.cell, &files.hidden, &domain, interrupt)?;
    let request = excitation::Options {
        cell: files.cell.clone(),
        clips: options.clips,
        out: files.session.clone(),
        arm: None,
        realtime: None,
        duration: DURATION,
        amplitude: AMPLITUDE,
        seed: options.seed,
        domain: Some(domain),
    };
    let captured = match excitation::capture(&request, interrupt, &mut || stage.gap().words()) {
        Ok(captured) => captured,
        // A program that died says more than the silence it leaves.
        Err(error) => return Err(stage.check().err().unwrap_or(error)),
    };
    stage.gap().look()?;
    let (answers, gap) = stage.stop()?;
    let (joint, rms) = worst(gap.largest());
    eprintln!("live, the twin missed joint {} by {:.2} mrad RMS at worst", joint + 1, 1e3 * rms);
    Ok((captured, answers, gap.largest().to_vec()))
}

/// Replays the session under both sets of gains and follows the worst joint through one clip.
fn compare(
    options: &Options,
    files: &Files,
    clip: &Path,
    live: Vec<f64>,
    interrupt: &Interrupt,
) -> anyhow::Result<Story> {
    let session = |truth| -> anyhow::Result<Replay> { replay(&files.session, truth, None, interrupt) };
    let truth = Some(files.hidden.as_path());
    let [before, after] = [session(None)?, session(truth)?].map(|replay| replay.mean.joint_rms_rad);
    let (joint, _) = worst(&before);
    let follow = |name: &str, truth| -> anyhow::Result<Trace> {
        let simulated = files.out.join(name);
        replay(clip, truth, Some(&simulated), interrupt)?;
        trace(&simulated, joint)
    };
    let by_cell = follow("twin_cell.mcap", None)?;
    let by_truth = follow("twin_true.mcap", truth)?;
    Ok(Story {
        setting: format!(
            "A simulated FR3 moved all joints at once through {} clips of {DURATION} s. Its stiffness and damping had been drawn within 20 % of cell.toml; the twin was not told.",
            options.clips
        ),
        origin: format!("calibration demo --seed {} --clips {}", options.seed, options.clips),
        before,
        after,
        live,
        joint,
        real: by_cell.real,
        twin: by_cell.twin,
        error_before: by_cell.error,
        error_after: by_truth.error,
    })
}

impl Finding {
    /// The finding as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let mut lines = vec!["joint   cell.toml   true gains   [mrad RMS]".to_owned()];
        for (joint, (before, after)) in self.gap.before.iter().zip(&self.gap.after).enumerate() {
            lines.push(format!("{:>5}   {:>9.3}   {:>10.4}", joint + 1, 1e3 * before, 1e3 * after));
        }
        lines.push(self.text.clone());
        lines.push(format!("report: {}   ({:.0} s)", self.report.display(), self.seconds));
        lines.join("\n")
    }
}
