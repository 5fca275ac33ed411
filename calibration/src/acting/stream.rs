//! The stream of targets of one episode: a hundred a second, whatever the policy is doing meanwhile. A bridge brakes an arm whose stream
//! falls silent.

use shared_mem::msg::Joints;
use shared_mem::msg::target::{ArmTarget, GripperTarget, TargetKind};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, TransportError};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// From one target to the next.
const PERIOD: Duration = Duration::from_millis(10);

/// Where to go next: evenly from where the stream is, over a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    pub(super) q: Joints,
    pub(super) width: Option<f64>,
    pub(super) over: Duration,
}

/// A stream that runs until this is dropped.
#[derive(Debug)]
pub(super) struct Stream {
    legs: Option<Sender<Leg>>,
    thread: Option<JoinHandle<Result<(), TransportError>>>,
}

impl Stream {
    /// Begins at the joints to which the arm is commanded; `arm` has stream id, joints that count, and speed.
    pub(super) fn begin(arm: ArmTarget) -> std::io::Result<Self> {
        let (legs, next) = channel();
        let thread = thread::Builder::new().name("targets".into()).spawn(move || send(arm, &next))?;
        Ok(Self { legs: Some(legs), thread: Some(thread) })
    }

    /// Goes on to another place. `false`: the stream has ended.
    pub(super) fn go(&self, leg: Leg) -> bool {
        self.legs.as_ref().is_some_and(|legs| legs.send(leg).is_ok())
    }

    pub(super) fn end(mut self) -> Result<(), TransportError> {
        self.stop()
    }

    fn stop(&mut self) -> Result<(), TransportError> {
        self.legs = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(ended)) => ended,
            // A thread that panicked has sent nothing since, and the arm was braked.
            Some(Err(_)) | None => Ok(()),
        }
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        // Whoever wants to know how it ended asks.
        let _ended = self.stop();
    }
}

/// Sends until nobody is there to say where to go.
fn send(mut arm: ArmTarget, next: &Receiver<Leg>) -> Result<(), TransportError> {
    let node = Node::open("calibration policy")?;
    let (arms, grippers) = (node.publisher(topics::ARM_TARGET)?, node.publisher(topics::GRIPPER_TARGET)?);
    let mut leg: Option<(Joints, Leg, Instant)> = None;
    arm.kind = TargetKind::Joints;
    loop {
        match next.recv_timeout(PERIOD) {
            Ok(new) => leg = Some((arm.q, new, Instant::now())),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        if let Some((from, to, since)) = &leg {
            let share = (since.elapsed().as_secs_f64() / to.over.as_secs_f64().max(1e-3)).min(1.0);
            arm.q = std::array::from_fn(|i| from[i] + share * (to.q[i] - from[i]));
            if let Some(width) = to.width {
                let target =
                    GripperTarget { stamp_ns: now_ns(), stream: arm.stream, width, ..GripperTarget::default() };
                grippers.send(&target)?;
            }
        }
        arms.send(&ArmTarget { stamp_ns: now_ns(), ..arm })?;
    }
}
