//! Force sensor and gripper of a recording, at the pace of its arm. The twin of then is left out, and that is said: a
//! `twin shadow` beside the replay makes another, on the same topics.

use super::ReplayClock;
use crate::starting::{self, ThreadError};
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::wrench::Wrench;
use shared_mem::recording::{ClipMessages, Payload, ReadError};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, TransportError};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// What of a recording goes onto shared memory again, beside arm, object and pictures. Dropping it ends its thread.
#[derive(Debug)]
pub struct Instruments {
    stop: Arc<AtomicBool>,
    handle: Option<JoinHandle<()>>,
}

/// A recording's instruments cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum InstrumentError {
    #[error(transparent)]
    Clip(#[from] ReadError),
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(transparent)]
    Thread(#[from] ThreadError),
}

impl Instruments {
    /// Starts to show what a clip holds of a force sensor and of a gripper, each where it is wanted.
    ///
    /// # Errors
    /// [`InstrumentError`] when the clip cannot be read, or their topics are taken.
    pub fn replayed(clip: &Path, clock: ReplayClock, wrench: bool, gripper: bool) -> Result<Self, InstrumentError> {
        let wanted = [topics::WRENCH.name, topics::GRIPPER.name, topics::TWIN_STATE.name, topics::TWIN_GAP.name];
        let messages = ClipMessages::open(clip, &wanted)?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = stop.clone();
        let handle = starting::start("instruments", move |opened| {
            let lines = match Lines::open(wrench, gripper) {
                Ok(lines) => lines,
                // The starter waits for this; it cannot be gone.
                Err(error) => return drop(opened.send(Err(InstrumentError::from(error)))),
            };
            let _waits = opened.send(Ok(()));
            if let Err(error) = lines.show(messages, &clock, &stopping) {
                tracing::error!("the recording's force sensor and gripper stopped: {error}");
            }
        })?;
        Ok(Self { stop, handle: Some(handle) })
    }
}

impl Drop for Instruments {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(handle) = self.handle.take() {
            let _panicked = handle.join();
        }
    }
}

/// The topics that are wanted.
struct Lines {
    wrench: Option<Publisher<Wrench>>,
    gripper: Option<Publisher<GripperState>>,
    // Declared last: ports go before the node they belong to.
    _node: Node,
}

impl Lines {
    fn open(wrench: bool, gripper: bool) -> Result<Self, TransportError> {
        let node = Node::open("rt_bridge_instruments")?;
        let wrench = wrench.then(|| node.publisher(topics::WRENCH)).transpose()?;
        let gripper = gripper.then(|| node.publisher(topics::GRIPPER)).transpose()?;
        Ok(Self { wrench, gripper, _node: node })
    }

    /// Shows all samples once, each when the arm has come to that moment.
    fn show(&self, messages: ClipMessages, clock: &ReplayClock, stop: &AtomicBool) -> Result<(), TransportError> {
        let mut twin_told = false;
        for message in messages {
            let payload = match message {
                Ok(message) => message.payload,
                Err(error) => {
                    tracing::warn!("no more of the recording's force sensor and gripper: {error}");
                    return Ok(());
                }
            };
            match (payload, &self.wrench, &self.gripper) {
                (Payload::Wrench(sample), Some(wrench), _) => {
                    if !clock.wait_for(sample.stamp_ns, stop) {
                        return Ok(());
                    }
                    wrench.send(&Wrench { stamp_ns: now_ns(), ..sample })?;
                }
                (Payload::Gripper(state), _, Some(gripper)) => {
                    if !clock.wait_for(state.stamp_ns, stop) {
                        return Ok(());
                    }
                    gripper.greet_new_readers()?;
                    gripper.send(&GripperState { stamp_ns: now_ns(), ..state })?;
                }
                (Payload::TwinState(_) | Payload::TwinGap(_), ..) if !twin_told => {
                    twin_told = true;
                    tracing::info!(
                        "the recording's {} and {} are not shown again; `twin shadow` beside this replay makes them anew",
                        topics::TWIN_STATE.name,
                        topics::TWIN_GAP.name
                    );
                }
                _ => {}
            }
        }
        Ok(())
    }
}
