//! The thread that simulates, draws and records: one episode after the other, fifty pictures a second.

use super::message::{EpisodeEntry, FingersEntry, Hello, Input, State, frame};
use super::orders::{Awaited, MAX_WAITING, Order, Orders};
use crate::task::{Jog, SteerError, Steered, Task, TaskCamera, TaskView};
use crate::world::STEP;
use serde::Serialize;
use shared_mem::msg::target::SILENCE_NS;
use shared_mem::output::{Destination, OutputError};
use shared_mem::recording::{ClipInfo, Episode, RigidPose, WriteError, pack_quickly, write_episode};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A page's picture has at least so many columns.
const WIDTH: u32 = 640;
/// From one picture to the next.
const PERIOD: Duration = Duration::from_millis(20);
/// A jog that is not repeated counts for so long.
const SILENCE: Duration = Duration::from_nanos(SILENCE_NS);
/// A start that comes sooner after a stop was on its way before its sender saw that.
const STANDS: Duration = Duration::from_millis(500);
/// Seeds in a row whose bodies cannot be placed, before it is given up.
const SEEDS: u64 = 100;

/// Steering cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum TeleopError {
    #[error(transparent)]
    Steer(#[from] SteerError),
    #[error("the task has no camera; give it a [[camera]] block (docs/tasks.md)")]
    NoCamera,
    /// Not that picture.
    #[error("the task has no camera `{wanted}`; it has: {there}")]
    OtherCamera {
        wanted: String,
        /// What there is.
        there: String,
    },
    /// A clip cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Where clips go, and from which start on.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Clips are `episode_SEED.mcap` in it; none: nothing is recorded.
    pub folder: Option<PathBuf>,
    /// Whether clips that are there already are replaced; else their seeds are passed over.
    pub force: bool,
    /// The start of the first episode.
    pub seed: u64,
    /// Longest simulated time of an episode [s].
    pub longest: f64,
    /// What rides along in a clip: program, configuration and cell.
    pub info: ClipInfo,
}

/// What came of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Episodes that were kept.
    pub kept: u64,
    /// Those of them that were a success.
    pub successes: u64,
    /// Episodes that were discarded, one that was under way at the end among them.
    pub discarded: u64,
    /// The seed of the one that was under way at the end.
    pub cut_short: Option<u64>,
    pub clips: Vec<PathBuf>,
}

/// The thread's memory.
pub(super) struct Steering {
    task: Arc<Task>,
    view: TaskView,
    size: [u32; 2],
    recording: Recording,
    episode: Steered,
    open: bool,
    /// When a stop was asked for last; none once something was started since.
    stopped: Option<Instant>,
    jogged: Instant,
    newest: u64,
    summary: Summary,
    said: String,
}

impl Steering {
    /// Places the first episode.
    ///
    /// # Errors
    /// [`TeleopError`] for a task that cannot be steered or seen.
    pub(super) fn new(task: &Arc<Task>, camera: Option<&str>, mut recording: Recording) -> Result<Self, TeleopError> {
        let camera = camera_of(task, camera)?;
        recording.seed = free(&recording, recording.seed);
        if let Some(folder) = &recording.folder {
            // Said now and not after the first episode.
            Destination::in_new_folder(&clip(folder, recording.seed), recording.force)?;
        }
        let episode = Steered::begin(task, recording.seed)?;
        // What is steered is in the picture from the start, wherever the task's camera looks.
        let camera = camera.finer_to(WIDTH).seeing(task.movable(&episode.poses()));
        let view = task.view(&camera);
        let summary = Summary::default();
        let (task, size, said) = (Arc::clone(task), camera.size, "start an episode".to_owned());
        let jogged = Instant::now();
        let (open, stopped, newest) = (false, None, 0);
        Ok(Self { task, view, size, recording, episode, open, stopped, jogged, newest, summary, said })
    }

    /// What a page is sent when it opens.
    pub(super) fn hello(&self) -> String {
        let hello = Hello {
            task: self.task.name(),
            instruction: self.task.instruction(),
            conditions: self.task.conditions(),
            joints: self.task.arm_joints(),
            bodies: self.task.bodies().iter().map(|body| body.name.as_str()).collect(),
            gripper: self.task.has_gripper(),
            record: self.recording.folder.as_ref().map(|folder| folder.display().to_string()),
            size: self.size,
        };
        serde_json::json!({ "hello": hello }).to_string()
    }

    /// Goes on until `stop`: takes in what pages sent, lets as much time pass as has passed, and shows a picture.
    pub(super) fn run(mut self, orders: &Orders, stop: &AtomicBool, mut show: impl FnMut(Vec<u8>)) -> Summary {
        let mut next = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            next += PERIOD;
            self.take_in(orders, next, stop);
            // A machine that is too slow shows slow motion, not leaps.
            next = next.max(Instant::now() - PERIOD);
            self.pass();
            show(self.picture());
        }
        self.ended()
    }

    /// Takes in what pages ask for until then, and no more than so many inputs and one end of an episode: pages that send as fast
    /// as they can hold up neither the others nor the end. A stop is taken in at any time.
    fn take_in(&mut self, orders: &Orders, until: Instant, stop: &AtomicBool) {
        let (mut taken, mut awaited) = (0, Awaited::Any);
        while !stop.load(Ordering::Relaxed) && (taken < MAX_WAITING || Instant::now() < until) {
            let Some(order) = orders.next(until, awaited) else { return };
            taken += 1;
            if self.take(&order) || taken >= MAX_WAITING {
                awaited = Awaited::Halts;
            }
        }
    }

    /// What came of it all: an episode that nobody ended is discarded.
    fn ended(mut self) -> Summary {
        if self.open {
            self.summary.discarded += 1;
            self.summary.cut_short = Some(self.episode.seed());
        }
        self.summary
    }

    /// Does what is asked for; whether an episode came to its end by that.
    fn take(&mut self, order: &Order) -> bool {
        match order {
            Order::Stop { id } => {
                self.newest = self.newest.max(*id);
                self.episode.jog(Jog::Still);
                (self.stopped, self.said) = (Some(Instant::now()), "stopped: the arm holds; start goes on".to_owned());
                false
            }
            Order::Gone => {
                self.episode.jog(Jog::Still);
                // The numbers of the next page are its own.
                self.newest = 0;
                false
            }
            Order::Input(input) => {
                self.newest = self.newest.max(input.id);
                self.steer(input);
                input.episode.is_some_and(|wanted| self.turn(wanted))
            }
        }
    }

    /// Moves arm and fingers, unless a stop has them hold.
    fn steer(&mut self, input: &Input) {
        if self.stopped.is_some() {
            return;
        }
        if let Some(jog) = &input.jog {
            self.episode.jog(jog.jog());
            self.jogged = Instant::now();
        }
        if let Some(fingers) = input.fingers
            && self.open
        {
            self.episode.fingers(fingers == FingersEntry::Open);
        }
    }

    /// Begins an episode, goes on with it after a stop, or ends it; whether it came to its end.
    fn turn(&mut self, wanted: EpisodeEntry) -> bool {
        let seed = self.episode.seed();
        match wanted {
            EpisodeEntry::Start if self.stopped.is_some_and(|at| at.elapsed() < STANDS) => false,
            EpisodeEntry::Start => {
                if !self.open {
                    self.said = format!("episode {seed}");
                } else if self.stopped.is_some() {
                    self.said = format!("episode {seed} goes on");
                }
                (self.open, self.stopped) = (true, None);
                false
            }
            EpisodeEntry::Keep if self.open => {
                self.keep();
                true
            }
            EpisodeEntry::Discard if self.open => {
                self.summary.discarded += 1;
                self.place(seed);
                self.said = format!("episode {seed} discarded; start it again");
                true
            }
            EpisodeEntry::Keep | EpisodeEntry::Discard => false,
        }
    }

    /// Lets simulated time pass, where an episode is under way.
    fn pass(&mut self) {
        if !self.open {
            return;
        }
        if self.jogged.elapsed() > SILENCE {
            self.episode.jog(Jog::Still);
        }
        for _ in 0..(PERIOD.as_secs_f64() / STEP).round() as usize {
            self.episode.step();
            if self.episode.is_success() || self.episode.time() >= self.recording.longest {
                self.keep();
                return;
            }
        }
    }

    /// Ends the episode, writes its clip and places the next.
    fn keep(&mut self) {
        let (seed, success, time) = (self.episode.seed(), self.episode.is_success(), self.episode.time());
        let recorded = self.episode.recorded();
        let next = free(&self.recording, seed.saturating_add(1));
        let goes_on = self.place(next);
        let outcome = if success { "a success" } else { "no success" };
        self.summary.kept += 1;
        self.summary.successes += u64::from(success);
        let Some(folder) = self.recording.folder.clone() else {
            self.said = format!("episode {seed} was {outcome} after {time:.1} s; nothing is recorded without --record");
            return;
        };
        let path = clip(&folder, seed);
        self.said = match self.write(&path, &recorded) {
            Ok(()) => {
                self.summary.clips.push(path.clone());
                format!("episode {seed} was {outcome} after {time:.1} s: {}", path.display())
            }
            Err(error) => format!("episode {seed} is lost: {error}"),
        };
        if !goes_on {
            self.said += &format!("; none of the next {SEEDS} seeds has a start");
        }
        tracing::info!("{}", self.said);
    }

    fn write(&self, path: &Path, episode: &Episode) -> Result<(), WriteError> {
        let place = Destination::in_new_folder(path, self.recording.force)?;
        write_episode(place.begin()?, &self.recording.info, episode).map(|_| ())
    }

    /// Places the next episode, with this seed or the first after it that can be; `false` where none can.
    fn place(&mut self, seed: u64) -> bool {
        self.open = false;
        let begun = (seed..seed.saturating_add(SEEDS)).find_map(|seed| Steered::begin(&self.task, seed).ok());
        let goes_on = begun.is_some();
        begun.into_iter().for_each(|begun| self.episode = begun);
        goes_on
    }

    fn picture(&mut self) -> Vec<u8> {
        let poses = self.episode.poses();
        let picture = self.view.draw(&poses, Some(&self.episode.joints()));
        let [width, height] = self.size;
        let png = pack_quickly(width, height, &picture.colour).unwrap_or_default();
        let (width, grasped) = self.episode.gripper().map_or((None, false), |(width, held)| (Some(width), held));
        let joints = self.task.arm_joints().len();
        let state = State {
            id: self.newest,
            time_s: self.episode.time(),
            seed: self.episode.seed(),
            open: self.open,
            holds: self.episode.holds(),
            success: self.episode.is_success(),
            q: self.episode.joints()[..joints].to_vec(),
            flange: self.episode.flange(),
            bodies: poses.iter().map(flat).collect(),
            width,
            grasped,
            stopped: self.stopped.is_some(),
            held_by: self
                .stopped
                .map_or_else(|| self.episode.held_by(), |_| Some("a stop was asked for; start goes on")),
            kept: self.summary.kept,
            successes: self.summary.successes,
            discarded: self.summary.discarded,
            said: self.said.clone(),
        };
        frame(&state, &png)
    }
}

fn camera_of<'a>(task: &'a Task, wanted: Option<&str>) -> Result<&'a TaskCamera, TeleopError> {
    let cameras = task.cameras();
    let first = cameras.first().ok_or(TeleopError::NoCamera)?;
    let Some(wanted) = wanted else { return Ok(first) };
    cameras.iter().find(|camera| camera.name == wanted).ok_or_else(|| {
        let there: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
        TeleopError::OtherCamera { wanted: wanted.to_owned(), there: there.join(", ") }
    })
}

fn flat(pose: &RigidPose) -> [f64; 7] {
    let ([x, y, z], [w, i, j, k]) = (pose.position, pose.wxyz);
    [x, y, z, w, i, j, k]
}

fn clip(folder: &Path, seed: u64) -> PathBuf {
    folder.join(format!("episode_{seed:06}.mcap"))
}

/// The first seed from this one on whose clip is not there yet.
fn free(recording: &Recording, seed: u64) -> u64 {
    let Some(folder) = recording.folder.as_ref().filter(|_| !recording.force) else { return seed };
    (seed..u64::MAX).find(|seed| !clip(folder, *seed).exists()).unwrap_or(seed)
}
