//! The verb `capture excitation`: for each clip plan, record, play, judge, enter into the session.

use super::body::Body;
use super::limits::{self, first_excess};
use super::link::Link;
use super::plan::{Plan, RATE, Request, plan};
use super::quality::{Quality, Verdict, Watch};
use super::recorder::{Recorded, Recorder};
use super::recovery::Recovery;
use super::session::Session;
use super::stream::{Motion, Outcome, play};
use super::task::{Summary, Task, cause};
use super::transit;
use crate::interrupt::Interrupt;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::console;
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;
use shared_mem::progress::Progress;
use std::path::{Path, PathBuf};
use twin::arm::JointLimits;

/// Flange and tool stay this far above table and object [m]: about twice what a loosely tuned arm strays.
const CLEARANCE: f64 = 0.05;
/// Share of a transit's usual speed on the way back after a reflex.
const BACK_PACE: f64 = 0.3;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// What every capture is asked for.
    pub task: Task,
    /// Length of a clip's motion [s].
    pub duration: f64,
    /// Largest excursion of each joint [rad].
    pub amplitude: f64,
    /// Seed of the first clip; the others count on from it by their number in the session.
    pub seed: u64,
}

/// One clip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipSummary {
    /// File, relative to the session.
    pub file: PathBuf,
    /// `true`: entered into cell.toml. A clip that is not stays on disk.
    pub kept: bool,
    /// Why not.
    pub why: Option<String>,
    /// `true`: the user paused it, so another takes its place.
    pub paused: bool,
    /// `true`: the robot stopped itself, so another takes its place.
    pub reflex: bool,
    /// Largest excursion of each joint [rad].
    pub amplitude: Vec<f64>,
    /// What was seen on the way.
    #[serde(flatten)]
    pub quality: Quality,
    /// Messages in the file.
    pub messages: u64,
    /// Size of the file [bytes].
    pub bytes: u64,
}

/// Captures clips until all are there or the user ends it. `note` is shown beside the progress bar.
///
/// # Errors
/// One line with what happened and what to do; clips that were complete before are in the session.
pub fn capture(
    options: &Options,
    interrupt: &Interrupt,
    note: &mut dyn FnMut() -> String,
) -> anyhow::Result<Summary<ClipSummary>> {
    let task = &options.task;
    let cell = Cell::read(&task.cell)?;
    let body = Body::of(&cell)?;
    let session = Session::open(&task.out, &cell)?;
    let mut link = Link::open(task.domain.as_deref())?;
    let mut bridge = task.bridge(&mut link, interrupt)?;
    let (limits, floor, recovery) = (limits::of(&cell, &body), floor(&cell), Recovery::new(options.task.recover));
    let mut desk = Desk { options, limits, body, floor, session, interrupt, recovery };
    let mut clips = Vec::new();
    loop {
        interrupt.wait_out_pause();
        let count = 1 + clips.iter().filter(|clip: &&ClipSummary| !clip.paused && !clip.reflex).count();
        if interrupt.asked() || count > task.clips as usize {
            break;
        }
        let clip = match desk.clip(&mut link, &format!("clip {count} of {}", task.clips), note) {
            Ok(clip) => clip,
            Err(error) => return Err(cause(error, &mut bridge)),
        };
        clips.extend(clip);
    }
    let own_bridge = bridge.is_own();
    bridge.stop()?;
    let session = desk.session.folder().to_owned();
    Ok(Summary { session, clips, interrupted: interrupt.asked(), own_bridge })
}

/// Lowest height for flange and tool: above the table, and above the object that may stand on it [m].
fn floor(cell: &Cell) -> f64 {
    let Some(table) = &cell.table else { return f64::NEG_INFINITY };
    let object = cell.object.as_ref().and_then(|object| object.size).map_or(0.0, |size| size[2]);
    table.height + object + CLEARANCE
}

/// Everything that stays the same from clip to clip.
struct Desk<'a> {
    options: &'a Options,
    limits: Vec<JointLimits>,
    body: Body,
    floor: f64,
    session: Session,
    interrupt: &'a Interrupt,
    recovery: Recovery,
}

impl Desk<'_> {
    /// One clip. `None`: interrupted before anything was recorded.
    fn clip(
        &mut self,
        link: &mut Link,
        title: &str,
        note: &mut dyn FnMut() -> String,
    ) -> anyhow::Result<Option<ClipSummary>> {
        let (number, file) = self.session.next_clip()?;
        let plan = self.plan(link, number)?;
        let path = self.session.folder().join(&file);
        let task = &self.options.task;
        let recorder = Recorder::start(&path, &task.cell, task.domain.as_deref(), self.interrupt)?;
        if self.interrupt.halted() {
            recorder.finish()?;
            return Ok(None);
        }
        let (outcome, quality) =
            self.play(link, &plan, title, note).inspect_err(|_| console::line(kept_unfinished(&path)))?;
        let recorded = recorder.finish()?;
        let why = match (outcome, &recorded.stopped, quality.verdict(plan.peak_speed)) {
            (Outcome::Stopped, ..) => Some("it was ended by the user".to_owned()),
            (Outcome::Paused, ..) => Some("it was paused by the user".to_owned()),
            (Outcome::Reflex, ..) => self.recovery.reason(),
            (Outcome::Done, Some(why), _) => Some(why.clone()),
            (Outcome::Done, None, Verdict::Repeat(why)) => Some(why),
            (Outcome::Done, None, Verdict::Keep) => None,
        };
        if why.is_none() {
            self.session.enter(&file, ClipKind::Excitation)?;
        }
        let [paused, reflex] = [outcome == Outcome::Paused, outcome == Outcome::Reflex];
        let begin = plan.set_points[0].q_d;
        let clip = ClipSummary { paused, reflex, ..summary(file, why, plan, quality, &recorded) };
        console::line(clip.line());
        if self.recovery.settle(link, self.interrupt)? {
            self.go_back(link, &begin)?;
        }
        Ok(Some(clip))
    }

    /// After a reflex: calmly back to where the clip began. Where no way is free, the next clip begins here.
    fn go_back(&mut self, link: &mut Link, begin: &Joints) -> anyhow::Result<()> {
        let from = link.ready_state()?.q_d;
        let way = transit::plan(&from, begin, &self.limits, BACK_PACE).filter(|way| {
            let is_low = |point: &SetPoint| self.body.lowest_point(&point.q_d) < self.floor;
            first_excess(way, &self.limits, Some(&self.body)).is_none() && !way.iter().any(is_low)
        });
        let Some(set_points) = way else {
            console::line("no free way back to where the clip began: the next one begins here");
            return Ok(());
        };
        let motion = Motion { set_points: &set_points, dof: self.limits.len() };
        let outcome = play(link, motion, self.interrupt, |_| {})?;
        self.recovery.note(outcome, link)?;
        self.recovery.settle(link, self.interrupt)?;
        Ok(())
    }

    /// Plans around the pose that the arm is commanded to hold, and says what had to give.
    fn plan(&self, link: &mut Link, number: usize) -> anyhow::Result<Plan> {
        let state = link.ready_arm(self.limits.len())?;
        let Options { amplitude, duration, seed, .. } = *self.options;
        let seed = seed.wrapping_add(number as u64);
        let request = Request { start: state.q_d, amplitude, duration, seed, floor: self.floor };
        let plan = plan(&request, &self.limits, &self.body)?;
        for (joint, bound_by) in plan.bound_by.iter().enumerate() {
            if let Some(quantity) = bound_by {
                let reached = plan.amplitude[joint];
                console::line(format_args!(
                    "  joint {}: {reached:.3} rad instead of {amplitude:.3}, bound by {quantity}",
                    joint + 1
                ));
            }
        }
        Ok(plan)
    }

    fn play(
        &mut self,
        link: &mut Link,
        plan: &Plan,
        title: &str,
        note: &mut dyn FnMut() -> String,
    ) -> anyhow::Result<(Outcome, Quality)> {
        let progress = Progress::new(title, plan.set_points.len() as u64);
        let mut watch = Watch::default();
        let outcome = play(link, plan.motion(), self.interrupt, |state| {
            watch.see(state);
            if state.cycle % (RATE as u64 / 10) == 0 {
                progress.show(u64::from(state.motion_played), &note());
            }
        })?;
        self.recovery.note(outcome, link)?;
        Ok((outcome, watch.quality()))
    }
}

fn kept_unfinished(path: &Path) -> String {
    format!(
        "{}: the motion failed; the file stays as far as it goes, but is not entered into cell.toml",
        path.display()
    )
}

fn summary(file: PathBuf, why: Option<String>, plan: Plan, quality: Quality, recorded: &Recorded) -> ClipSummary {
    let Recorded { messages, bytes, .. } = *recorded;
    ClipSummary {
        file,
        kept: why.is_none(),
        why,
        paused: false,
        reflex: false,
        amplitude: plan.amplitude,
        quality,
        messages,
        bytes,
    }
}

impl ClipSummary {
    /// The clip's quality in a line.
    #[must_use]
    pub fn line(&self) -> String {
        let Quality { lost_packets, peak_speed, tracking_error, .. } = self.quality;
        let verdict = match &self.why {
            None => "keep".to_owned(),
            Some(why) => format!("repeat, because {why}; the file stays, but is not entered into cell.toml"),
        };
        format!(
            "{}: peak speed {peak_speed:.2} rad/s, follows within {:.1} mrad, {lost_packets} packets lost, {:.1} MB: {verdict}",
            self.file.display(),
            1e3 * tracking_error,
            self.bytes as f64 * 1e-6,
        )
    }
}
