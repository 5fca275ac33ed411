//! From the control thread's rings to shared memory and back, below the priorities of control and simulation: the only
//! thread of a run that owns the arm's ports. It is woken by each beat, and looks by itself every few milliseconds for
//! motions to hand on.

use crate::rt::cycle::Beat;
use crate::rt::orders::OrderSender;
use crate::rt::process;
use crate::rt::remark::Remark;
use crate::times::Times;
use rtrb::Consumer;
use shared_mem::msg::arm::{ArmCommand, ArmState};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::motion::MotionChunk;
use shared_mem::msg::object::ObjectPose;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, Subscriber, TransportError};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

/// Longest sleep between two looks: a motion's first chunk waits no longer than this.
const LONGEST_SLEEP: Duration = Duration::from_millis(5);

/// Chunks that are taken in before states are published again: as many as wait at most.
const LOOKS: usize = topics::ARM_MOTION.limits.buffer * topics::ARM_MOTION.limits.publishers;

/// The pump's ends of the rings.
#[derive(Debug)]
pub struct Rings {
    /// From the control thread.
    pub beats: Consumer<Beat>,
    /// From the control thread.
    pub remarks: Consumer<Remark>,
    /// To the control thread.
    pub orders: OrderSender,
    /// From the simulated tracker, where there is one.
    pub poses: Option<Consumer<ObjectPose>>,
    /// From the main thread and the devices: texts for `/events`.
    pub notices: mpsc::Receiver<Notice>,
}

/// A text for `/events` and the log.
#[derive(Debug, Clone)]
pub struct Notice {
    /// How serious it is.
    pub level: EventLevel,
    /// What to say.
    pub text: String,
}

/// What the pump knows at the end.
#[derive(Debug, Default)]
pub struct PumpReport {
    /// From a state's `stamp_ns` to its lying on shared memory.
    pub age: Times,
    /// Faults of the arm, in words.
    pub faults: Vec<String>,
}

/// The running pump.
#[derive(Debug)]
pub struct Pump {
    handle: JoinHandle<Result<PumpReport, TransportError>>,
    stop: Arc<AtomicBool>,
}

struct Ports {
    state: Publisher<ArmState>,
    command: Publisher<ArmCommand>,
    events: Publisher<Event>,
    object: Option<Publisher<ObjectPose>>,
    motion: Subscriber<MotionChunk>,
}

impl Pump {
    /// Starts the pump and waits until its ports are open.
    ///
    /// # Errors
    /// [`TransportError::Full`] when another bridge runs, other variants when shared memory fails.
    ///
    /// # Panics
    /// When the operating system cannot make a thread.
    pub fn start(rings: Rings) -> Result<Self, TransportError> {
        let stop = Arc::new(AtomicBool::new(false));
        let (opened, wait) = mpsc::channel();
        let told = stop.clone();
        let body = move || {
            // Just above ordinary threads: the camera's rendering would make states late by milliseconds otherwise. Where
            // it is not granted, states are as fresh as the scheduler lets them be.
            let _not_granted = process::set_fifo(process::PUMP_PRIORITY);
            // On the control thread's core it starts the moment that thread sleeps: waking another core takes longer,
            // and there the simulated world would be in its way.
            let _bound = process::last_core().map(process::pin_to);
            // iceoryx2's ports belong to the thread that makes them.
            let (node, ports) = match open(rings.poses.is_some()) {
                Ok(open) => open,
                Err(e) => {
                    let _gone = opened.send(Err(e));
                    return Ok(PumpReport::default());
                }
            };
            let _gone = opened.send(Ok(()));
            let report = run(rings, &node, &ports, &told);
            drop(node);
            report
        };
        let handle = thread::Builder::new().name("pump".into()).spawn(body).expect("threads can be made");
        wait.recv().expect("the pump answers before it ends")?;
        Ok(Self { handle, stop })
    }

    /// The thread, to wake it.
    #[must_use]
    pub fn thread(&self) -> Thread {
        self.handle.thread().clone()
    }

    /// `true` when the pump ended by itself: shared memory failed.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.handle.is_finished()
    }

    /// Publishes what is left and ends.
    ///
    /// # Errors
    /// [`TransportError`] when shared memory failed on the way.
    ///
    /// # Panics
    /// When the pump panicked.
    pub fn finish(self) -> Result<PumpReport, TransportError> {
        self.stop.store(true, Ordering::Release);
        self.handle.thread().unpark();
        self.handle.join().expect("the pump does not panic")
    }
}

fn open(tracks: bool) -> Result<(Node, Ports), TransportError> {
    let node = Node::open("rt_bridge_pump")?;
    let ports = Ports {
        state: node.publisher(topics::ARM_STATE)?,
        command: node.publisher(topics::ARM_COMMAND)?,
        events: node.publisher(topics::EVENTS)?,
        object: tracks.then(|| node.publisher(topics::OBJECT_POSE)).transpose()?,
        motion: node.subscriber(topics::ARM_MOTION)?,
    };
    Ok((node, ports))
}

fn run(mut rings: Rings, node: &Node, ports: &Ports, stop: &AtomicBool) -> Result<PumpReport, TransportError> {
    let mut report = PumpReport::default();
    loop {
        let last_round = stop.load(Ordering::Acquire);
        publish(&mut rings, ports, &mut report)?;
        if last_round {
            return Ok(report);
        }
        rings.orders.hand_on();
        for _ in 0..LOOKS {
            // Everything that came is taken in at once, so that a stop does not wait behind a motion. A chunk too many is
            // dropped; the control thread finds it missing and says so.
            let Some(chunk) = ports.motion.receive()? else { break };
            let _fitted = rings.orders.send(&chunk);
        }
        for ignored in node.newly_ignored() {
            say(ports, EventLevel::Warning, &ignored.to_string())?;
        }
        if rings.beats.is_empty() {
            ports.events.greet_new_readers()?;
            thread::park_timeout(LONGEST_SLEEP);
        }
    }
}

fn publish(rings: &mut Rings, ports: &Ports, report: &mut PumpReport) -> Result<(), TransportError> {
    while let Ok(beat) = rings.beats.pop() {
        if let Some(command) = &beat.command {
            ports.command.send_quietly(command)?;
        }
        ports.state.send(&beat.state)?;
        report.age.record(now_ns().saturating_sub(beat.state.stamp_ns));
    }
    if let (Some(poses), Some(object)) = (&mut rings.poses, &ports.object) {
        while let Ok(pose) = poses.pop() {
            object.send(&ObjectPose { stamp_ns: now_ns(), ..pose })?;
        }
    }
    while let Ok(remark) = rings.remarks.pop() {
        let text = remark.to_string();
        say(ports, remark.level(), &text)?;
        if matches!(remark, Remark::Fault(_)) {
            report.faults.push(text);
        }
    }
    while let Ok(notice) = rings.notices.try_recv() {
        say(ports, notice.level, &notice.text)?;
    }
    Ok(())
}

fn say(ports: &Ports, level: EventLevel, text: &str) -> Result<(), TransportError> {
    match level {
        EventLevel::Info => tracing::info!("{text}"),
        EventLevel::Warning => tracing::warn!("{text}"),
        EventLevel::Error => tracing::error!("{text}"),
    }
    ports.events.send(&Event::new(level, EventSource::Bridge, text))
}
