//! The verb `demo`: the whole story on the simulated cell. A robot with gains that nobody knows and a hidden effect is shadowed by
//! a twin that believes cell.toml; a session is recorded and diagnosed; replayed with cell.toml and with what was found, it
//! shows how far the gap shrinks.

pub mod example;
mod hidden;
mod replay;
mod stage;

use crate::diagnose::{self, Diagnosis, Verdict, diagnose};
use crate::report::{self, Story};
use crate::words::words;
use anyhow::{Context as _, bail};
use capture::excitation::{self, ClipSummary};
use capture::processes::Program;
use capture::request::Kind;
use capture::task::{Summary, Task};
use inference::interrupt::Interrupt;
use replay::{Replay, Trace, replay, trace};
use serde::Serialize;
use serde_json::Value;
use shared_mem::cell::Cell;
use shared_mem::recording::Session;
use shared_mem::theta::{EffectTheta, Theta};
use shared_mem::{console, output};
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
    /// Whether what an earlier demo wrote there is replaced.
    pub force: bool,
    /// Draws the hidden gains, the hidden effect and the motions.
    pub seed: u64,
    /// Clips to record.
    pub clips: u32,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The finding in one sentence.
    pub text: String,
    pub report: PathBuf,
    /// The recorded session.
    pub session: PathBuf,
    /// The hidden gains.
    pub hidden: PathBuf,
    /// The hidden effect.
    pub hidden_effect: PathBuf,
    /// What the diagnosis says.
    pub verdict: Verdict,
    pub diagnosis: PathBuf,
    /// The parameters and effects found.
    pub theta: PathBuf,
    /// What drew them.
    pub seed: u64,
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
    /// Replayed with the parameters and effects found.
    pub after: Vec<f64>,
    /// Largest over one second, live.
    pub live: Vec<f64>,
}

/// Files of one demo.
struct Files {
    out: PathBuf,
    cell: PathBuf,
    hidden: PathBuf,
    hidden_effect: PathBuf,
    session: PathBuf,
    diagnosis: PathBuf,
    theta: PathBuf,
}

/// Runs the demo.
///
/// # Errors
/// One line with what happened and what to do, and the last words of a program that failed; no program is left running.
pub fn demo(options: &Options, interrupt: &Interrupt) -> anyhow::Result<Finding> {
    let start = Instant::now();
    let files = prepare(options)?;
    console::line(format_args!(
        "hidden from the twin: gains in {}, effect in {}",
        files.hidden.display(),
        files.hidden_effect.display()
    ));
    let (captured, answers, live) = record(options, &files, interrupt)?;
    let kept: Vec<&Path> = captured.clips.iter().filter(|c| c.kept).map(|c| c.file.as_path()).collect();
    let stays = || format!("ended early; what was recorded stays in {}", files.session.display());
    if interrupt.asked() {
        bail!(stays());
    }
    let Some(first) = kept.first() else {
        bail!("no clip was good enough to keep; run the demo again on a less busy machine");
    };
    console::line("diagnosing the session");
    let found = examine(options, &files, interrupt);
    if interrupt.asked() {
        bail!(stays());
    }
    let found = found?;
    console::line("replaying with cell.toml and with what was found");
    let outcome = Outcome { effect: hidden::effect(options.seed), found: &found };
    let story = compare(options, &files, &files.session.join(first), (live, &outcome), interrupt)?;
    let report = files.out.join("report.html");
    output::write(&report, story.page())?;
    Ok(Finding {
        text: story.sentence(),
        report,
        clips: kept.len(),
        session: files.session,
        hidden: files.hidden,
        hidden_effect: files.hidden_effect,
        verdict: found.verdict,
        diagnosis: files.diagnosis,
        theta: files.theta,
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
    let is_full = out.read_dir().is_ok_and(|mut entries| entries.next().is_some());
    if is_full && !options.force {
        bail!(
            "{} is not empty; choose another folder with --out, or replace an earlier demo with --force",
            out.display()
        );
    }
    // Before anything is written: whoever builds what is missing calls again with the same folder.
    for program in [Program::Bridge, Program::Twin] {
        program.find()?;
    }
    std::fs::create_dir_all(&out).with_context(|| format!("cannot create {}", out.display()))?;
    if is_full {
        clear(&out)?;
    }
    let files = Files {
        cell: out.join("cell.toml"),
        hidden: out.join("hidden_theta.toml"),
        hidden_effect: out.join("hidden_effect.toml"),
        session: out.join(SESSION),
        diagnosis: out.join("diagnosis.html"),
        theta: out.join("theta.toml"),
        out,
    };
    output::write(&files.cell, CELL)?;
    let controller = Cell::read(&files.cell)?.controller.context("the shipped cell has no [controller]")?;
    let hidden = hidden::gains(&controller, options.seed).to_toml();
    output::write(&files.hidden, hidden)?;
    let effect = Theta { effects: vec![hidden::effect(options.seed)], ..Theta::default() };
    output::write(&files.hidden_effect, effect.to_toml())?;
    Ok(files)
}

/// What a demo writes into its folder: files, and the session.
const FILES: [&str; 8] = [
    "cell.toml",
    "hidden_theta.toml",
    "hidden_effect.toml",
    "diagnosis.html",
    "theta.toml",
    "report.html",
    "twin_cell.mcap",
    "twin_found.mcap",
];
const SESSION: &str = "session";

/// Removes what an earlier demo wrote, and nothing else.
fn clear(out: &Path) -> anyhow::Result<()> {
    let gone = |result: std::io::Result<()>| match result {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    };
    let files = FILES.iter().map(|name| gone(std::fs::remove_file(out.join(name))));
    let session = gone(std::fs::remove_dir_all(out.join(SESSION)));
    files.chain([session]).collect::<std::io::Result<()>>().with_context(|| format!("cannot replace {}", out.display()))
}

/// Diagnoses the session and writes page and parameters.
fn examine(options: &Options, files: &Files, interrupt: &Interrupt) -> anyhow::Result<Diagnosis> {
    let session = Session::open(&files.session)?;
    let found =
        diagnose(&session, &diagnose::Options { seed: options.seed, ..diagnose::Options::default() }, interrupt)?;
    output::write(&files.theta, found.theta.to_toml())?;
    output::write(&files.diagnosis, report::diagnosis::page(&found))?;
    Ok(found)
}

/// What was hidden, and what was found.
struct Outcome<'a> {
    effect: EffectTheta,
    found: &'a Diagnosis,
}

impl Outcome<'_> {
    /// The hidden effect, and the verdict on it, in two sentences.
    fn words(&self) -> [String; 2] {
        let values: Vec<String> = self
            .effect
            .parameters
            .iter()
            .map(|(name, value)| format!("{} {:.4}", words(name), value.as_float().unwrap_or(0.0)))
            .collect();
        let hidden = format!("Hidden was {} ({}).", words(&self.effect.name), values.join(", "));
        [self.found.verdict.text.clone(), hidden]
    }
}

/// Runs bridge and twin and captures a session through them.
fn record(
    options: &Options,
    files: &Files,
    interrupt: &Interrupt,
) -> anyhow::Result<(Summary<ClipSummary>, Answers, Vec<f64>)> {
    let domain = format!("demo-{}", std::process::id());
    console::line("starting the simulated robot and its twin as two processes");
    let mut stage = Stage::start(&files.cell, [&files.hidden, &files.hidden_effect], &domain, interrupt)?;
    let request = excitation::Options {
        task: Task {
            cell: files.cell.clone(),
            clips: options.clips,
            out: files.session.clone(),
            arm: None,
            mix: false,
            realtime: None,
            no_camera: false,
            recover: 0,
            repeat: Vec::new(),
            speed: 1.0,
            domain: Some(domain),
        },
        kind: Kind::Multisine,
        joints: Vec::new(),
        duration: DURATION,
        amplitude: AMPLITUDE,
        seed: options.seed,
    };
    let captured = match excitation::capture(&request, interrupt, &mut || stage.gap().words()) {
        Ok(captured) => captured,
        // A program that died says more than the silence it leaves.
        Err(error) => return Err(stage.check().err().unwrap_or(error)),
    };
    stage.gap().look()?;
    let (answers, gap) = stage.stop()?;
    let (joint, rms) = worst(gap.largest());
    console::line(format_args!("live, the twin missed joint {} by {:.2} mrad RMS at worst", joint + 1, 1e3 * rms));
    Ok((captured, answers, gap.largest().to_vec()))
}

/// Replays the session with cell.toml and with what was found, and follows the worst joint through one clip.
fn compare(
    options: &Options,
    files: &Files,
    clip: &Path,
    (live, outcome): (Vec<f64>, &Outcome<'_>),
    interrupt: &Interrupt,
) -> anyhow::Result<Story> {
    let session = |found| -> anyhow::Result<Replay> { replay(&files.session, found, None, interrupt) };
    let found = Some(files.theta.as_path());
    let [before, after] = [session(None)?, session(found)?].map(|replay| replay.mean.joint_rms_rad);
    let (joint, _) = worst(&before);
    let follow = |name: &str, parameters| -> anyhow::Result<Trace> {
        let simulated = files.out.join(name);
        replay(clip, parameters, Some(&simulated), interrupt)?;
        trace(&simulated, joint)
    };
    let by_cell = follow("twin_cell.mcap", None)?;
    let by_found = follow("twin_found.mcap", found)?;
    let [verdict, hidden] = outcome.words();
    Ok(Story {
        setting: format!(
            "A simulated FR3 moved all joints at once through {} clips of {DURATION} s. Its stiffness and damping had been \
             drawn within 20 % of cell.toml, and it had an effect that its twin does not model; the twin knew neither. {hidden}",
            options.clips
        ),
        verdict,
        origin: format!("calibration demo --seed {} --clips {}", options.seed, options.clips),
        before,
        after,
        live,
        joint,
        real: by_cell.real,
        twin: by_cell.twin,
        error_before: by_cell.error,
        error_after: by_found.error,
    })
}

impl Finding {
    /// The finding as a table for people.
    pub fn table(&self) -> String {
        let mut lines = vec!["joint   cell.toml   as found     [mrad RMS]".to_owned()];
        for (joint, (before, after)) in self.gap.before.iter().zip(&self.gap.after).enumerate() {
            lines.push(format!("{:>5}   {:>9.3}   {:>10.4}", joint + 1, 1e3 * before, 1e3 * after));
        }
        lines.push(self.text.clone());
        lines.push(format!("report: {}   ({:.0} s)", self.report.display(), self.seconds));
        lines.join("\n")
    }
}
