//! The verb `capture control-hit-slide`: for each clip find the object, choose a stroke, go there, record it, judge it, enter it
//! into the session, and step back.

use super::body::Body;
use super::limits;
use super::link::Link;
use super::object_watch::{ObjectWatch, PoseQuality};
use super::placing::{BY_HAND, COMES_TO_REST, Placing};
use super::plan::{RATE, peak_speed};
use super::program::{MIDDLE, Next, NoStroke, Program, Wish};
use super::quality::{Quality, Verdict, Watch};
use super::recorded::{self, Repeated};
use super::recorder::Recorder;
use super::recovery::Recovery;
use super::session::Session;
use super::staged::{self, Staged};
use super::stream::{Motion, Outcome, play};
use super::stroke::StrokeError;
use super::task::{Summary, Task, cause};
use super::way::Ways;
use crate::interrupt::Interrupt;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::console;
use shared_mem::msg::motion::SetPoint;
use shared_mem::output;
use shared_mem::progress::Progress;
use std::path::PathBuf;
use twin::arm::JointLimits;
use twin::scene::ObjectModel;

/// The tool travels this far above the object, and no lower than half of it [m].
const ABOVE: f64 = 0.08;
/// Further tries for every clip that is asked for.
const AGAIN: f64 = 0.5;
/// An object that moved less was not hit [m].
const MOVED: f64 = 5e-3;
/// Share of lost poses from which a stroke is better repeated.
const POSES_LOST: f64 = 0.1;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// What every capture is asked for.
    pub task: Task,
    /// What the strokes are for.
    pub series: Series,
    /// How far the tool is turned about its own axis [rad].
    pub turn_tool: f64,
    /// Where to draw the next stroke; the arm then moves nowhere.
    pub preview: Option<PathBuf>,
}

/// What the strokes of a run are for. Clips of the task that are repeated come before all others.
#[derive(Debug, Clone, PartialEq)]
pub enum Series {
    /// From all sides, wherever the object comes to rest.
    Everywhere,
    /// Straight, in so many headings through the same place.
    Headings(usize),
    /// One straight stroke on the object turned by each of these angles [rad].
    Turned(Vec<f64>),
}

/// One clip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipSummary {
    /// File, relative to the session.
    pub file: PathBuf,
    /// What was played, in words.
    pub motion: String,
    /// `true`: entered into cell.toml. A clip that is not stays on disk.
    pub kept: bool,
    /// Why not.
    pub why: Option<String>,
    /// `true`: the user paused it, so another takes its place.
    pub paused: bool,
    /// `true`: the robot stopped itself, so another takes its place.
    pub reflex: bool,
    /// Direction of the stroke [rad].
    pub heading: f64,
    /// Speed of the hit that was commanded [m/s].
    pub speed: f64,
    /// How far the line passed to the left of the centre [m].
    pub offset: f64,
    /// What was seen of the arm.
    #[serde(flatten)]
    pub quality: Quality,
    /// What was seen of the object.
    #[serde(flatten)]
    pub object: PoseQuality,
    /// Messages in the file.
    pub messages: u64,
    /// Size of the file [bytes].
    pub bytes: u64,
}

/// Captures strokes until all are there or the user ends it.
///
/// # Errors
/// One line with what happened and what to do; clips that were complete before are in the session.
pub fn capture(options: &Options, interrupt: &Interrupt) -> anyhow::Result<Summary<ClipSummary>> {
    let task = &options.task;
    let cell = Cell::read(&task.cell)?;
    let body = Body::of(&cell)?;
    let size = size_of(&cell)?;
    let domain = task.domain.as_deref();
    // Before a bridge is started: a clip that cannot be repeated is said at once.
    let repeats = task.repeat.iter().map(|number| recorded::read(&task.out, *number, ClipKind::ControlHitSlide, &body));
    let repeats = repeats.collect::<Result<Vec<_>, _>>()?;
    let session = Session::open(&task.out, &cell)?;
    let mut link = Link::open(domain)?;
    let mut object = ObjectWatch::open(domain)?;
    let mut bridge = task.bridge(&mut link, interrupt)?;
    let limits = limits::of(&cell, &body);
    let recovery = Recovery::new(options.task.recover);
    let placing = Placing { task, cell: &cell, bridge: &mut bridge, interrupt };
    let (body, limits, cell) = (&body, &limits[..], &cell);
    let mut desk = Desk { options, repeats, placing, cell, size, body, limits, session, interrupt, recovery };
    let clips = match desk.clips(&mut link, &mut object) {
        Ok(clips) => clips,
        Err(error) => return Err(cause(error, &mut bridge)),
    };
    let session = desk.session.folder().to_owned();
    let own_bridge = bridge.is_own();
    bridge.stop()?;
    Ok(Summary { session, clips, interrupted: interrupt.asked(), own_bridge })
}

fn size_of(cell: &Cell) -> anyhow::Result<[f64; 3]> {
    anyhow::ensure!(
        cell.tool.is_some() && cell.table.is_some(),
        "cell.toml has no [tool] or no [table]; a stroke needs both: describe them, then start again"
    );
    let model = ObjectModel::new(cell, None)?;
    let model =
        model.ok_or_else(|| anyhow::anyhow!("cell.toml has no [object] to strike; describe it, then start again"))?;
    Ok(<[f64; 3]>::from(model.shape.half_extents()).map(|half| 2.0 * half))
}

/// Everything that stays the same from clip to clip.
struct Desk<'a> {
    options: &'a Options,
    repeats: Vec<Repeated>,
    placing: Placing<'a>,
    cell: &'a Cell,
    size: [f64; 3],
    body: &'a Body,
    limits: &'a [JointLimits],
    session: Session,
    interrupt: &'a Interrupt,
    recovery: Recovery,
}

impl<'a> Desk<'a> {
    fn clips(&mut self, link: &mut Link, object: &mut ObjectWatch) -> anyhow::Result<Vec<ClipSummary>> {
        let mut clips: Vec<ClipSummary> = Vec::new();
        let wanted = self.options.task.clips as usize;
        let tries = wanted + (AGAIN * wanted as f64).ceil() as usize;
        let staged = self.staged(object)?;
        while clips.iter().filter(|clip| !clip.paused).count() < tries {
            self.interrupt.wait_out_pause();
            if self.interrupt.asked() {
                break;
            }
            let kept = clips.iter().filter(|clip| clip.kept).count();
            if kept == wanted {
                break;
            }
            let next = match &staged[..] {
                [] => self.next(link, object)?,
                staged => self.prepared(&staged[kept % staged.len()], link, object)?,
            };
            let Some((next, motion)) = next else { break };
            if let Some(file) = &self.options.preview {
                output::write(file, super::picture::picture(&next, self.size))?;
                console::line(format_args!("{}: the next stroke; the arm was not moved", file.display()));
                break;
            }
            let title = format!("clip {} of {wanted}", kept + 1);
            let clip = self.clip(link, object, (&next, motion), &title)?;
            let is_under_way = self.recovery.settle(link, self.interrupt)? || clip.is_some();
            clips.extend(clip);
            self.interrupt.wait_out_pause();
            if is_under_way && !self.interrupt.asked() {
                self.step_back(link, object, next.stroke.heading, &title)?;
                self.recovery.settle(link, self.interrupt)?;
            }
        }
        Ok(clips)
    }

    fn program(&self) -> Program<'a> {
        let (pace, turn) = (self.options.task.speed, self.options.turn_tool);
        Program { pace, turn, ..Program::of(self.cell, self.size, self.body, self.limits) }
    }

    /// The strokes for which the object has to stand somewhere; none where every stroke goes out from where it lies.
    fn staged(&self, object: &mut ObjectWatch) -> anyhow::Result<Vec<Staged>> {
        let program = self.program();
        if !self.repeats.is_empty() {
            return self.repeats.iter().map(|clip| staged::again(&program, clip)).collect();
        }
        if self.options.series == Series::Everywhere {
            return Ok(Vec::new());
        }
        let Some(standing) = object.standing(COMES_TO_REST, self.interrupt)? else { return Ok(Vec::new()) };
        if let Series::Turned(turns) = &self.options.series {
            return Ok(staged::turned_objects(&program, turns, &standing, &self.ways())?);
        }
        let Series::Headings(count) = self.options.series else { return Ok(Vec::new()) };
        let (slides, refused) = staged::headings(&program, count, MIDDLE, standing.yaw, &self.ways());
        refused.iter().for_each(console::line);
        anyhow::ensure!(
            !slides.is_empty(),
            "no slide can be done through the middle of the area; try a smaller --speed"
        );
        Ok(slides)
    }

    /// A stroke for which the object has to stand somewhere, once it does. `None`: the user gave up.
    fn prepared(
        &mut self,
        staged: &Staged,
        link: &mut Link,
        object: &mut ObjectWatch,
    ) -> anyhow::Result<Option<(Next, String)>> {
        link.ready_arm(self.limits.len())?;
        let Some(stands) = self.placing.place(&staged.standing, link, object)? else { return Ok(None) };
        let (stroke, plan) = (staged.stroke, staged.plan.clone());
        let approach = self.ways().over(&link.ready_state()?.q_d, &plan.set_points[0].q_d)?;
        let rest = self.program().rest(&stroke);
        let words = format!("{}{}", staged.words, self.changes());
        Ok(Some((Next { stroke, plan, approach, object: stands, rest }, words)))
    }

    /// What is unlike in all strokes of this run, in words.
    fn changes(&self) -> String {
        let turn = self.options.turn_tool.to_degrees();
        let turned = if turn == 0.0 { String::new() } else { format!(", the tool turned by {turn:.0} degrees") };
        format!("{}{turned}", self.options.task.pace())
    }

    /// The stroke for the next clip, once the object stands still in reach. `None`: the user gave up.
    fn next(&self, link: &mut Link, object: &mut ObjectWatch) -> anyhow::Result<Option<(Next, String)>> {
        let program = self.program();
        let (number, _) = self.session.next_clip()?;
        link.ready_arm(self.limits.len())?;
        let asked = std::time::Instant::now();
        let mut told = false;
        loop {
            let Some(standing) = object.standing(COMES_TO_REST, self.interrupt)? else { return Ok(None) };
            let (wish, ways, from) = (Wish::of_clip(number), self.ways(), link.ready_state()?.q_d);
            match program.next(&wish, &standing, &ways, &from) {
                Ok(next) => return Ok(Some((next, format!("a stroke{}", self.changes())))),
                Err(NoStroke::Refused(error)) if program.turn != 0.0 => {
                    let turn = program.turn.to_degrees();
                    anyhow::bail!(
                        "no stroke with the tool turned by {turn:.0} degrees: {error}; or give a smaller --turn-tool"
                    );
                }
                Err(NoStroke::Refused(StrokeError::Limit(excess))) if program.pace != 1.0 => {
                    let slower =
                        |pace: &f64| Program { pace: *pace, ..program }.next(&wish, &standing, &ways, &from).is_ok();
                    let tries = (1..12).map(|k| program.pace * 0.9_f64.powi(k));
                    let largest = tries.into_iter().find(|pace| slower(pace)).map_or_else(String::new, |pace| {
                        format!("; the largest factor that fits is about {pace:.2}: give --speed {:.2}", pace - 5e-3)
                    });
                    anyhow::bail!("no stroke at {} times its speed keeps the limits ({excess}){largest}", program.pace);
                }
                Err(error) if asked.elapsed() > BY_HAND => return Err(error.into()),
                Err(error) if !told => {
                    console::line(format_args!("{error} (waiting {} s; Ctrl-C ends)", BY_HAND.as_secs()));
                    told = true;
                }
                Err(_) => {}
            }
        }
    }

    /// One clip. `None`: ended, paused or stopped by the robot before anything was recorded.
    fn clip(
        &mut self,
        link: &mut Link,
        object: &mut ObjectWatch,
        (next, motion): (&Next, String),
        title: &str,
    ) -> anyhow::Result<Option<ClipSummary>> {
        let points = &next.plan.set_points;
        if self.play(link, object, &next.approach, &format!("{title}: approach"))?.0 != Outcome::Done {
            return Ok(None);
        }
        let Some(_) = object.standing(COMES_TO_REST, self.interrupt)? else { return Ok(None) };
        let (_, file) = self.session.next_clip()?;
        let path = self.session.folder().join(&file);
        let task = &self.options.task;
        let recorder = Recorder::start(&path, &task.cell, task.domain.as_deref(), self.interrupt)?;
        object.begin();
        link.announce(&format!("{}: {motion}", file.display()))?;
        let (outcome, quality) = self.play(link, object, points, &format!("{title}: stroke")).inspect_err(|_| {
            console::line(format_args!(
                "{}: the stroke failed; the file stays as far as it goes, but is not entered",
                path.display()
            ));
        })?;
        let rested = object.standing(COMES_TO_REST, self.interrupt);
        let seen = object.quality();
        let recorded = recorder.finish()?;
        let why = match (outcome, &recorded.stopped, quality.verdict(peak_speed(points)), rested) {
            (Outcome::Stopped, ..) | (_, _, _, Ok(None)) => Some("it was ended by the user".to_owned()),
            (Outcome::Paused, ..) => Some("it was paused by the user".to_owned()),
            (Outcome::Reflex, ..) => self.recovery.reason(),
            (_, Some(why), ..) => Some(why.clone()),
            (_, _, Verdict::Repeat(why), _) => Some(why),
            (_, _, _, Err(error)) => Some(error.to_string()),
            (..) => unfit(&seen),
        };
        if why.is_none() {
            self.session.enter(&file, ClipKind::ControlHitSlide)?;
        }
        let clip = ClipSummary {
            file,
            motion,
            kept: why.is_none(),
            why,
            paused: outcome == Outcome::Paused,
            reflex: outcome == Outcome::Reflex,
            heading: next.stroke.heading,
            speed: next.stroke.speed,
            offset: next.stroke.offset,
            quality,
            object: seen,
            messages: recorded.messages,
            bytes: recorded.bytes,
        };
        console::line(clip.line());
        Ok(Some(clip))
    }

    /// Away from what was struck, from wherever the stroke ended.
    fn step_back(
        &mut self,
        link: &mut Link,
        object: &mut ObjectWatch,
        heading: f64,
        title: &str,
    ) -> anyhow::Result<()> {
        let away = self.ways().away(&link.ready_state()?.q_d, heading)?;
        self.play(link, object, &away, &format!("{title}: retreat")).map(drop)
    }

    fn ways(&self) -> Ways<'_> {
        let top = self.cell.table.as_ref().map_or(0.0, |table| table.height) + self.size[2];
        Ways { body: self.body, limits: self.limits, height: top + ABOVE, floor: top + 0.5 * ABOVE }
    }

    fn play(
        &mut self,
        link: &mut Link,
        object: &mut ObjectWatch,
        set_points: &[SetPoint],
        title: &str,
    ) -> anyhow::Result<(Outcome, Quality)> {
        let progress = Progress::new(title, set_points.len() as u64);
        let mut watch = Watch::default();
        let mut looked = Ok(());
        let motion = Motion { set_points, dof: self.limits.len() };
        let outcome = play(link, motion, self.interrupt, |state| {
            watch.see(state);
            if state.cycle % (RATE as u64 / 20) == 0 {
                progress.show(u64::from(state.motion_played), "");
                looked = object.look();
            }
        })?;
        looked?;
        self.recovery.note(outcome, link)?;
        Ok((outcome, watch.quality()))
    }
}

/// Why the object's poses make a clip useless, if they do.
fn unfit(seen: &PoseQuality) -> Option<String> {
    let lost = seen.lost_poses as f64 / (seen.poses + seen.lost_poses).max(1) as f64;
    if seen.moved < MOVED {
        return Some(format!("the object moved by {:.1} mm only: it was not hit", 1e3 * seen.moved));
    }
    (lost > POSES_LOST).then(|| format!("{:.0} % of the object's poses are lost", 100.0 * lost))
}

impl ClipSummary {
    /// The clip's quality in a line.
    #[must_use]
    pub fn line(&self) -> String {
        let verdict = match &self.why {
            None => "keep".to_owned(),
            Some(why) => format!("repeat, because {why}; the file stays, but is not entered into cell.toml"),
        };
        format!(
            "{}: {}, towards {:.0}° at {:.2} m/s, the object moved {:.0} mm and turned {:.0}°, {} packets and {} poses lost, \
             {:.1} MB: {verdict}",
            self.file.display(),
            self.motion,
            self.heading.to_degrees(),
            self.speed,
            1e3 * self.object.moved,
            self.object.turned.to_degrees(),
            self.quality.lost_packets,
            self.object.lost_poses,
            self.bytes as f64 * 1e-6,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_that_hit_nothing_or_lost_the_object_is_to_be_repeated() {
        let seen = PoseQuality { poses: 100, lost_poses: 2, moved: 0.12, turned: 0.1 };
        assert_eq!(unfit(&seen), None);
        assert!(unfit(&PoseQuality { moved: 1e-3, ..seen }).is_some_and(|why| why.contains("not hit")));
        assert!(unfit(&PoseQuality { lost_poses: 20, ..seen }).is_some_and(|why| why.contains("17 %")));
    }
}
