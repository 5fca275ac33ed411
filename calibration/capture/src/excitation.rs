//! The verb `capture excitation`: for each clip plan, record, play, judge, enter into the session.

use super::body::Body;
use super::limits::{self, first_excess};
use super::link::Link;
use super::plan::{self, Plan, plan};
use super::quality::{Quality, Verdict, Watch};
use super::rate::RATE;
use super::recorder::{Recorded, Recorder};
use super::recovery::Recovery;
use super::request::{Kind, Request};
use super::session::Session;
use super::stream::{Motion, Outcome, play};
use super::task::{Summary, Task, cause};
use super::{pace, recorded, transit};
use serde::Serialize;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::console;
use shared_mem::interrupt::Interrupt;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::progress::Progress;
use std::path::{Path, PathBuf};
use twin::arm::JointLimits;
use twin::scene::tallest;

/// Flange and tool stay this far above table and object [m]: about twice the tracking error of a loosely tuned arm.
const CLEARANCE: f64 = 0.05;
/// Share of a transit's usual speed on the way back after a reflex.
const BACK_PACE: f64 = 0.3;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// What every capture is asked for.
    pub task: Task,
    /// What kind of motion.
    pub kind: Kind,
    /// Joints that move, from 0; empty: all.
    pub joints: Vec<usize>,
    /// Length of a clip's motion before its speed is changed [s].
    pub duration: f64,
    /// Largest excursion of each joint [rad].
    pub amplitude: f64,
    /// Seed of the first clip; the others count on from it by their number in the session.
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipSummary {
    /// File, relative to the session.
    pub file: PathBuf,
    /// What was played, in words.
    pub motion: String,
    /// `true`: entered into cell.toml. A clip that is not stays on disk.
    pub kept: bool,
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
    let moving = moving(&options.joints, body.model().dof())?;
    // Before a bridge is started: a clip that cannot be repeated is said at once.
    let repeats =
        task.repeat.iter().map(|number| recorded::read(&task.out, *number, (ClipKind::Excitation, None), &body));
    let repeats = repeats.collect::<Result<Vec<_>, _>>()?;
    let session = Session::open(&task.out, &cell, &task.cell)?;
    let mut link = Link::open(task.domain.as_deref())?;
    let mut bridge = task.bridge(&mut link, interrupt)?;
    let (limits, floor, recovery) = (limits::of(&cell, &body), floor(&cell)?, Recovery::new(options.task.recover));
    let mut context = CaptureContext { options, moving, repeats, limits, body, floor, session, interrupt, recovery };
    let mut clips = Vec::new();
    loop {
        interrupt.wait_out_pause();
        let count = 1 + clips.iter().filter(|clip: &&ClipSummary| !clip.paused && !clip.reflex).count();
        if interrupt.asked() || count > task.clips as usize {
            break;
        }
        let clip = match context.clip(&mut link, count - 1, note) {
            Ok(clip) => clip,
            Err(error) => return Err(cause(error, &mut bridge)),
        };
        clips.extend(clip);
    }
    let (own_bridge, origin) = (bridge.is_own(), bridge.origin().cloned());
    bridge.stop()?;
    let session = context.session.folder().to_owned();
    Ok(Summary { session, clips, interrupted: interrupt.asked(), own_bridge, origin })
}

/// Which joints move.
fn moving(joints: &[usize], dof: usize) -> anyhow::Result<[bool; MAX_JOINTS]> {
    if let Some(joint) = joints.iter().find(|joint| **joint >= dof) {
        anyhow::bail!("the arm has joints 1 to {dof}, not {}; give others with --joints", joint + 1);
    }
    Ok(std::array::from_fn(|joint| joint < dof && (joints.is_empty() || joints.contains(&joint))))
}

/// Lowest height for flange and tool: above the table, and above the highest of the objects that may stand on it, wherever [m].
pub fn floor(cell: &Cell) -> anyhow::Result<f64> {
    let Some(table) = &cell.table else { return Ok(f64::NEG_INFINITY) };
    Ok(table.height + tallest(cell)? + CLEARANCE)
}

/// Everything that stays the same from clip to clip.
struct CaptureContext<'a> {
    options: &'a Options,
    moving: [bool; MAX_JOINTS],
    repeats: Vec<recorded::Repeated>,
    limits: Vec<JointLimits>,
    body: Body,
    floor: f64,
    session: Session,
    interrupt: &'a Interrupt,
    recovery: Recovery,
}

impl CaptureContext<'_> {
    /// This run's clip number `count`, from 0. `None`: interrupted before anything was recorded.
    fn clip(
        &mut self,
        link: &mut Link,
        count: usize,
        note: &mut dyn FnMut() -> String,
    ) -> anyhow::Result<Option<ClipSummary>> {
        let (number, file) = self.session.next_clip()?;
        let title = &format!("clip {} of {}", count + 1, self.options.task.clips);
        let plan = match self.options.task.repeated(count) {
            None => self.plan(link, number)?,
            Some(_) => {
                let plan = self.again(count)?;
                if !self.go_to_begin(link, &plan)? {
                    return Ok(None);
                }
                plan
            }
        };
        let motion = self.words(count);
        let path = self.session.folder().join(&file);
        let task = &self.options.task;
        let recorder = Recorder::start(&path, task.recording(), self.interrupt)?;
        if self.interrupt.halted() {
            recorder.finish()?;
            return Ok(None);
        }
        link.announce(&format!("{}: {motion}", file.display()))?;
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
        let clip = ClipSummary { motion, paused, reflex, ..summary(file, why, plan, quality, &recorded) };
        console::line(clip.line());
        if self.recovery.settle(link, self.interrupt)? {
            self.go_back(link, &begin)?;
        }
        Ok(Some(clip))
    }

    /// What is played, in words.
    fn words(&self, count: usize) -> String {
        let Options { task, kind, joints, .. } = self.options;
        let pace = task.pace();
        if let Some(number) = task.repeated(count) {
            return format!("clip {number} again{pace}");
        }
        let numbers: Vec<String> = joints.iter().map(|joint| (joint + 1).to_string()).collect();
        let of = if numbers.is_empty() { String::new() } else { format!(" of joints {}", numbers.join(", ")) };
        format!("{kind}{of}{pace}")
    }

    /// After a reflex: calmly back to where the clip began. Where no way is free, the next clip begins here.
    fn go_back(&mut self, link: &mut Link, begin: &Joints) -> anyhow::Result<()> {
        let Some(set_points) = self.way(&link.ready_state()?.q_d, begin, BACK_PACE) else {
            console::line("no free way back to where the clip began: the next one begins here");
            return Ok(());
        };
        self.travel(link, &set_points)?;
        self.recovery.settle(link, self.interrupt)?;
        Ok(())
    }

    /// Calmly to where a clip that is repeated begins. `false`: ended, paused or stopped by the robot on the way.
    fn go_to_begin(&mut self, link: &mut Link, plan: &Plan) -> anyhow::Result<bool> {
        let (from, begin) = (link.ready_arm(self.limits.len())?.q_d, plan.set_points[0].q_d);
        if from == begin {
            return Ok(true);
        }
        let Some(set_points) = self.way(&from, &begin, 1.0) else {
            anyhow::bail!(
                "no free way from where the arm stands to where the clip begins; move it near there, then start again"
            );
        };
        let outcome = self.travel(link, &set_points)?;
        self.recovery.settle(link, self.interrupt)?;
        Ok(outcome == Outcome::Done)
    }

    /// From rest to rest, above the floor and inside every limit.
    fn way(&self, from: &Joints, to: &Joints, pace: f64) -> Option<Vec<SetPoint>> {
        transit::plan(from, to, &self.limits, pace)
            .filter(|way| first_excess(way, &self.limits, Some(&self.body)).is_none() && self.lowest(way) >= self.floor)
    }

    /// Lowest point of flange and tool on a way [m].
    fn lowest(&self, way: &[SetPoint]) -> f64 {
        way.iter().map(|point| self.body.lowest_point(&point.q_d)).fold(f64::INFINITY, f64::min)
    }

    fn travel(&mut self, link: &mut Link, set_points: &[SetPoint]) -> anyhow::Result<Outcome> {
        let motion = Motion { set_points, dof: self.limits.len() };
        let outcome = play(link, motion, self.interrupt, |_| {})?;
        self.recovery.note(outcome, link)?;
        Ok(outcome)
    }

    /// The clip that is repeated as this run's clip number `count`, at the speed asked for.
    fn again(&self, count: usize) -> anyhow::Result<Plan> {
        let points = &self.repeats[count % self.repeats.len()].set_points;
        let set_points = pace::paced(points, self.options.task.speed, &self.limits, &self.body)?;
        let (lowest, floor) = (self.lowest(&set_points), self.floor);
        anyhow::ensure!(
            lowest >= floor,
            "the clip leads the tool down to {lowest:.3} m, below the {floor:.3} m kept free above table and objects; repeat another clip"
        );
        let dof = self.limits.len();
        let begin = set_points[0].q_d;
        let reach = |joint: usize| set_points.iter().map(|p| (p.q_d[joint] - begin[joint]).abs()).fold(0.0, f64::max);
        let amplitude = (0..dof).map(reach).collect();
        Ok(Plan { peak_speed: plan::peak_speed(&set_points), dof, amplitude, bound_by: vec![None; dof], set_points })
    }

    /// Plans around the pose that the arm is commanded to hold, and says what had to give.
    fn plan(&self, link: &mut Link, number: usize) -> anyhow::Result<Plan> {
        let state = link.ready_arm(self.limits.len())?;
        let Options { kind, amplitude, duration, seed, .. } = *self.options;
        let (seed, moving) = (seed.wrapping_add(number as u64), self.moving);
        let request = Request { start: state.q_d, kind, moving, amplitude, duration, seed, floor: self.floor };
        let mut plan = plan(&request, &self.limits, &self.body)?;
        let speed = self.options.task.speed;
        plan.set_points = pace::paced(&plan.set_points, speed, &self.limits, &self.body)?;
        plan.peak_speed *= speed;
        for (joint, bound_by) in plan.bound_by.iter().enumerate() {
            if let Some(quantity) = bound_by {
                let reached = plan.amplitude[joint];
                console::line(format_args!("  joint {}: {reached:.3} rad at most, bound by {quantity}", joint + 1));
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
        motion: String::new(),
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
    pub fn line(&self) -> String {
        let Quality { lost_packets, peak_speed, tracking_error, .. } = self.quality;
        let verdict = match &self.why {
            None => "keep".to_owned(),
            Some(why) => format!("repeat, because {why}; the file stays, but is not entered into cell.toml"),
        };
        let seen = match (peak_speed, tracking_error) {
            (Some(speed), Some(error)) => {
                format!("peak speed {speed:.2} rad/s, follows within {:.1} mrad", 1e3 * error)
            }
            _ => "no state seen".to_owned(),
        };
        format!(
            "{}: {}, {seen}, {lost_packets} packets lost, {:.1} MB: {verdict}",
            self.file.display(),
            self.motion,
            self.bytes as f64 * 1e-6,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::Object;

    #[test]
    fn an_excitation_stays_above_the_highest_of_all_objects() {
        let text = include_str!("../../../config/fr3_cell.toml");
        let mut cell: Cell = shared_mem::toml_file::parse(text, "fr3_cell.toml".as_ref()).expect("the shipped file");
        let one = cell.objects[0].clone();
        assert_eq!(floor(&cell).expect("a floor"), one.size.map_or(0.0, |size| size[2]) + CLEARANCE);
        let bottle = Object { name: Some("bottle".into()), size: Some([0.07, 0.07, 0.3]), ..one.clone() };
        cell.objects = vec![Object { name: Some("cup".into()), ..one }, bottle];
        let floor = floor(&cell).expect("a floor");
        assert!((floor - 0.35).abs() < 1e-9, "{floor}");
        let (body, limits) = limits::shipped();
        let request = Request {
            start: *body.model().ready(),
            kind: Kind::Multisine,
            moving: [true; MAX_JOINTS],
            amplitude: 0.5,
            duration: 4.0,
            seed: 1,
            floor,
        };
        let plan = plan(&request, &limits, &body).expect("room above");
        let lowest = plan.set_points.iter().map(|point| body.lowest_point(&point.q_d)).fold(f64::INFINITY, f64::min);
        assert!(lowest >= floor, "{lowest}");
        let error = plan::plan(&Request { floor: 0.6, ..request }, &limits, &body).expect_err("below a taller one");
        assert!(error.to_string().contains("height"), "{error}");
    }
}
