//! The verb `capture control-hit-slide`: for each clip find the object, choose a stroke, go there, record it, judge it, enter it
//! into the session, and step back.

use super::body::Body;
use super::limits;
use super::link::Link;
use super::object_watch::ObjectWatch;
use super::obstacle::Obstacle;
use super::placing::{BY_HAND, COMES_TO_REST, Placing};
use super::plan::peak_speed;
use super::program::{MIDDLE, Next, NoStroke, Program, Wish};
use super::quality::{Quality, Verdict, Watch};
use super::rate::RATE;
use super::recorded::{self, Repeated};
use super::recorder::Recorder;
use super::recovery::Recovery;
use super::session::Session;
use super::staged::{self, Staged};
use super::stream::{Motion, Outcome, play};
use super::stroke::StrokeError;
use super::stroke_clip::{ClipSummary, unfit};
use super::task::{Summary, Task, cause};
use super::way::Ways;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::interrupt::Interrupt;
use shared_mem::msg::motion::SetPoint;
use shared_mem::progress::Progress;
use shared_mem::{console, output, typed};
use std::path::PathBuf;
use twin::arm::JointLimits;
use twin::scene::ObjectModel;

/// The tool travels this far above the object, and no lower than half of it [m].
const TRAVEL_CLEARANCE: f64 = 0.08;
/// Further tries for every clip that is asked for.
const EXTRA_TRIES_SHARE: f64 = 0.5;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// What every capture is asked for.
    pub task: Task,
    /// Name of the object that is hit; needed where cell.toml has several.
    pub object: Option<String>,
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

/// Captures strokes until all are there or the user ends it.
///
/// # Errors
/// One line with what happened and what to do; clips that were complete before are in the session.
pub fn capture(options: &Options, interrupt: &Interrupt) -> anyhow::Result<Summary<ClipSummary>> {
    let task = &options.task;
    let mut cell = Cell::read(&task.cell)?;
    choose(&mut cell, options)?;
    let body = Body::of(&cell)?;
    let size = size_of(&cell)?;
    let domain = task.domain.as_deref();
    // Before a bridge is started: a clip that cannot be repeated is said at once.
    let kind = (ClipKind::ControlHitSlide, cell.object_name());
    let repeats = task.repeat.iter().map(|number| recorded::read(&task.out, *number, kind, &body));
    let repeats = repeats.collect::<Result<Vec<_>, _>>()?;
    let session = Session::open(&task.out, &cell, &task.cell)?;
    let mut link = Link::open(domain)?;
    let mut object = ObjectWatch::open(domain, &cell)?;
    let mut bridge = task.bridge(&mut link, interrupt)?;
    let limits = limits::of(&cell, &body);
    let recovery = Recovery::new(options.task.recover);
    let placing = Placing { task, simulated: Placing::simulated(&cell), bridge: &mut bridge, interrupt };
    let (body, limits, cell) = (&body, &limits[..], &cell);
    let mut context =
        CaptureContext { options, repeats, placing, cell, size, body, limits, session, interrupt, recovery };
    let clips = match context.clips(&mut link, &mut object) {
        Ok(clips) => clips,
        Err(error) => return Err(cause(error, &mut bridge)),
    };
    let session = context.session.folder().to_owned();
    let (own_bridge, origin) = (bridge.is_own(), bridge.origin().cloned());
    bridge.stop()?;
    Ok(Summary { session, clips, interrupted: interrupt.asked(), own_bridge, origin })
}

/// Makes the object that is hit the one in question: the one that is asked for, else the only rigid one.
fn choose(cell: &mut Cell, options: &Options) -> anyhow::Result<()> {
    let rigid = cell.objects.iter().filter(|object| object.urdf.is_none());
    let names: Vec<String> = rigid.filter_map(|object| object.name.clone()).collect();
    let name = match (&options.object, &names[..]) {
        (Some(name), _) => name,
        (None, [only]) => only,
        (None, [first, ..]) => anyhow::bail!(
            "cell.toml has several objects ({}); say which one is hit: `{}`",
            names.join(", "),
            typed::with(&format!("--object {first}"), false)
        ),
        (None, []) => return Ok(()),
    };
    cell.about(name).map_err(anyhow::Error::msg)
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
struct CaptureContext<'a> {
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

impl<'a> CaptureContext<'a> {
    fn clips(&mut self, link: &mut Link, object: &mut ObjectWatch) -> anyhow::Result<Vec<ClipSummary>> {
        let mut clips: Vec<ClipSummary> = Vec::new();
        let wanted = self.options.task.clips as usize;
        let tries = wanted + (EXTRA_TRIES_SHARE * wanted as f64).ceil() as usize;
        let mut staged = self.staged(object)?;
        while clips.iter().filter(|clip| !clip.paused).count() < tries {
            self.interrupt.wait_out_pause();
            if self.interrupt.asked() {
                break;
            }
            let kept = clips.iter().filter(|clip| clip.kept).count();
            if kept == wanted {
                break;
            }
            let next = if staged.is_empty() {
                self.next(link, object)
            } else {
                self.first_clear(&mut staged, kept, link, object)
            };
            let Some((next, motion)) = next? else { break };
            if let Some(file) = &self.options.preview {
                output::write(file, super::picture::picture(&next, self.size, &object.obstacles()))?;
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
        let obstacles = object.obstacles();
        let ways = self.ways(&obstacles);
        if let Series::Turned(turns) = &self.options.series {
            return Ok(staged::turned_objects(&program, turns, &standing, &ways)?);
        }
        let Series::Headings(count) = self.options.series else { return Ok(Vec::new()) };
        let (slides, refused) = staged::headings(&program, count, MIDDLE, standing.yaw, &ways);
        refused.iter().for_each(|(towards, error)| console::line(format_args!("no slide {towards}: {error}")));
        if let (true, Some(blocked)) = (slides.is_empty(), NoStroke::least(refused.into_iter().map(|(_, error)| error)))
        {
            return Err(NoStroke::Blocked(blocked).into());
        }
        anyhow::ensure!(
            !slides.is_empty(),
            "no slide can be done through the middle of the area; try a smaller --speed"
        );
        Ok(slides)
    }

    /// Of strokes for which the object has to stand somewhere the next one that keeps clear of other objects; those that do not
    /// are left out. `None`: the user gave up.
    fn first_clear(
        &mut self,
        staged: &mut Vec<Staged>,
        kept: usize,
        link: &mut Link,
        object: &mut ObjectWatch,
    ) -> anyhow::Result<Option<(Next, String)>> {
        loop {
            let number = kept % staged.len();
            let prepared = self.prepared(&staged[number], link, object);
            let blocked = |error: &anyhow::Error| matches!(error.downcast_ref(), Some(NoStroke::Blocked(_)));
            match prepared {
                Err(error) if staged.len() > 1 && blocked(&error) => {
                    let out = staged.remove(number);
                    console::line(format_args!("left out: {}: {error}", out.words));
                }
                done => return done,
            }
        }
    }

    /// A stroke for which the object has to stand somewhere, once it does. `None`: the user gave up.
    fn prepared(
        &mut self,
        staged: &Staged,
        link: &mut Link,
        object: &mut ObjectWatch,
    ) -> anyhow::Result<Option<(Next, String)>> {
        link.ready_arm(self.limits.len())?;
        let (stroke, plan, program) = (staged.stroke, staged.plan.clone(), self.program());
        let Some(_) = object.standing(COMES_TO_REST, self.interrupt)? else { return Ok(None) };
        // What is left out anyway is not worth putting the object there.
        program.check_clear(&stroke, &plan, &self.ways(&object.obstacles()))?;
        let Some(stands) = self.placing.place(&staged.standing, link, object)? else { return Ok(None) };
        let obstacles = object.obstacles();
        let ways = self.ways(&obstacles);
        program.check_clear(&stroke, &plan, &ways)?;
        let approach = ways.over(&link.ready_state()?.q_d, &plan.set_points[0].q_d).map_err(NoStroke::from)?;
        let rest = program.rest(&stroke);
        let words = format!("{}{}", staged.words, self.changes());
        Ok(Some((Next { stroke, plan, approach, object: stands, rest, left_out: None }, words)))
    }

    /// What is unlike in all strokes of this run, in words.
    fn changes(&self) -> String {
        let turn = self.options.turn_tool.to_degrees();
        let turned = if turn == 0.0 { String::new() } else { format!(", the tool turned by {turn:.0} degrees") };
        let on = self.cell.one_of_several().map_or_else(String::new, |name| format!(" on `{name}`"));
        format!("{on}{}{turned}", self.options.task.pace())
    }

    /// The stroke for the next clip, once the object stands still in reach. `None`: the user gave up.
    fn next(&self, link: &mut Link, object: &mut ObjectWatch) -> anyhow::Result<Option<(Next, String)>> {
        let program = self.program();
        let (number, _) = self.session.next_clip()?;
        link.ready_arm(self.limits.len())?;
        let asked = std::time::Instant::now();
        let mut is_said = false;
        loop {
            let Some(standing) = object.standing(COMES_TO_REST, self.interrupt)? else { return Ok(None) };
            let obstacles = object.obstacles();
            let (wish, ways, from) = (Wish::of_clip(number), self.ways(&obstacles), link.ready_state()?.q_d);
            match program.next(&wish, &standing, &ways, &from) {
                Ok(next) => {
                    if let Some((count, heading, blocked)) = &next.left_out {
                        let towards = heading.to_degrees();
                        console::line(format_args!(
                            "{count} left out, the first towards {towards:.0} degrees: {blocked}"
                        ));
                    }
                    return Ok(Some((next, format!("a stroke{}", self.changes()))));
                }
                // In a simulated cell nobody can move it.
                Err(error @ NoStroke::Blocked(_)) if self.placing.simulates() => return Err(error.into()),
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
                Err(error) if !is_said => {
                    console::line(format_args!("{error} (waiting {} s; Ctrl-C ends)", BY_HAND.as_secs()));
                    is_said = true;
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
        object.begin();
        if self.play(link, object, &next.approach, &format!("{title}: approach"))?.0 != Outcome::Done {
            return Ok(None);
        }
        let Some(_) = object.resting(COMES_TO_REST, self.interrupt)? else { return Ok(None) };
        if let Some((name, ..)) = object.also_moved().first() {
            console::line(format_args!("`{name}` moved meanwhile: a stroke is planned anew"));
            return Ok(None);
        }
        let (_, file) = self.session.next_clip()?;
        let path = self.session.folder().join(&file);
        let task = &self.options.task;
        let recorder = Recorder::start(&path, task.recording(), self.interrupt)?;
        object.begin();
        link.announce(&format!("{}: {motion}", file.display()))?;
        let (outcome, quality) = self.play(link, object, points, &format!("{title}: stroke")).inspect_err(|_| {
            console::line(format_args!(
                "{}: the stroke failed; the file stays as far as it goes, but is not entered",
                path.display()
            ));
        })?;
        let rested = object.resting(COMES_TO_REST, self.interrupt);
        let seen = object.quality();
        let recorded = recorder.finish()?;
        let why = match (outcome, &recorded.stopped, quality.verdict(peak_speed(points)), rested) {
            (Outcome::Stopped, ..) | (_, _, _, Ok(None)) => Some("it was ended by the user".to_owned()),
            (Outcome::Paused, ..) => Some("it was paused by the user".to_owned()),
            (Outcome::Reflex, ..) => self.recovery.reason(),
            (_, Some(why), ..) => Some(why.clone()),
            (_, _, Verdict::Repeat(why), _) => Some(why),
            (_, _, _, Err(error)) => Some(error.to_string()),
            (..) => unfit(&seen, &object.also_moved()),
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
        let obstacles = object.obstacles();
        let away = self.ways(&obstacles).away(&link.ready_state()?.q_d, heading)?;
        self.play(link, object, &away, &format!("{title}: retreat")).map(drop)
    }

    fn ways<'b>(&'b self, obstacles: &'b [Obstacle]) -> Ways<'b> {
        let top = self.cell.table.as_ref().map_or(0.0, |table| table.height) + self.size[2];
        Ways {
            body: self.body,
            limits: self.limits,
            height: top + TRAVEL_CLEARANCE,
            floor: top + 0.5 * TRAVEL_CLEARANCE,
            obstacles,
        }
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
