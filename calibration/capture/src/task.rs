//! What every capture is asked for, and what it answers, whichever motions it plays.

use super::admission::Admission;
use super::bridge::{Bridge, BridgeError, Wanted};
use super::link::Link;
use super::recorder::Recording;
use serde::Serialize;
use shared_mem::interrupt::Interrupt;
use shared_mem::origin::Origin;
use std::path::PathBuf;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Task {
    /// The laboratory's cell.toml.
    pub cell: PathBuf,
    /// Clips to add.
    pub clips: u32,
    /// Clips of the session that are played again, by their numbers, one after the other and from the first again; empty: new ones.
    pub repeat: Vec<usize>,
    /// How many times as fast as it would be every motion that is recorded is played.
    pub speed: f64,
    pub out: PathBuf,
    /// Whether clips may go beside those of another source.
    pub mix: bool,
    /// Arm of a bridge that has to be started, as `rt_bridge run --arm` takes it.
    pub arm: Option<String>,
    /// Whether that bridge insists on real time, as `rt_bridge run --realtime` takes it; default: the bridge's own.
    pub realtime: Option<String>,
    /// Whether clips go without pictures, and a bridge that is started without a camera.
    pub no_camera: bool,
    /// How often a robot that stops itself is recovered without a person.
    pub recover: u32,
    /// Shared-memory domain; default: the one this process was started in.
    pub domain: Option<String>,
}

/// What was done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary<Clip> {
    pub session: PathBuf,
    /// Clips of this run, in order.
    pub clips: Vec<Clip>,
    /// Whether the user ended it early.
    pub interrupted: bool,
    /// Whether the bridge was started, and ended, by this run.
    pub own_bridge: bool,
    /// Where its clips come from; null where the bridge does not say.
    pub origin: Option<Origin>,
}

/// Why a capture failed: a bridge that died says more than the silence it leaves.
pub fn cause(error: anyhow::Error, bridge: &mut Bridge) -> anyhow::Error {
    match bridge.check() {
        Ok(()) => error,
        Err(ended) => anyhow::anyhow!(
            "{ended}; what was recorded is kept: to go on, start the same command again, and the session is continued"
        ),
    }
}

impl Task {
    /// Number of the clip that is played again as this run's clip `count` (from 0); `None`: a new one.
    pub fn repeated(&self, count: usize) -> Option<usize> {
        (!self.repeat.is_empty()).then(|| self.repeat[count % self.repeat.len()])
    }

    /// ` at 0.5 times the speed`, where it is another than usual.
    pub fn pace(&self) -> String {
        if self.speed == 1.0 { String::new() } else { format!(" at {} times the speed", self.speed) }
    }

    /// How its clips are recorded.
    pub fn recording(&self) -> Recording<'_> {
        Recording { cell: &self.cell, domain: self.domain.as_deref(), no_camera: self.no_camera }
    }

    /// The bridge that runs, or one that is started for this task.
    ///
    /// # Errors
    /// [`BridgeError`] with the remedy.
    pub fn bridge(&self, link: &mut Link, interrupt: &Interrupt) -> Result<Bridge, BridgeError> {
        let (arm, realtime, domain) = (self.arm.as_deref(), self.realtime.as_deref(), self.domain.as_deref());
        let wanted = Wanted { cell: &self.cell, arm, hand_eye: None, no_camera: self.no_camera, realtime, domain };
        Bridge::find_or_start(link, &wanted, &Admission::to(&self.out, self.mix), interrupt)
    }
}
