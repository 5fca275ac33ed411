//! Plays motions: one set point a cycle out of a queue, each admitted by the guard, with a brake for everything that
//! goes wrong. Pure logic: chunks go in, set points and remarks come out.
//!
//! A motion begins at once when its first chunk arrives and the arm holds. It must start where the arm is *commanded* to
//! be, to [`START_TOLERANCE`]: a larger step would itself break the acceleration limit (10 rad/s² is 10 urad in 1 ms).
//!
//! After a stop that was asked for, or a fault of the arm, nothing begins before all senders were silent: whoever was sending
//! then has not asked since.
//!
//! Where set points did not reach the arm in time and it went on by itself meanwhile, the motion goes on from there and eases
//! back to its plan; where those were the last ones, the arm eases back to the end.

mod queue;
mod silence;
mod stream;

pub use queue::QUEUE;
pub use stream::Target;

use super::ease::Ease;
use super::{Brake, lost};
use crate::remark::{BrakeReason, Newest, Refusal, Remark};
use crate::safety::{Guard, Measured, Outside, Trace};
use queue::Queue;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, SetPoint};
use shared_mem::msg::{Joints, MAX_JOINTS};
use silence::Silence;
use stream::Stream;
use twin::arm::JointState;

/// How far a motion's first set point may lie from the commanded position [rad].
pub const START_TOLERANCE: f64 = 1e-6;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Activity {
    Holding,
    Playing,
    Following,
    Braking,
    Halted,
}

/// The player. Allocates when made, never after.
#[derive(Debug)]
pub struct Player {
    guard: Guard,
    brake: Brake,
    trace: Trace,
    /// The same before the last set point.
    before: Trace,
    /// What is played, as it was planned, or where the arm is held; and how far off that it still is.
    planned: Trace,
    ease: Ease,
    /// How far outside the workspace the arm was when it last rested.
    outside: Outside,
    /// What was measured of the arm; `None` before anything was.
    arm: Option<Measured>,
    queue: Queue,
    stream: Stream,
    silence: Silence,
    activity: Activity,
    status: MotionStatus,
    motion: u64,
    due_index: u32,
    has_last: bool,
    played: u32,
    /// Motions whose further chunks and targets are dropped without a word: they were refused or braked.
    dropped: Newest<u64>,
}

impl Player {
    /// Holds `q_d`.
    pub fn new(guard: Guard, q_d: Joints) -> Self {
        Self {
            brake: Brake::new(guard.limits, guard.period_s),
            stream: Stream::new(&guard.limits, guard.period_s),
            silence: Silence::over(guard.period_s),
            outside: guard.workspace.outside(&q_d),
            arm: None,
            guard,
            trace: Trace::at_rest(q_d),
            before: Trace::at_rest(q_d),
            planned: Trace::at_rest(q_d),
            ease: Ease::over(),
            queue: Queue::new(),
            activity: Activity::Holding,
            status: MotionStatus::None,
            motion: 0,
            due_index: 0,
            has_last: false,
            played: 0,
            dropped: Newest::default(),
        }
    }

    /// Holds `q_d` from now on. Called when command of the arm is taken, and its pose is known.
    pub fn hold_at(&mut self, q_d: Joints) {
        self.queue.clear();
        self.trace = Trace::at_rest(q_d);
        (self.before, self.activity) = (self.trace, Activity::Holding);
        (self.planned, self.ease) = (self.trace, Ease::over());
        self.outside = self.guard.workspace.outside(&q_d);
        self.arm = None;
    }

    /// The arm is in this state, which the next set point answers. Its numbers must be finite.
    pub fn see(&mut self, state: &JointState) {
        let Guard { workspace, limits, period_s, .. } = &self.guard;
        match &mut self.arm {
            Some(arm) => arm.see(state, &self.trace, workspace, limits, *period_s),
            None => self.arm = Some(Measured::at_rest(state, &self.trace.q, workspace)),
        }
    }

    /// The arm reports the command `in_force`, `periods` after the state that the last set point answered. Where
    /// that is not what was sent, what follows goes on from there.
    pub fn reconcile(&mut self, in_force: &Joints, periods: u64) {
        let Some(trace) = lost::in_force(&self.trace, &self.before, in_force, periods, self.guard.period_s) else {
            return;
        };
        self.trace = trace;
        match self.activity {
            Activity::Playing | Activity::Holding => {
                self.ease = Ease::between(&trace, &self.planned, &self.guard.limits, self.guard.period_s);
            }
            Activity::Braking => self.brake.begin(&trace),
            Activity::Following => self.stream.go_on_from(&trace, self.guard.period_s),
            Activity::Halted => {}
        }
    }

    /// `true` when a further chunk fits; else it stays with the sender.
    pub fn has_room(&self) -> bool {
        self.queue.len + CHUNK_LENGTH <= QUEUE
    }

    /// `true` when nothing moves and nothing is about to.
    pub fn is_at_rest(&self) -> bool {
        match self.activity {
            Activity::Holding => self.ease.is_over(),
            Activity::Halted => true,
            Activity::Playing | Activity::Following | Activity::Braking => false,
        }
    }

    /// Takes in a chunk. Returns what there is to say about it.
    pub fn take(&mut self, chunk: &MotionChunk) -> Option<Remark> {
        if chunk.kind == MotionKind::Stop {
            return self.stop(BrakeReason::Asked);
        }
        if self.activity == Activity::Playing && chunk.motion_id == self.motion {
            return match self.acceptable(chunk, self.due_index) {
                Ok(()) => {
                    self.append(chunk);
                    None
                }
                Err(why) => self.stop(BrakeReason::Chunk(why)),
            };
        }
        self.silence.hear();
        if self.is_dropped(chunk.motion_id) {
            return None;
        }
        match self.startable(chunk) {
            Ok(()) => {
                self.motion = chunk.motion_id;
                (self.due_index, self.played, self.has_last) = (0, 0, false);
                (self.activity, self.status) = (Activity::Playing, MotionStatus::Playing);
                self.append(chunk);
                Some(Remark::Began { motion: self.motion })
            }
            Err(why) => {
                self.dropped.note(chunk.motion_id);
                if self.activity == Activity::Holding {
                    (self.motion, self.played, self.status) = (chunk.motion_id, 0, MotionStatus::Refused);
                }
                Some(Remark::Refused { motion: chunk.motion_id, why })
            }
        }
    }

    /// A chunk that was sent before a stop which overtook it: it is not played. Returns what there is to say about a motion
    /// that was to begin with it.
    pub fn discard(&mut self, chunk: &MotionChunk) -> Option<Remark> {
        let motion = chunk.motion_id;
        if motion == 0 || motion == self.motion || self.is_dropped(motion) {
            return None;
        }
        self.dropped.note(motion);
        if self.activity == Activity::Holding {
            (self.motion, self.played, self.status) = (motion, 0, MotionStatus::Braked);
        }
        Some(Remark::Braked { motion, why: BrakeReason::Asked })
    }

    fn is_dropped(&self, motion: u64) -> bool {
        let braked = self.status == MotionStatus::Braked && motion == self.motion;
        motion != 0 && (braked || self.dropped.has(&motion))
    }

    /// Brakes what is being played, or the way back to where the arm is held, which is not reported; nothing when it rests.
    /// One that was asked for counts at rest, too: what is being sent does not begin after it.
    pub fn stop(&mut self, why: BrakeReason) -> Option<Remark> {
        if why == BrakeReason::Asked {
            self.silence.begin();
        }
        let played = matches!(self.activity, Activity::Playing | Activity::Following);
        if self.is_at_rest() || self.activity == Activity::Braking {
            return None;
        }
        self.brake.begin(&self.trace);
        self.activity = Activity::Braking;
        if !played {
            return None;
        }
        self.queue.clear();
        self.status = MotionStatus::Braked;
        self.dropped.note(self.motion);
        Some(Remark::Braked { motion: self.motion, why })
    }

    /// The arm is no longer commanded: forgets what was queued and refuses what comes. Who sends on meanwhile does not move the
    /// arm when it is commanded again.
    pub fn halt(&mut self) -> Option<Remark> {
        let was_moving = !self.is_at_rest();
        self.queue.clear();
        self.silence.begin();
        self.activity = Activity::Halted;
        was_moving.then(|| {
            self.status = MotionStatus::Braked;
            self.dropped.note(self.motion);
            Remark::Braked { motion: self.motion, why: BrakeReason::ArmStopped }
        })
    }

    /// The set point of this cycle.
    pub fn advance(&mut self) -> (SetPoint, Option<Remark>) {
        self.silence.step();
        self.before = self.trace;
        match self.activity {
            Activity::Holding if !self.ease.is_over() => (self.settle(), None),
            Activity::Holding | Activity::Halted => (self.hold(), None),
            Activity::Braking => (self.braked(), None),
            Activity::Playing => self.play(),
            Activity::Following => self.follow(),
        }
    }

    /// Writes the motion's progress into a state.
    pub fn report(&self, state: &mut ArmState) {
        state.motion_id = self.motion;
        state.motion_played = self.played;
        state.motion_queued = u32::try_from(self.queue.len).unwrap_or(u32::MAX);
        state.motion = self.status;
    }

    fn play(&mut self) -> (SetPoint, Option<Remark>) {
        let (mut point, at_end) = match self.queue.pop() {
            Some(point) => (point, false),
            None if self.has_last => (SetPoint { q_d: self.planned.q, dq_d: [0.0; MAX_JOINTS] }, self.ease.is_over()),
            None => {
                let remark = self.stop(BrakeReason::Underrun);
                return (self.braked(), remark);
            }
        };
        self.planned = self.planned.after(&point.q_d, self.guard.period_s);
        self.ease_back(&mut point);
        match self.guard.check(&self.trace, &point, &self.outside, self.arm.as_ref()) {
            Ok(_) if at_end => {
                (self.activity, self.status) = (Activity::Holding, MotionStatus::Done);
                self.planned = Trace::at_rest(self.planned.q);
                self.rest();
                (self.hold(), Some(Remark::Done { motion: self.motion }))
            }
            Ok(next) => {
                self.trace = next;
                self.played += 1;
                (point, None)
            }
            Err(violation) => {
                let why = if at_end { BrakeReason::EndsMoving } else { BrakeReason::Limit(violation) };
                let remark = self.stop(why);
                (self.braked(), remark)
            }
        }
    }

    /// Holds, and is not yet where it is held.
    fn settle(&mut self) -> SetPoint {
        let mut point = SetPoint { q_d: self.planned.q, dq_d: [0.0; MAX_JOINTS] };
        self.ease_back(&mut point);
        match self.guard.check(&self.trace, &point, &self.outside, self.arm.as_ref()) {
            Ok(next) => {
                self.trace = next;
                if self.ease.is_over() {
                    self.rest();
                }
                point
            }
            Err(violation) => {
                self.stop(BrakeReason::Limit(violation));
                self.braked()
            }
        }
    }

    /// Adds to a planned set point what the arm is still off.
    fn ease_back(&mut self, point: &mut SetPoint) {
        if self.ease.is_over() {
            return;
        }
        let [q, dq] = self.ease.step(self.guard.period_s);
        for i in 0..self.guard.limits.dof {
            point.q_d[i] += q[i];
            point.dq_d[i] += dq[i];
        }
    }

    fn braked(&mut self) -> SetPoint {
        let step = self.brake.step();
        self.trace = self.trace.after(&step.point.q_d, self.guard.period_s);
        if step.at_rest {
            self.activity = Activity::Holding;
            (self.planned, self.ease) = (Trace::at_rest(self.trace.q), Ease::over());
            self.rest();
        }
        step.point
    }

    /// The arm came to rest where it is commanded to be.
    fn rest(&mut self) {
        self.outside = self.guard.workspace.outside_after(&self.trace.q, &self.outside);
    }

    fn hold(&mut self) -> SetPoint {
        self.trace = Trace::at_rest(self.trace.q);
        SetPoint { q_d: self.trace.q, dq_d: [0.0; MAX_JOINTS] }
    }

    fn startable(&self, chunk: &MotionChunk) -> Result<(), Refusal> {
        match self.activity {
            Activity::Halted => return Err(Refusal::NotCommanded),
            _ if !self.silence.is_over() => return Err(Refusal::Stopped),
            Activity::Holding => {}
            Activity::Playing | Activity::Following | Activity::Braking => {
                return Err(Refusal::Busy { playing: self.motion });
            }
        }
        if chunk.motion_id == 0 {
            return Err(Refusal::NoId);
        }
        self.acceptable(chunk, 0)?;
        let first = chunk.set_points[0].q_d;
        for (i, (first, now)) in first.iter().zip(&self.planned.q).enumerate().take(self.guard.limits.dof) {
            if (first - now).abs() > START_TOLERANCE {
                return Err(Refusal::StartsElsewhere { joint: u8::try_from(i + 1).unwrap_or(u8::MAX) });
            }
        }
        Ok(())
    }

    fn acceptable(&self, chunk: &MotionChunk, due: u32) -> Result<(), Refusal> {
        let has = u32::try_from(self.guard.limits.dof).unwrap_or(u32::MAX);
        if chunk.index != due {
            return Err(Refusal::Gap { due, came: chunk.index });
        }
        if chunk.dof != has {
            return Err(Refusal::Dof { came: chunk.dof, has });
        }
        let Some(points) = chunk.set_points.get(..chunk.length as usize) else { return Err(Refusal::Length) };
        let finite = |values: &Joints| values.iter().all(|x| x.is_finite());
        if points.iter().all(|p| finite(&p.q_d) && finite(&p.dq_d)) { Ok(()) } else { Err(Refusal::NotFinite) }
    }

    fn append(&mut self, chunk: &MotionChunk) {
        for point in chunk.set_points.iter().take(chunk.length as usize) {
            self.queue.push(point);
        }
        self.due_index += 1;
        self.has_last |= chunk.kind == MotionKind::Last;
    }
}
