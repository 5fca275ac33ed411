//! One episode of a policy on a robot: until the horizon, a fault, or the end is asked for.

use super::stream::{Leg, Stream};
use evaluation::policy::{Policy, PolicyError, Seen};
use evaluation::rollout::Asking;
use inference::interrupt::Interrupt;
use serde::Serialize;
use shared_mem::msg::arm::{ArmMode, ArmState, MotionStatus};
use shared_mem::msg::check::LARGEST;
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::target::ArmTarget;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{ImageSample, ImageSubscriber, Node, Subscriber, TransportError};
use std::time::{Duration, Instant};
use twin::task::{Action, Numbers, Signs, Task, TaskCamera, TaskPicture};

/// How long to wait for a bridge, and how long it may be silent.
const PATIENCE: Duration = Duration::from_secs(2);
/// How often the robot is looked at while it carries an action out.
const LOOK: Duration = Duration::from_millis(5);
/// The last target is held for so long, so that the arm comes to rest there.
const REST: Duration = Duration::from_millis(600);

/// What ended an episode that a person ended.
const INTERRUPTED: &str = "interrupted";

/// A policy cannot act on the robot.
#[derive(Debug, thiserror::Error)]
pub enum ActedError {
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(transparent)]
    Policy(#[from] PolicyError),
    #[error("the stream of targets does not start: {0}; end other programs")]
    Thread(#[from] std::io::Error),
    #[error("no bridge showed an arm within {} s; start one with `rt_bridge run --cell cell.toml --arm sim`", PATIENCE.as_secs())]
    NoBridge,
    /// The bridge, or the task, is of no use.
    #[error("{0}")]
    Unusable(String),
}

/// What came of an episode. Whether it was a success is for a person to see.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Acted {
    /// How long it took [s].
    pub duration_s: f64,
    /// Actions that were sent.
    pub actions: u64,
    /// Why it ended before the horizon.
    pub fault: Option<String>,
}

/// A seat beside a running bridge.
pub struct Robot {
    states: Subscriber<ArmState>,
    grippers: Subscriber<GripperState>,
    events: Subscriber<Event>,
    colour: ImageSubscriber,
    depth: ImageSubscriber,
    state: ArmState,
    gripper: Option<GripperState>,
    picture: TaskPicture,
    heard: Instant,
    // Declared last: ports go before the node they belong to.
    _node: Node,
}

impl Robot {
    /// Takes the seat, once a bridge shows an arm.
    ///
    /// # Errors
    /// [`ActedError::NoBridge`].
    pub fn find() -> Result<Self, ActedError> {
        let node = Node::open("calibration policy run")?;
        let states = node.subscriber(topics::ARM_STATE)?;
        let began = Instant::now();
        let state = loop {
            match states.newest()? {
                Some(state) => break state,
                None if began.elapsed() > PATIENCE => return Err(ActedError::NoBridge),
                None => std::thread::sleep(LOOK),
            }
        };
        Ok(Self {
            states,
            grippers: node.subscriber(topics::GRIPPER)?,
            events: node.subscriber(topics::EVENTS)?,
            colour: node.image_subscriber(topics::CAMERA_COLOR)?,
            depth: node.image_subscriber(topics::CAMERA_DEPTH)?,
            state,
            gripper: None,
            picture: TaskPicture { colour: Vec::new(), depth: Vec::new() },
            heard: Instant::now(),
            _node: node,
        })
    }

    /// One episode.
    ///
    /// # Errors
    /// [`ActedError`] before anything moves, and when the policy or shared memory fails.
    pub fn act(
        &mut self,
        task: &Task,
        policy: &mut Policy,
        (asking, speed): (&Asking, f64),
        interrupt: &Interrupt,
    ) -> Result<Acted, ActedError> {
        task.suits_a_robot().map_err(|what| ActedError::Unusable(format!("{}: {what}", task.name())))?;
        let dof = task.arm_joints().len();
        if self.state.dof as usize != dof {
            let what = format!(
                "the bridge moves {} joints, the task's arm has {dof}; give the task of that arm",
                self.state.dof
            );
            return Err(ActedError::Unusable(what));
        }
        // What was said before is no matter of this episode.
        while self.events.receive()?.is_some() {}
        let (numbers, mut signs) = (Numbers::of(task), Signs::default());
        let mut target =
            ArmTarget { stream: now_ns(), dof: self.state.dof, speed, q: self.state.q_d, ..ArmTarget::default() };
        let stream = Stream::begin(target)?;
        let (began, period) = (Instant::now(), Duration::from_secs_f64(1.0 / f64::from(asking.rate)));
        policy.begin();
        let mut acted = Acted { duration_s: 0.0, actions: 0, fault: None };
        while acted.fault.is_none() && began.elapsed().as_secs_f64() < task.horizon() {
            acted.fault = self.look(target.stream, interrupt)?;
            if acted.fault.is_some() {
                break;
            }
            let now = task.reported(&self.state, self.gripper.as_ref());
            let pictures = task.cameras().iter().enumerate().map(|(i, camera)| self.seen_by(i, camera)).collect();
            let seen = Seen { task, numbers: &numbers, now: &now, surroundings: false, pictures };
            let answer = match policy.actions(&seen.message(&asking.keys, &mut signs)) {
                Err(error) if error.is_interruption() => {
                    acted.fault = Some(INTERRUPTED.to_owned());
                    break;
                }
                answer => answer?,
            };
            for values in answer.iter().take(asking.chunk.unwrap_or(usize::MAX)) {
                let action = asking.actions.read(task, &numbers, values).map_err(|what| policy.answer(&what))?;
                acted.fault = self.go(task, &action, (&mut target, &stream, period), interrupt)?;
                if acted.fault.is_some() || began.elapsed().as_secs_f64() >= task.horizon() {
                    break;
                }
                acted.actions += 1;
            }
        }
        acted.duration_s = began.elapsed().as_secs_f64();
        if acted.fault.is_none() {
            std::thread::sleep(REST);
        }
        stream.end()?;
        Ok(acted)
    }

    /// Goes for one action over its time; why it has to stop.
    fn go(
        &mut self,
        task: &Task,
        action: &Action,
        (target, stream, period): (&mut ArmTarget, &Stream, Duration),
        interrupt: &Interrupt,
    ) -> Result<Option<String>, ActedError> {
        match task.joints_of(action, &target.q) {
            Ok(Some(q)) => target.q = q,
            Ok(None) => {}
            Err(fault) => return Ok(Some(fault)),
        }
        // A bridge ignores a message that holds more, and nobody would hear of it.
        let mut wanted = target.q.iter().copied().chain(action.width);
        if let Some(beyond) = wanted.find(|value| !value.is_finite() || value.abs() > LARGEST) {
            return Ok(Some(format!("the policy wants {beyond:e} rad or m, which no target may be")));
        }
        if !stream.go(Leg { q: target.q, width: action.width, over: period }) {
            return Ok(Some("the stream of targets broke off".to_owned()));
        }
        let until = Instant::now() + period;
        while Instant::now() < until {
            std::thread::sleep(LOOK);
            if let Some(fault) = self.look(target.stream, interrupt)? {
                return Ok(Some(fault));
            }
        }
        Ok(None)
    }

    /// Reads all that is new; why the episode has to stop.
    fn look(&mut self, stream: u64, interrupt: &Interrupt) -> Result<Option<String>, ActedError> {
        if let Some(state) = self.states.newest()? {
            (self.state, self.heard) = (state, Instant::now());
        }
        self.gripper = self.grippers.newest()?.or(self.gripper);
        while let Some(sample) = self.colour.receive()? {
            self.picture.colour = packed(&sample, 3);
        }
        while let Some(sample) = self.depth.receive()? {
            let scale = 1000.0 * sample.header().depth_scale;
            let millimetres = |pair: &[u8]| (f64::from(u16::from_le_bytes([pair[0], pair[1]])) * scale).round() as u16;
            self.picture.depth = packed(&sample, 2).chunks_exact(2).map(millimetres).collect();
        }
        let (mut said, ours) = (None, format!("motion {stream}"));
        while let Some(event) = self.events.receive()? {
            // Of others, a late camera for one, an episode does not end.
            let counts = event.level == EventLevel::Error || event.text().contains(&ours);
            if event.source == EventSource::Bridge && event.level != EventLevel::Info && counts {
                said = Some(event.text().replace(&ours, "the stream of targets"));
            }
        }
        let braked = self.state.motion_id == stream && self.state.motion == MotionStatus::Braked;
        Ok(if interrupt.asked() {
            Some(INTERRUPTED.to_owned())
        } else if self.heard.elapsed() > PATIENCE {
            Some("the bridge fell silent".to_owned())
        } else if !matches!(self.state.mode, ArmMode::Idle | ArmMode::Move) {
            Some(said.unwrap_or_else(|| "the robot stopped itself, or was stopped".to_owned()))
        } else if braked {
            Some(said.unwrap_or_else(|| "the bridge braked the arm".to_owned()))
        } else {
            said
        })
    }

    /// The bridge's one picture for the task's first camera, where it is of that size.
    fn seen_by(&self, place: usize, camera: &TaskCamera) -> Option<TaskPicture> {
        let [columns, rows] = camera.size.map(|pixels| pixels as usize);
        let fits = place == 0 && self.picture.colour.len() == 3 * columns * rows;
        fits.then(|| {
            let mut picture = self.picture.clone();
            picture.depth.resize(columns * rows, 0);
            picture
        })
    }
}

/// A picture's bytes without gaps between its rows.
fn packed(sample: &ImageSample, bytes_per_pixel: usize) -> Vec<u8> {
    let header = sample.header();
    let (row, stride) = (bytes_per_pixel * header.width as usize, header.stride as usize);
    sample.bytes().chunks(stride.max(1)).flat_map(|line| line.get(..row).unwrap_or(line)).copied().collect()
}
