//! From the control thread's rings to shared memory and back, below the priorities of control and simulation: the only
//! thread of a run that owns the arm's ports. It is woken by each beat, and looks by itself every few milliseconds for
//! motions to hand on.

use crate::remark::Remark;
use crate::rt::cycle::Beat;
use crate::rt::orders::OrderSender;
use crate::rt::process;
use crate::sighting::{PosePorts, Sighting};
use crate::starting::{self, ThreadError};
use crate::targets::Targets;
use crate::times::Times;
use rtrb::Consumer;
use shared_mem::msg::arm::{ArmCommand, ArmState};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::motion::{MotionChunk, MotionKind};
use shared_mem::msg::object::ObjectPose;
use shared_mem::msg::origin::ArmOrigin;
use shared_mem::msg::target::ArmTarget;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, Subscriber, TransportError};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle, Thread};
use std::time::{Duration, Instant};

/// Longest sleep between two looks: a motion's first chunk waits no longer than this.
const LONGEST_SLEEP: Duration = Duration::from_millis(5);
/// Looks at a pump that goes no round before it counts as hung. They are counted and not timed: a process that was stopped
/// and goes on, or a machine that slept, is no fault of the pump.
const STILL_LOOKS: u32 = 300;
/// How long a pump may take to publish what is left: milliseconds, unless it stands still.
const FINISH_PATIENCE: Duration = Duration::from_secs(5);

/// Chunks that are taken in before states are published again: as many as wait at most.
const LOOKS: usize = topics::ARM_MOTION.limits.buffer * topics::ARM_MOTION.limits.publishers;

/// Targets that are taken in before states are published again: as many as wait at most.
const TARGETS: usize = topics::ARM_TARGET.limits.buffer * topics::ARM_TARGET.limits.publishers;

/// The pump's ends of the rings.
#[derive(Debug)]
pub struct Rings {
    /// From the control thread.
    pub beats: Consumer<Beat>,
    /// From the control thread.
    pub remarks: Consumer<Remark>,
    /// To the control thread.
    pub orders: OrderSender,
    /// Turns targets into joints.
    pub targets: Targets,
    /// From the simulated tracker, where there is one.
    pub poses: Option<Consumer<Sighting>>,
    /// Which arm the states are of.
    pub origin: ArmOrigin,
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

/// The pump could not start, or did not run to its end.
#[derive(Debug, thiserror::Error)]
pub enum PumpError {
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// It stands still.
    #[error(
        "states are no longer published: the thread `pump` stands still; look at the machine's load and memory, then start again"
    )]
    Hung,
}

/// The running pump.
#[derive(Debug)]
pub struct Pump {
    handle: JoinHandle<Result<PumpReport, TransportError>>,
    stop: Arc<AtomicBool>,
    watchdog: Watchdog,
    /// It once did.
    stood_still: bool,
}

/// A watchdog of another thread: whether its count of cycles still grows.
#[derive(Debug, Default)]
struct Watchdog {
    /// Cycles, counted by the thread.
    count: Arc<AtomicU64>,
    /// Cycles at the last look.
    seen: u64,
    /// Looks since it last grew.
    still: u32,
}

impl Watchdog {
    /// `true` while it grew not too many looks ago.
    fn look(&mut self) -> bool {
        let count = self.count.load(Ordering::Relaxed);
        self.still = if count == self.seen { self.still.saturating_add(1) } else { 0 };
        self.seen = count;
        self.still < STILL_LOOKS
    }
}

struct Ports {
    state: Publisher<ArmState>,
    command: Publisher<ArmCommand>,
    events: Publisher<Event>,
    objects: Option<PosePorts>,
    motion: Subscriber<MotionChunk>,
    target: Subscriber<ArmTarget>,
}

impl Pump {
    /// Starts the pump and waits until its ports are open.
    ///
    /// # Errors
    /// [`TransportError::Full`] when another bridge runs, other variants when shared memory fails, [`ThreadError`] when
    /// the operating system cannot make a thread.
    pub fn start(rings: Rings) -> Result<Self, PumpError> {
        let (stop, watchdog) = (Arc::new(AtomicBool::new(false)), Watchdog::default());
        let (stopping, count) = (stop.clone(), watchdog.count.clone());
        let body = move |opened: mpsc::Sender<Result<(), PumpError>>| {
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
                    let _gone = opened.send(Err(e.into()));
                    return Ok(PumpReport::default());
                }
            };
            let _gone = opened.send(Ok(()));
            let report = run(rings, &node, &ports, &stopping, &count);
            drop(node);
            report
        };
        let handle = starting::start("pump", body)?;
        Ok(Self { handle, stop, watchdog, stood_still: false })
    }

    /// The thread, to wake it.
    pub fn thread(&self) -> Thread {
        self.handle.thread().clone()
    }

    /// `false` when the pump has ended by itself, or stands still: nobody sees the arm any more. Asked about a hundred
    /// times a second.
    pub fn is_well(&mut self) -> bool {
        let goes_on = self.watchdog.look();
        self.stood_still |= !goes_on && !self.handle.is_finished();
        goes_on && !self.handle.is_finished()
    }

    /// Publishes what is left and ends.
    ///
    /// # Errors
    /// [`TransportError`] when shared memory failed on the way, [`ThreadError`] when the pump panicked,
    /// [`PumpError::Hung`] when it does not end; its thread is then left to itself.
    pub fn finish(self) -> Result<PumpReport, PumpError> {
        self.finish_within(FINISH_PATIENCE)
    }

    fn finish_within(self, patience: Duration) -> Result<PumpReport, PumpError> {
        self.stop.store(true, Ordering::Release);
        self.handle.thread().unpark();
        let begin = Instant::now();
        while !self.handle.is_finished() {
            if begin.elapsed() > patience {
                return Err(PumpError::Hung);
            }
            thread::sleep(Duration::from_millis(1));
        }
        let mut report = self.handle.join().map_err(|_| ThreadError::Failed { name: "pump" })??;
        // It came back, but too late: the run was ended because of it.
        report.faults.extend(self.stood_still.then(|| PumpError::Hung.to_string()));
        Ok(report)
    }
}

fn open(tracks: bool) -> Result<(Node, Ports), TransportError> {
    let node = Node::open("rt_bridge_pump")?;
    let ports = Ports {
        state: node.publisher(topics::ARM_STATE)?,
        command: node.publisher(topics::ARM_COMMAND)?,
        events: node.publisher(topics::EVENTS)?,
        objects: tracks.then(|| PosePorts::open(&node)).transpose()?,
        motion: node.subscriber(topics::ARM_MOTION)?,
        target: node.subscriber(topics::ARM_TARGET)?,
    };
    Ok((node, ports))
}

fn run(
    mut rings: Rings,
    node: &Node,
    ports: &Ports,
    stop: &AtomicBool,
    count: &AtomicU64,
) -> Result<PumpReport, TransportError> {
    let mut report = PumpReport::default();
    let mut state = ArmState::default();
    loop {
        count.fetch_add(1, Ordering::Relaxed);
        let last_round = stop.load(Ordering::Acquire);
        publish(&mut rings, ports, &mut report, &mut state)?;
        if last_round {
            return Ok(report);
        }
        rings.orders.hand_on();
        for _ in 0..LOOKS {
            // Everything that came is taken in at once, so that a stop does not wait behind a motion. A chunk too many is
            // dropped; the control thread finds it missing and says so.
            let Some(chunk) = ports.motion.receive()? else { break };
            if chunk.kind == MotionKind::Stop {
                rings.targets.forget();
            }
            let _fitted = rings.orders.send(&chunk);
        }
        aim(&mut rings, ports, &state)?;
        for ignored in node.newly_ignored() {
            say(ports, EventLevel::Warning, &ignored.to_string())?;
        }
        if rings.beats.is_empty() {
            ports.events.greet_new_readers()?;
            thread::park_timeout(LONGEST_SLEEP);
        }
    }
}

/// Hands targets on. Nobody knows where the arm is before its first state.
fn aim(rings: &mut Rings, ports: &Ports, state: &ArmState) -> Result<(), TransportError> {
    for _ in 0..TARGETS {
        let Some(target) = ports.target.receive()? else { break };
        rings.targets.keep(&target, state);
    }
    if state.cycle == 0 {
        rings.targets.forget();
    }
    for text in rings.targets.hand_on(state, |target| rings.orders.aim(target)) {
        say(ports, EventLevel::Warning, &text)?;
    }
    Ok(())
}

/// The last state published is left in `last`.
fn publish(
    rings: &mut Rings,
    ports: &Ports,
    report: &mut PumpReport,
    last: &mut ArmState,
) -> Result<(), TransportError> {
    while let Ok(beat) = rings.beats.pop() {
        // Of a recording that is played back, each state may say something else.
        *last = ArmState { origin: rings.origin, ..beat.state };
        if let Some(command) = &beat.command {
            ports.command.send_quietly(command)?;
        }
        ports.state.send(last)?;
        report.age.record(now_ns().saturating_sub(last.stamp_ns));
    }
    if let (Some(poses), Some(objects)) = (&mut rings.poses, &ports.objects) {
        while let Ok(Sighting { is_first, name, pose }) = poses.pop() {
            objects.send(&Sighting { is_first, name, pose: ObjectPose { stamp_ns: now_ns(), ..pose } })?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pump_that_goes_no_round_is_noticed_and_one_that_goes_on_is_well_again() {
        let mut watchdog = Watchdog::default();
        for _ in 0..2 {
            watchdog.count.fetch_add(1, Ordering::Relaxed);
            assert!((0..STILL_LOOKS).all(|_| watchdog.look()));
            assert!(!watchdog.look(), "it has not moved for {STILL_LOOKS} looks");
        }
    }

    /// A pump whose thread runs `body`.
    fn pump(body: impl FnOnce() -> Result<PumpReport, TransportError> + Send + 'static) -> Pump {
        Pump {
            handle: thread::spawn(body),
            stop: Arc::new(AtomicBool::new(false)),
            watchdog: Watchdog::default(),
            stood_still: false,
        }
    }

    #[test]
    fn a_pump_that_hangs_or_panics_is_an_error_and_takes_nobody_along() {
        let (release, held) = mpsc::channel::<()>();
        let hung = pump(move || {
            let _released = held.recv();
            Ok(PumpReport::default())
        });
        assert!(matches!(hung.finish_within(Duration::from_millis(10)), Err(PumpError::Hung)));
        drop(release);
        let (release, held) = mpsc::channel::<()>();
        let mut late = pump(move || {
            let _released = held.recv();
            Ok(PumpReport::default())
        });
        assert!((0..STILL_LOOKS).any(|_| !late.is_well()));
        drop(release);
        let faults = late.finish_within(Duration::from_secs(60)).expect("it ends").faults;
        assert_eq!(faults, [PumpError::Hung.to_string()], "the run was ended, so it has to say why");
        let failed = pump(|| panic!("on purpose")).finish_within(Duration::from_secs(60));
        assert!(matches!(failed, Err(PumpError::Thread(ThreadError::Failed { name: "pump" }))), "{failed:?}");
    }
}
