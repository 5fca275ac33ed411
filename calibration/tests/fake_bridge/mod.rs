//! A bridge without a robot, in a thread, over real shared memory: it plays what it is sent perfectly, or misbehaves as told.

use shared_mem::msg::arm::{ArmMode, ArmState, MotionStatus};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::motion::{MotionChunk, MotionKind, STOP_SILENCE_NS, SetPoint};
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_MOTION, ARM_STATE, EVENTS};
use shared_mem::transport::{Node, Publisher, Subscriber};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// After a stop it begins nothing before nobody has sent for so long.
const SILENCE: Duration = Duration::from_nanos(STOP_SILENCE_NS);

/// How the bridge misbehaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Not at all.
    None,
    /// Refuses every motion.
    Refuse,
    /// Brakes after so many set points.
    BrakeAfter(u32),
    /// Stops publishing after so many set points.
    DieAfter(u32),
    /// Counts as another bridge after so many set points.
    RestartAfter(u32),
    /// Takes no motion up.
    Deaf,
    /// Stops itself after so many set points of every motion.
    ReflexAfter(u32),
}

/// The running fake; ends when dropped.
pub(crate) struct FakeBridge {
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<Vec<SetPoint>>>,
}

impl FakeBridge {
    /// Starts it in `domain`, in `mode`, holding `start`.
    pub(crate) fn start(domain: &str, mode: ArmMode, start: [f64; 8], fault: Fault) -> Self {
        let end = Arc::new(AtomicBool::new(false));
        let (ready, is_ready) = mpsc::channel();
        let (domain, flag) = (domain.to_owned(), Arc::clone(&end));
        let thread = std::thread::spawn(move || {
            let mut bridge = Fake::open(&domain, mode, start, fault);
            ready.send(()).expect("the test waits");
            while !flag.load(Ordering::Relaxed) {
                bridge.cycle();
                std::thread::sleep(Duration::from_micros(500));
            }
            bridge.played
        });
        is_ready.recv().expect("the fake opens shared memory");
        Self { end, thread: Some(thread) }
    }

    /// Ends it and returns every set point that was played.
    pub(crate) fn finish(mut self) -> Vec<SetPoint> {
        self.end.store(true, Ordering::Relaxed);
        self.thread.take().expect("not yet finished").join().expect("no panic in the fake")
    }
}

impl Drop for FakeBridge {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
    }
}

struct Fake {
    states: Publisher<ArmState>,
    events: Publisher<Event>,
    motions: Subscriber<MotionChunk>,
    fault: Fault,
    state: ArmState,
    queue: VecDeque<SetPoint>,
    complete: bool,
    played: Vec<SetPoint>,
    /// When a stop came, or anything after it.
    stopped: Option<Instant>,
    _node: Node,
}

impl Fake {
    fn open(domain: &str, mode: ArmMode, start: [f64; 8], fault: Fault) -> Self {
        let node = Node::open_in(domain, "fake bridge").expect("shared memory");
        Self {
            states: node.publisher(ARM_STATE).expect("a publisher"),
            events: node.publisher(EVENTS).expect("a publisher"),
            motions: node.subscriber(ARM_MOTION).expect("a subscriber"),
            fault,
            state: ArmState { dof: 7, mode, q: start, q_d: start, session: 1, ..ArmState::default() },
            queue: VecDeque::new(),
            complete: false,
            played: Vec::new(),
            stopped: None,
            _node: node,
        }
    }

    /// One control cycle: accept, play one set point, report.
    fn cycle(&mut self) {
        while let Some(chunk) = self.motions.receive().expect("shared memory") {
            self.accept(&chunk);
        }
        if self.state.motion == MotionStatus::Playing {
            self.advance();
        }
        self.state.cycle += 1;
        self.state.device_ns += 1_000_000;
        self.state.stamp_ns = now_ns();
        self.state.motion_queued = self.queue.len() as u32;
        let dead = matches!(self.fault, Fault::DieAfter(n) if self.state.motion_played >= n);
        if !dead {
            self.states.send(&self.state).expect("shared memory");
        }
    }

    fn accept(&mut self, chunk: &MotionChunk) {
        if self.fault == Fault::Deaf {
            return;
        }
        if chunk.kind == MotionKind::Recover {
            assert_eq!(self.state.mode, ArmMode::Reflex, "nobody recovers a robot that is well");
            self.state.mode = ArmMode::Move;
            return;
        }
        if self.state.mode == ArmMode::Reflex {
            return;
        }
        if chunk.motion_id != self.state.motion_id {
            assert_eq!(chunk.index, 0, "chunks are numbered from 0");
            self.state.motion_id = chunk.motion_id;
            self.state.motion = MotionStatus::Playing;
            self.state.motion_played = 0;
            self.complete = false;
            if self.fault == Fault::Refuse {
                self.state.motion = MotionStatus::Refused;
                self.say("set point 0: joint 2 is too fast");
            }
            if self.stopped.is_some_and(|stopped| stopped.elapsed() < SILENCE) {
                self.state.motion = MotionStatus::Refused;
                self.say("the arm was stopped, and nothing begins before a silence");
            }
        }
        if chunk.kind == MotionKind::Stop || self.stopped.is_some_and(|stopped| stopped.elapsed() < SILENCE) {
            self.stopped = Some(Instant::now());
        }
        match chunk.kind {
            MotionKind::Stop => self.brake("stopped on request"),
            MotionKind::Last => self.complete = true,
            MotionKind::Play | MotionKind::Recover => {}
        }
        self.queue.extend(&chunk.set_points[..chunk.length as usize]);
        assert!(self.queue.len() <= 600, "the sender keeps at most a few hundred milliseconds queued");
    }

    fn advance(&mut self) {
        let Some(point) = self.queue.pop_front() else {
            if self.complete {
                self.state.motion = MotionStatus::Done;
            } else {
                self.brake("set points ran out");
            }
            return;
        };
        (self.state.q, self.state.q_d) = (point.q_d, point.q_d);
        (self.state.dq, self.state.dq_d) = (point.dq_d, point.dq_d);
        self.state.motion_played += 1;
        self.played.push(point);
        match self.fault {
            Fault::BrakeAfter(n) if self.state.motion_played == n => self.brake("joint 4 too fast"),
            Fault::RestartAfter(n) if self.state.motion_played == n => self.state.session += 1,
            Fault::ReflexAfter(n) if self.state.motion_played == n => {
                self.state.mode = ArmMode::Reflex;
                let error = "the robot stopped itself (cartesian_reflex); start again";
                self.events.send(&Event::new(EventLevel::Error, EventSource::Bridge, error)).expect("shared memory");
                self.brake("the arm is no longer under command");
            }
            _ => {}
        }
    }

    fn brake(&mut self, why: &str) {
        self.state.motion = MotionStatus::Braked;
        self.state.dq_d = [0.0; 8];
        self.queue.clear();
        self.say(why);
    }

    fn say(&self, text: &str) {
        self.events.send(&Event::new(EventLevel::Warning, EventSource::Bridge, text)).expect("shared memory");
    }
}
