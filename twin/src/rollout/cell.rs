//! One worker for a whole cell: made once, then started, run, stopped and resumed without allocating.

use super::{CellTrace, ContactSpan, Course, ObjectState};
use crate::arm::JointState;
use crate::control::{ArmRollout, CommandTrack, Drive, Reading};
use crate::effects::CameraMemory;
use crate::sim::{SimCell, SimError, SimState};
use shared_mem::cell::Cell;
use shared_mem::ending;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;

/// Arm, tool, object and table of one cell under one set of parameters, somewhere in a clip.
///
/// Order of calls: [`CellRollout::new`] (reads meshes, builds hulls), [`CellRollout::set_parameters`] for every other
/// set, [`CellRollout::start`] or [`CellRollout::resume`], [`CellRollout::run`]. Only the first two allocate.
#[derive(Clone)]
pub struct CellRollout {
    cell: SimCell,
    camera: CameraMemory,
    /// Of the tick before a touch, while that is looked for.
    before: Checkpoint,
}

/// The whole state of a [`CellRollout`] at a tick: joints, memories of effects, object, contact, camera, time.
#[derive(Debug)]
pub struct Checkpoint {
    cell: SimState,
    camera: CameraMemory,
}

impl Clone for Checkpoint {
    fn clone(&self) -> Self {
        Self { cell: self.cell.clone(), camera: self.camera }
    }

    /// Keeps the memory it has.
    fn clone_from(&mut self, source: &Self) {
        self.cell.clone_from(&source.cell);
        self.camera = source.camera;
    }
}

impl CellRollout {
    /// A worker for a cell, with identified parameters and effects where `theta` has some.
    ///
    /// # Errors
    /// [`SimError`] naming the key or file and the remedy.
    pub fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, SimError> {
        let cell = SimCell::new(cell, theta)?;
        let (state, camera) = (cell.state(), CameraMemory::default());
        Ok(Self { cell, camera, before: Checkpoint { cell: state, camera } })
    }

    /// Gives the worker other parameters: gains, object, effects. What `theta` does not know returns to cell.toml's
    /// nominal values. Takes some microseconds; start or resume afterwards.
    ///
    /// # Errors
    /// [`SimError`] naming the key and the remedy.
    pub fn set_parameters(&mut self, theta: &Theta) -> Result<(), SimError> {
        self.cell.set_parameters(theta)
    }

    /// Integrates in `parts` as many steps as the twin takes ([`SimCell::refine`]).
    pub fn refine(&mut self, parts: u32) {
        self.cell.refine(parts);
    }

    /// Starts at the stamp `at_ns`: the arm where its encoders read `arm`, the object in `object`. Who is `None` takes
    /// no part: the arm alone, the object alone. Commands from before `at_ns` count where they come late.
    pub fn start(
        &mut self,
        at_ns: u64,
        arm: Option<&JointState>,
        object: Option<&ObjectState>,
        commands: Option<&CommandTrack>,
    ) {
        self.cell.set_time_ns(at_ns);
        self.camera = CameraMemory::default();
        match arm {
            Some(reading) => self.put_arm(reading, commands),
            None => self.cell.remove_arm(),
        }
        match object {
            Some(ObjectState { pose, velocity, angular_velocity }) => {
                self.cell.set_object(pose, *velocity, *angular_velocity);
            }
            None => self.cell.remove_object(),
        }
    }

    /// Sets the arm, and nothing else, where its encoders read `reading` now: behind a hole in the commands.
    pub fn put_arm(&mut self, reading: &JointState, commands: Option<&CommandTrack>) {
        match commands {
            Some(commands) => self.cell.start_arm(reading, self.cell.time_ns(), commands),
            None => self.cell.set_arm(&reading.q, &reading.dq),
        }
    }

    /// The whole state now. Allocates; [`CellRollout::checkpoint_into`] does not.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint { cell: self.cell.state(), camera: self.camera }
    }

    /// The whole state now, into a checkpoint of a worker for the same cell.
    pub fn checkpoint_into(&self, out: &mut Checkpoint) {
        self.cell.state_into(&mut out.cell);
        out.camera = self.camera;
    }

    /// Goes on from a checkpoint of a worker for the same cell. Under the parameters of then the run that follows is bit
    /// by bit the uninterrupted one. Parameters of object, contact, table and camera may be others meanwhile: arm and
    /// object go on from the same poses and velocities. Those of the arm must be the same.
    pub fn resume(&mut self, from: &Checkpoint) {
        self.cell.resume(&from.cell);
        self.camera = from.camera;
    }

    /// Runs until every stamp of the course has its answer in `out`.
    ///
    /// `out` holds the answers of the course's first stamps, as many as its vectors are long: clear it before a start,
    /// keep it (or restore a clone of it) to go on. Stamps before the present get the present. A pose's stamp is the
    /// camera's: it shows the object one latency before. Once the joints are answered (or none are asked for) and the
    /// object rests where nothing will touch it again, the poses that are left are those of now.
    pub fn run(&mut self, course: &Course<'_>, out: &mut CellTrace) {
        self.advance(course, out, Until::Answered);
    }

    /// Runs to the first tick that is not before `until_ns`, answering what is due by then; once the process is asked to end,
    /// no further.
    pub fn run_until(&mut self, until_ns: u64, course: &Course<'_>, out: &mut CellTrace) {
        self.advance(course, out, Until::Stamp(until_ns));
    }

    /// Runs as [`CellRollout::run`] does, but stops at the last tick before tool and object first touch: the place for a
    /// checkpoint that many sets of object parameters share. The stamp of that tick; `None` when every stamp was
    /// answered without a touch.
    pub fn run_until_contact(&mut self, course: &Course<'_>, out: &mut CellTrace) -> Option<u64> {
        self.advance(course, out, Until::Contact).then(|| self.now_ns())
    }

    /// Lets one control period pass, for callers that look at every tick themselves.
    pub fn tick(&mut self, commands: Option<&CommandTrack>) {
        let drive = match commands {
            Some(commands) => {
                let row = commands.at(self.cell.time_ns());
                Drive::JointImpedance { q_d: *commands.q_d(row), dq_d: *commands.dq_d(row) }
            }
            None => self.cell.command(),
        };
        self.cell.step(&drive);
    }

    /// Answers what is left when the object stays where it is.
    fn rest(&mut self, course: &Course<'_>, out: &mut CellTrace) {
        let Some(pose) = self.cell.object() else { return };
        let effects = self.cell.camera_effects();
        while let Some(stamp) = course.poses_ns.get(out.poses.len()) {
            out.poses.push(effects.seen(&mut self.camera, *stamp, pose));
        }
    }

    /// Answers what is left of an interrupted run.
    fn give_up(&mut self, course: &Course<'_>, out: &mut CellTrace, until: Until) {
        if !matches!(until, Until::Stamp(_)) {
            out.joints.resize(course.joints_ns.len(), Reading::unknown());
            self.rest(course, out);
        }
    }

    /// Whether it stopped before a touch.
    fn advance(&mut self, course: &Course<'_>, out: &mut CellTrace, until: Until) -> bool {
        let mut before = (self.reading(), self.cell.object());
        let mut ticks = 0u64;
        self.keep(course, out, &before, &before, 0);
        while self.goes_on(course, out, until) {
            if ending::asked() {
                self.give_up(course, out, until);
                return false;
            }
            let start_ns = self.cell.time_ns();
            let may_stop = until == Until::Contact && self.contact().is_none() && self.cell.may_touch();
            if may_stop {
                self.cell.state_into(&mut self.before.cell);
            }
            self.tick(course.commands);
            if may_stop && self.contact().is_some() {
                self.cell.resume(&self.before.cell);
                return true;
            }
            let after = (self.reading(), self.cell.object());
            self.keep(course, out, &before, &after, start_ns);
            before = after;
            ticks += 1;
            if until == Until::Answered
                && out.joints.len() == course.joints_ns.len()
                && ticks.is_multiple_of(LOOK_TICKS)
            {
                let end_ns = course.poses_ns.last().copied().unwrap_or(0);
                if self.stays(course.commands, end_ns) {
                    self.rest(course, out);
                }
            }
        }
        false
    }

    /// Whether the object stays where it is until `until_ns`: it rests, and the tool is led past it at a distance that no
    /// tracking error bridges.
    fn stays(&self, commands: Option<&CommandTrack>, until_ns: u64) -> bool {
        if !self.cell.object_rests() {
            return false;
        }
        let q = self.cell.q();
        let Some(commands) = commands else { return self.cell.gap_at(&q) > CLEAR };
        let now_ns = self.now_ns();
        let asked = |ns: u64| self.cell.gap_at(commands.q_d(commands.at(ns)));
        let behind = (asked(now_ns) - self.cell.gap_at(&q)).abs();
        let looks = (now_ns.saturating_sub(LATEST_NS)..until_ns + LOOK_NS).step_by(LOOK_NS as usize);
        looks.map(asked).all(|gap| gap > CLEAR + 2.0 * behind)
    }

    fn goes_on(&self, course: &Course<'_>, out: &CellTrace, until: Until) -> bool {
        match until {
            Until::Stamp(until_ns) => self.now_ns() < until_ns,
            Until::Answered | Until::Contact => self.unfinished(course, out),
        }
    }

    fn unfinished(&self, course: &Course<'_>, out: &CellTrace) -> bool {
        let poses = if self.cell.object().is_some() { course.poses_ns.len() } else { 0 };
        out.joints.len() < course.joints_ns.len() || out.poses.len() < poses
    }

    /// Keeps the answers for every stamp up to now that has none, between the moments `start_ns` and now.
    fn keep(&mut self, course: &Course<'_>, out: &mut CellTrace, before: &Moment, after: &Moment, start_ns: u64) {
        let now_ns = self.cell.time_ns();
        let share = |stamp: u64| stamp.saturating_sub(start_ns) as f64 / TICK_NS as f64;
        while let Some(stamp) = course.joints_ns.get(out.joints.len()).filter(|stamp| **stamp <= now_ns) {
            out.joints.push(after.0.after(&before.0, share(*stamp)));
        }
        let effects = self.cell.camera_effects();
        let latency = effects.latency_ns();
        if let (Some(a), Some(b)) = (&before.1, &after.1) {
            let due = |stamp: &&u64| stamp.saturating_sub(latency) <= now_ns;
            while let Some(stamp) = course.poses_ns.get(out.poses.len()).filter(due) {
                let share = share(stamp.saturating_sub(latency)).min(1.0);
                // An object at rest is reported bit by bit where it is.
                let pose = if a == b { *b } else { Pose::from_isometry(a.isometry().lerp_slerp(&b.isometry(), share)) };
                out.poses.push(effects.seen(&mut self.camera, *stamp, pose));
            }
        }
        out.contact = self.contact();
    }

    /// When tool and object touched since the object was set.
    pub fn contact(&self) -> Option<ContactSpan> {
        let (start_ns, end_ns) = (self.cell.first_contact_ns()?, self.cell.last_contact_ns()?);
        Some(ContactSpan { start_ns, end_ns })
    }

    /// The present [ns].
    pub fn now_ns(&self) -> u64 {
        self.cell.time_ns()
    }

    /// What the arm's sensors read now, without noise.
    pub fn reading(&self) -> Reading {
        self.cell.reading()
    }

    /// The object now; `None` where there is none or it takes no part.
    pub fn object(&self) -> Option<ObjectState> {
        let (velocity, angular_velocity) = self.cell.object_velocity()?;
        Some(ObjectState { pose: self.cell.object()?, velocity, angular_velocity })
    }

    /// The arm alone under the parameters in force, for [`ArmRollout::start_state`] and runs without an object.
    pub fn arm(&self) -> Option<ArmRollout<'_>> {
        Some(self.cell.plant()?.rollout())
    }

    /// The simulated cell itself.
    pub fn cell(&self) -> &SimCell {
        &self.cell
    }
}

/// A tool that stays so far from an object [m], and twice its tracking error more, does not touch it.
const CLEAR: f64 = 0.02;
/// Ticks between two looks whether all is over, and time between two places of the tool that are looked at [ns].
const LOOK_TICKS: u64 = 32;
const LOOK_NS: u64 = 8_000_000;
/// A command that came earlier than this has arrived [ns].
const LATEST_NS: u64 = 500_000_000;

/// Where a run ends.
#[derive(Clone, Copy, PartialEq)]
enum Until {
    /// Every stamp has its answer.
    Answered,
    /// The same, or tool and object are about to touch for the first time.
    Contact,
    /// A stamp [ns].
    Stamp(u64),
}

/// What the arm's sensors read, and where the object is.
type Moment = (Reading, Option<Pose<Base, Object>>);
