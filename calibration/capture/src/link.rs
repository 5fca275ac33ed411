//! The capture's side of shared memory: it reads the arm's state and the bridge's remarks, and hands over motions.
//!
//! Knows no physics. A bridge that falls silent or starts anew is an error with its remedy, never a wait without end.

use super::quality::{GAINS, MAX_REST_ERROR, MAX_REST_SPEED};
use shared_mem::console;
use shared_mem::msg::arm::{ArmMode, ArmState};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::motion::{MotionChunk, MotionKind};
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_MOTION, ARM_STATE, EVENTS};
use shared_mem::transport::{Node, Publisher, Subscriber, TransportError};
use std::time::{Duration, Instant};

/// A bridge that says nothing for this long is gone.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(1);
/// How long a bridge may take to recover a robot from a reflex: brakes close and open. It says nothing meanwhile.
const RECOVERY_TIMEOUT: Duration = Duration::from_secs(15);

/// The link to a bridge failed, or the bridge cannot be used as it is.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// Shared memory failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// No state for a second.
    #[error(
        "the bridge has fallen silent: no arm state for 1 s{}; start it again (`rt_bridge run --cell ...`) and repeat the clip",
        said(last_words)
    )]
    Silent {
        /// Its last warning or error, if any.
        last_words: Option<String>,
    },
    /// The bridge is another one than before.
    #[error("the bridge was started anew while a motion was being played; repeat the clip")]
    Restarted,
    /// It moves another arm.
    #[error("the bridge moves {moves} joints, cell.toml describes {described}; start the bridge with the same --cell")]
    OtherArm {
        /// Joints of the bridge's arm.
        moves: u32,
        /// Joints of cell.toml's.
        described: usize,
    },
    /// It does not stay where it is commanded to.
    #[error(
        "the arm does not hold still: joint {} is {off:.2} rad away from its command and turns at {speed:.2} rad/s; {}",
        joint + 1,
        GAINS
    )]
    DoesNotHold {
        /// The joint that is worst, from 0.
        joint: usize,
        /// How far it is from its command [rad].
        off: f64,
        /// How fast it turns [rad/s].
        speed: f64,
    },
    /// The robot is in no state to move.
    #[error("the robot is not ready to move: {what}{}; {remedy}", said(last_words))]
    NotReady {
        /// What it is doing.
        what: &'static str,
        /// What a person does about it.
        remedy: &'static str,
        /// The bridge's last warning or error, if any.
        last_words: Option<String>,
    },
}

fn said(last_words: &Option<String>) -> String {
    last_words.as_ref().map_or(String::new(), |words| format!(" (the bridge said: {words})"))
}

/// A warning or an error of the bridge.
#[derive(Debug, Clone)]
struct Words {
    level: EventLevel,
    text: String,
}

/// A seat beside one bridge.
#[derive(Debug)]
pub struct Link {
    states: Subscriber<ArmState>,
    events: Subscriber<Event>,
    motions: Publisher<MotionChunk>,
    remarks: Publisher<Event>,
    newest: Option<ArmState>,
    heard: Instant,
    last_words: Option<Words>,
    // Declared last: ports go before the node they belong to.
    node: Node,
}

impl Link {
    /// Takes the seat in `domain` (default: the one this process was started in).
    ///
    /// # Errors
    /// [`LinkError::Transport`] when shared memory is not usable or another capture is at work.
    pub fn open(domain: Option<&str>) -> Result<Self, LinkError> {
        const NAME: &str = "calibration capture";
        let node = domain.map_or_else(|| Node::open(NAME), |domain| Node::open_in(domain, NAME))?;
        Ok(Self {
            states: node.subscriber(ARM_STATE)?,
            events: node.subscriber(EVENTS)?,
            motions: node.publisher(ARM_MOTION)?,
            remarks: node.publisher(EVENTS)?,
            newest: None,
            heard: Instant::now(),
            last_words: None,
            node,
        })
    }

    /// The next state not yet seen, oldest first. `None`: nothing new; ask again in a few milliseconds.
    ///
    /// # Errors
    /// [`LinkError::Silent`] when there was none for a second, [`LinkError::Restarted`] when the bridge is another one.
    pub fn next_state(&mut self) -> Result<Option<ArmState>, LinkError> {
        self.listen()?;
        let Some(state) = self.states.receive()? else {
            if self.heard.elapsed() > SILENCE_TIMEOUT {
                return Err(LinkError::Silent { last_words: self.last_words() });
            }
            return Ok(None);
        };
        self.heard = Instant::now();
        if self.newest.replace(state).is_some_and(|before| before.session != state.session) {
            return Err(LinkError::Restarted);
        }
        Ok(Some(state))
    }

    /// Waits for a sign of life. `None`: nobody there within `patience`, or `give_up` said so.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when shared memory fails.
    pub fn wait_for_bridge(
        &mut self,
        patience: Duration,
        mut give_up: impl FnMut() -> bool,
    ) -> Result<Option<ArmState>, LinkError> {
        let start = Instant::now();
        while start.elapsed() < patience && !give_up() {
            if let Some(state) = self.states.newest()? {
                self.heard = Instant::now();
                self.newest = Some(state);
                return Ok(self.newest);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(None)
    }

    /// Forgets what a bridge that has ended said: the next state is the first of another bridge.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when shared memory fails.
    pub fn forget(&mut self) -> Result<(), LinkError> {
        self.states.newest()?;
        self.newest = None;
        Ok(())
    }

    /// The newest state, provided the robot may be moved; remarks of earlier motions are forgotten.
    ///
    /// # Errors
    /// [`LinkError::NotReady`] with the remedy, [`LinkError::Silent`].
    pub fn ready_state(&mut self) -> Result<ArmState, LinkError> {
        self.newest = None;
        self.heard = Instant::now();
        let state = loop {
            match self.next_state()? {
                Some(state) => self.newest = Some(state),
                None => match self.newest {
                    Some(state) => break state,
                    None => std::thread::sleep(Duration::from_millis(2)),
                },
            }
        };
        let [what, remedy] = match state.mode {
            ArmMode::Idle | ArmMode::Move => {
                self.last_words = None;
                return Ok(state);
            }
            ArmMode::Other => ["it reports no known mode", "look at the bridge's messages"],
            ArmMode::Guiding => ["it is being guided by hand", "release the guiding buttons"],
            ArmMode::Reflex => {
                ["it stopped itself", "recover it from its error (restart the bridge), then start again"]
            }
            ArmMode::UserStopped => ["the stop button is pressed", "release the button, then start again"],
            ArmMode::Recovery => ["it is recovering from an error", "wait for it, then start again"],
        };
        Err(LinkError::NotReady { what, remedy, last_words: self.last_words() })
    }

    /// [`Self::ready_state`] of an arm with so many joints, which holds still.
    ///
    /// # Errors
    /// [`LinkError::OtherArm`], [`LinkError::DoesNotHold`], and those of [`Self::ready_state`].
    pub fn ready_arm(&mut self, described: usize) -> Result<ArmState, LinkError> {
        let state = self.ready_state()?;
        if state.dof as usize != described {
            return Err(LinkError::OtherArm { moves: state.dof, described });
        }
        let joints = (0..described.min(state.q.len()))
            .map(|joint| (joint, (state.q_d[joint] - state.q[joint]).abs(), state.dq[joint].abs()));
        let holds = |off: f64, speed: f64| off <= MAX_REST_ERROR && speed <= MAX_REST_SPEED;
        let loose = joints.filter(|(_, off, speed)| !holds(*off, *speed)).max_by(|a, b| a.2.total_cmp(&b.2));
        match loose {
            Some((joint, off, speed)) => Err(LinkError::DoesNotHold { joint, off, speed }),
            None => Ok(state),
        }
    }

    /// Has the bridge recover the robot from a reflex and waits until it holds. A robot that a person stopped is left alone.
    ///
    /// # Errors
    /// [`LinkError::NotReady`] when it could not be recovered or a person has to act, [`LinkError::Silent`].
    pub fn recover(&mut self) -> Result<ArmState, LinkError> {
        let is_in_reflex = |state: Option<ArmState>| state.is_none_or(|state| state.mode == ArmMode::Reflex);
        self.newest = self.states.newest()?.or(self.newest);
        if is_in_reflex(self.newest) {
            self.listen()?;
            self.last_words = None;
            self.send(&MotionChunk { stamp_ns: now_ns(), kind: MotionKind::Recover, ..MotionChunk::default() })?;
            let asked = Instant::now();
            while is_in_reflex(self.newest) && self.last_words.is_none() && asked.elapsed() < RECOVERY_TIMEOUT {
                std::thread::sleep(Duration::from_millis(5));
                self.listen()?;
                self.newest = self.states.newest()?.or(self.newest);
            }
        }
        self.ready_state()
    }

    /// Hands a batch of set points over.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when shared memory fails.
    pub fn send(&self, chunk: &MotionChunk) -> Result<(), LinkError> {
        Ok(self.motions.send(chunk)?)
    }

    /// Says what is about to be played, for everyone who listens and for every recording.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when shared memory fails.
    pub fn announce(&self, text: &str) -> Result<(), LinkError> {
        Ok(self.remarks.send(&Event::new(EventLevel::Info, EventSource::Capture, text))?)
    }

    /// The bridge's last warning or error since the link was last ready; waits briefly, because remarks and states travel apart.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when shared memory fails.
    pub fn reason(&mut self) -> Result<String, LinkError> {
        let start = Instant::now();
        while self.last_words.is_none() && start.elapsed() < Duration::from_millis(300) {
            std::thread::sleep(Duration::from_millis(10));
            self.listen()?;
        }
        Ok(self.last_words().unwrap_or_else(|| "the bridge gave no reason".into()))
    }

    fn last_words(&self) -> Option<String> {
        self.last_words.as_ref().map(|words| words.text.clone())
    }

    /// Keeps the bridge's last warning or error; an error outlasts the warnings that follow from it.
    fn listen(&mut self) -> Result<(), LinkError> {
        while let Some(event) = self.events.receive()? {
            let Event { level, source, .. } = event;
            let outlasts = |words: &Words| words.level == EventLevel::Error && level != EventLevel::Error;
            if source == EventSource::Bridge
                && level != EventLevel::Info
                && !self.last_words.as_ref().is_some_and(outlasts)
            {
                self.last_words = Some(Words { level, text: event.text().to_owned() });
            }
        }
        for ignored in self.node.newly_ignored() {
            console::line(ignored);
        }
        Ok(())
    }
}
