//! Feeds a planned motion to the bridge, a few hundred milliseconds ahead of the arm, and watches it to its end.
//!
//! [`Feeder`] decides what to send from what the arm reports and is pure; [`play`] runs it over shared memory.

use super::link::{Link, LinkError};
use shared_mem::interrupt::Interrupt;
use shared_mem::msg::arm::{ArmMode, ArmState, MotionStatus};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, STOP_SILENCE_NS, SetPoint};
use shared_mem::time::now_ns;
use std::time::{Duration, Instant};

/// Set points kept waiting at the bridge: 0.4 s at 1 kHz, longer than this process is ever kept from running.
const QUEUED_SET_POINTS: usize = 400;
/// Pause between looks at the arm.
const POLL_INTERVAL: Duration = Duration::from_millis(5);
/// A bridge that has not begun to play by then never will.
const TAKE_UP: Duration = Duration::from_secs(2);
/// How long an arm may take to come to rest after a stop.
const BRAKING_TIMEOUT: Duration = Duration::from_secs(3);
/// After a stop the bridge begins nothing before a silence, which it counts in its own cycles: half as long again.
const SILENCE_AFTER_STOP: Duration = Duration::from_nanos(STOP_SILENCE_NS + STOP_SILENCE_NS / 2);

/// How a motion ended that was not refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Played to its end.
    Done,
    /// Braked, or not begun, because the user asked for the end.
    Stopped,
    /// Braked, or not begun, because the user asked for a pause.
    Paused,
    /// The robot stopped itself: it is in a reflex.
    Reflex,
}

/// A motion was not played.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// The link or the robot failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The bridge would not begin.
    #[error("the bridge refused the motion: {reason}")]
    Refused {
        /// What it said.
        reason: String,
    },
    /// The bridge braked the arm.
    #[error(
        "the arm was braked {played} ms into the motion: {reason}; the arm holds its pose, repeat the clip when the cause is gone"
    )]
    Braked {
        /// Set points played before.
        played: u32,
        /// What the bridge said.
        reason: String,
    },
    #[error(
        "the bridge did not take up the motion within 2 s; another motion may be in its way: wait for its end or restart the bridge"
    )]
    NotTaken,
}

/// What to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Send the next chunk: [`Feeder::chunk`].
    Send,
    /// Enough is queued, or everything is sent.
    Wait,
    /// The motion was played to its end.
    Done,
    /// The bridge refused it.
    Refused,
    /// The bridge braked the arm.
    Braked,
    /// The robot stopped itself.
    Reflex,
}

/// A motion: one set point a control cycle, the first and the last at rest.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// The set points.
    pub set_points: &'a [SetPoint],
    /// Number of joints.
    pub dof: usize,
}

/// Cuts a motion into chunks and decides when to send them.
#[derive(Debug, Clone)]
pub struct Feeder<'a> {
    motion: Motion<'a>,
    motion_id: u64,
    sent: usize,
}

impl<'a> Feeder<'a> {
    /// A motion that the bridge will know as `motion_id`.
    pub fn new(motion: Motion<'a>, motion_id: u64) -> Self {
        Self { motion, motion_id, sent: 0 }
    }

    /// What the arm's newest state asks for.
    pub fn next(&self, state: &ArmState) -> Step {
        let ours = state.motion_id == self.motion_id;
        match state.motion {
            MotionStatus::Refused if ours => return Step::Refused,
            MotionStatus::Braked if ours && state.mode == ArmMode::Reflex => return Step::Reflex,
            MotionStatus::Braked if ours => return Step::Braked,
            MotionStatus::Done if ours => return Step::Done,
            _ => {}
        }
        let played = if ours { state.motion_played as usize } else { 0 };
        let waiting = self.sent.saturating_sub(played);
        if self.sent < self.motion.set_points.len() && waiting + CHUNK_LENGTH <= QUEUED_SET_POINTS {
            Step::Send
        } else {
            Step::Wait
        }
    }

    /// The next chunk; the last one is marked as such.
    pub fn chunk(&mut self, now_ns: u64) -> MotionChunk {
        let rest = &self.motion.set_points[self.sent..];
        let length = rest.len().min(CHUNK_LENGTH);
        let mut chunk = self.empty(if length == rest.len() { MotionKind::Last } else { MotionKind::Play }, now_ns);
        chunk.set_points[..length].copy_from_slice(&rest[..length]);
        chunk.length = u32::try_from(length).expect("at most a chunk's length");
        self.sent += length;
        chunk
    }

    /// The order to brake.
    pub fn stop(&self, now_ns: u64) -> MotionChunk {
        self.empty(MotionKind::Stop, now_ns)
    }

    fn empty(&self, kind: MotionKind, now_ns: u64) -> MotionChunk {
        MotionChunk {
            stamp_ns: now_ns,
            motion_id: self.motion_id,
            kind,
            index: u32::try_from(self.sent.div_ceil(CHUNK_LENGTH)).expect("a motion of hours at most"),
            length: 0,
            dof: u32::try_from(self.motion.dof).expect("a handful of joints"),
            set_points: [SetPoint::default(); CHUNK_LENGTH],
        }
    }
}

/// Plays `motion`; every state passes through `watch`. Asked to end or to pause by `interrupt`, it brakes the arm and waits
/// for rest; a motion that was paused has to be planned anew from where the arm is then.
///
/// # Errors
/// [`StreamError`] when the motion is refused, braked, not taken up, or the bridge dies.
pub fn play(
    link: &mut Link,
    motion: Motion<'_>,
    interrupt: &Interrupt,
    mut watch: impl FnMut(&ArmState),
) -> Result<Outcome, StreamError> {
    let mut state = link.ready_state()?;
    let halted = || if interrupt.asked() { Outcome::Stopped } else { Outcome::Paused };
    if interrupt.halted() {
        return Ok(halted());
    }
    let mut feeder = Feeder::new(motion, now_ns());
    let start = Instant::now();
    let mut stopped = None;
    loop {
        while let Some(newer) = link.next_state()? {
            watch(&newer);
            state = newer;
        }
        if stopped.is_none() && interrupt.halted() {
            link.send(&feeder.stop(now_ns()))?;
            stopped = Some((halted(), Instant::now()));
        }
        if let Some((outcome, since)) = stopped {
            let rests = at_rest(&state, &feeder) || since.elapsed() > BRAKING_TIMEOUT;
            if rests && interrupt.asked() {
                return Ok(Outcome::Stopped);
            }
            // What comes after a pause has to be begun by the bridge.
            if rests && since.elapsed() > SILENCE_AFTER_STOP {
                return Ok(outcome);
            }
        } else {
            match feeder.next(&state) {
                Step::Send => {
                    let chunk = feeder.chunk(now_ns());
                    link.send(&chunk)?;
                    continue;
                }
                Step::Wait => {}
                Step::Done => return Ok(Outcome::Done),
                Step::Reflex => return Ok(Outcome::Reflex),
                Step::Refused => return Err(StreamError::Refused { reason: link.reason()? }),
                Step::Braked => {
                    return Err(StreamError::Braked { played: state.motion_played, reason: link.reason()? });
                }
            }
            if state.motion_id != feeder.motion_id && start.elapsed() > TAKE_UP {
                return Err(StreamError::NotTaken);
            }
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Whether a stopped arm has come to rest: its commanded motion is over.
fn at_rest(state: &ArmState, feeder: &Feeder) -> bool {
    let ours = state.motion_id == feeder.motion_id;
    ours && state.motion != MotionStatus::Playing && state.dq_d.iter().all(|dq| dq.abs() < 1e-3)
}
