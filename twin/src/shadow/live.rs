//! The shadow on shared memory: sleeps until the bridge sends a state, mirrors it, sends prediction and gap on. The
//! bridge may come later, go away and come back; what happens is reported to a [`Watcher`].

use super::{MirrorError, Mirrored, ObjectEvent, Shadow};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::object::{NamedPose, ObjectPose};
use shared_mem::msg::twin::{TwinGap, TwinObject, TwinState};
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_STATE, OBJECT_POSE, OBJECT_POSES, TWIN_GAP, TWIN_OBJECTS, TWIN_STATE};
use shared_mem::transport::{Node, Publisher, Subscriber, TransportError, Wake};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use thread_priority::{RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy};

/// A state older than this on arrival means that the twin cannot keep up [ns].
const TOO_OLD_NS: u64 = 250_000_000;
/// Without a state for so long the bridge counts as silent.
const SILENCE: Duration = Duration::from_secs(1);
/// How long a sleep may last: how soon a stop is noticed.
const NAP: Duration = Duration::from_millis(100);
/// How often what dead processes left behind is cleared away.
const HOUSEKEEPING: Duration = Duration::from_secs(1);

/// Priority under `SCHED_FIFO`: below everything in the bridge (40 and more), above a camera that renders.
const PRIORITY: u8 = 20;

/// Who wants to know what happens.
pub trait Watcher {
    /// Something happened that a person should read.
    fn remark(&mut self, text: &str);
    /// No state came for a second; `patience`: how long the first one is waited for from the start on, `None` where the
    /// bridge was there and went.
    fn silent(&mut self, patience: Option<Duration>);
    /// The newest prediction and gap; called for every state.
    fn mirrored(&mut self, mirrored: &Mirrored);
}

/// The shadow stopped because it cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The bridge drives another arm.
    #[error(transparent)]
    Mirror(#[from] MirrorError),
}

/// The shadow's places on shared memory.
pub struct Live {
    node: Node,
    states: Subscriber<ArmState>,
    poses: Subscriber<ObjectPose>,
    named: Subscriber<NamedPose>,
    wake: Wake,
    predictions: Publisher<TwinState>,
    gaps: Publisher<TwinGap>,
    objects: Publisher<TwinObject>,
    /// Time spent computing and sending [s].
    busy_s: f64,
}

impl Live {
    /// Takes the places. The bridge need not run yet.
    ///
    /// # Errors
    /// [`TransportError`] when shared memory fails or another shadow runs in this domain.
    pub fn open() -> Result<Self, TransportError> {
        let node = Node::open("twin_shadow")?;
        Ok(Self {
            states: node.subscriber(ARM_STATE)?,
            poses: node.subscriber(OBJECT_POSE)?,
            named: node.subscriber(OBJECT_POSES)?,
            wake: node.wake_on(ARM_STATE.name)?,
            predictions: node.publisher(TWIN_STATE)?,
            gaps: node.publisher(TWIN_GAP)?,
            objects: node.publisher(TWIN_OBJECTS)?,
            node,
            busy_s: 0.0,
        })
    }

    /// Mirrors until `stop` is set, `duration` has passed, or no state came at all within `patience`. Answers with the time
    /// spent computing [s]; whether anything was mirrored, the shadow's summary tells.
    ///
    /// # Errors
    /// [`LiveError`] when shared memory fails or the bridge drives another arm.
    pub fn run(
        &mut self,
        shadow: &mut Shadow,
        (patience, duration): (Duration, Option<Duration>),
        stop: &AtomicBool,
        watcher: &mut dyn Watcher,
    ) -> Result<f64, LiveError> {
        ask_for_priority();
        let start = Instant::now();
        let (mut heard, mut silent, mut cleaned) = (None, false, start);
        while !stop.load(Ordering::Relaxed) && duration.is_none_or(|d| start.elapsed() < d) {
            if heard.is_none() && start.elapsed() > patience {
                break;
            }
            self.wake.wait(NAP)?;
            if self.mirror_all(shadow, watcher)? {
                (heard, silent) = (Some(Instant::now()), false);
            } else if !silent && heard.unwrap_or(start).elapsed() > SILENCE {
                silent = true;
                watcher.silent(heard.is_none().then_some(patience));
            }
            if cleaned.elapsed() > HOUSEKEEPING {
                cleaned = Instant::now();
                self.node.clear_dead_nodes();
                self.predictions.greet_new_readers()?;
                self.gaps.greet_new_readers()?;
                self.objects.greet_new_readers()?;
                for ignored in self.node.newly_ignored() {
                    watcher.remark(&ignored.to_string());
                }
            }
        }
        Ok(self.busy_s)
    }

    /// Everything that has arrived; `false` when there was nothing.
    fn mirror_all(&mut self, shadow: &mut Shadow, watcher: &mut dyn Watcher) -> Result<bool, LiveError> {
        let mut any = false;
        while let Some(state) = self.states.receive()? {
            any = true;
            let arrived_ns = now_ns();
            let age_ns = arrived_ns.saturating_sub(state.stamp_ns);
            if age_ns > TOO_OLD_NS {
                shadow.fell_behind(1);
                continue;
            }
            if let Some(mut mirrored) = shadow.on_state(&state, age_ns)? {
                self.send(&mut mirrored)?;
                if let Some(event) = mirrored.event {
                    watcher.remark(&event.to_string());
                }
                watcher.mirrored(&mirrored);
            }
            self.mirror_objects(shadow, watcher)?;
            self.busy_s += now_ns().saturating_sub(arrived_ns) as f64 * 1e-9;
        }
        Ok(any)
    }

    /// What the tracker says about objects.
    fn mirror_objects(&self, shadow: &mut Shadow, watcher: &mut dyn Watcher) -> Result<(), TransportError> {
        while let Some(pose) = self.poses.receive()? {
            let event = shadow.on_object(&pose);
            self.tell(shadow, 0, event, watcher)?;
        }
        while let Some(pose) = self.named.receive()? {
            if let Some((number, event)) = shadow.on_named(&pose) {
                self.tell(shadow, number, event, watcher)?;
            }
        }
        Ok(())
    }

    /// Sends an object's gap, and tells what happened to it.
    fn tell(
        &self,
        shadow: &Shadow,
        number: usize,
        event: Option<ObjectEvent>,
        watcher: &mut dyn Watcher,
    ) -> Result<(), TransportError> {
        if let Some(object) = shadow.twin_object(number) {
            self.objects.send(&TwinObject { stamp_ns: now_ns(), ..object })?;
        }
        let name = shadow.name(number);
        let object = if name.is_empty() { "the object".to_owned() } else { format!("`{}`", name.text()) };
        match event {
            Some(ObjectEvent::Found) => watcher.remark(&format!("{object} is tracked; the twin's stands where it is")),
            Some(ObjectEvent::Rests) => watcher.remark(&format!("{object} rests; the twin's was set onto it")),
            None => {}
        }
        Ok(())
    }

    fn send(&self, mirrored: &mut Mirrored) -> Result<(), TransportError> {
        mirrored.state.stamp_ns = now_ns();
        mirrored.gap.stamp_ns = mirrored.state.stamp_ns;
        self.predictions.send(&mirrored.state)?;
        self.gaps.send(&mirrored.gap)
    }
}

/// Mirrors the newest state before ordinary threads go on with what they do, on the core on which the bridge publishes
/// (the last one): waking a thread there takes a few microseconds, on another core, when that one sleeps, tens of them.
/// Where the machine refuses, states are mirrored as soon as the scheduler allows, and the age in the gap shows it.
fn ask_for_priority() {
    let Ok(value) = ThreadPriorityValue::try_from(PRIORITY) else { return };
    let raised = thread_priority::set_thread_priority_and_policy(
        thread_priority::thread_native_id(),
        ThreadPriority::Crossplatform(value),
        ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo),
    );
    // Without a real-time priority it would wait there behind the bridge and everything else.
    if raised.is_ok() {
        let _bound = bind_to_last_core();
    }
}

fn bind_to_last_core() -> rustix::io::Result<()> {
    let allowed = rustix::thread::sched_getaffinity(None)?;
    let mut last = rustix::thread::CpuSet::new();
    if let Some(core) = (0..rustix::thread::CpuSet::MAX_CPU).rev().find(|core| allowed.is_set(*core)) {
        last.set(core);
        rustix::thread::sched_setaffinity(None, &last)?;
    }
    Ok(())
}
