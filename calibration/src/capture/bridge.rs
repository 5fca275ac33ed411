//! The bridge a capture works through: the one that runs already, or one that is started for it and ended after it.

use super::link::{Link, LinkError};
use crate::interrupt::Interrupt;
use crate::processes::{ProcessError, Program, Running, arguments};
use shared_mem::console;
use std::path::Path;
use std::time::Duration;

/// How long to look for a running bridge.
const LOOK: Duration = Duration::from_millis(500);
/// How long a bridge may take to its first arm state: a robot has to be reached and its brakes opened.
const START: Duration = Duration::from_secs(30);
/// Arm of a bridge that is started without being told which.
const DEFAULT_ARM: &str = "sim";

/// No bridge could be had.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// Shared memory failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It could not be started, or ended at once.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// It runs but reports no arm.
    #[error("the bridge reported no arm state within {} s; check the robot's address and whether it is unlocked, then start again", START.as_secs())]
    NoState,
    /// The user gave up first.
    #[error("ended before the bridge was ready")]
    Interrupted,
}

/// Which bridge to start where none runs.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// cell.toml.
    pub cell: &'a Path,
    /// The arm; default: the simulated one.
    pub arm: Option<&'a str>,
    /// How a simulated arm holds the simulated camera; default: it stands where cell.toml says.
    pub hand_eye: Option<&'a Path>,
    /// Whether it insists on real time; default: its own.
    pub realtime: Option<&'a str>,
    /// Shared-memory domain; default: the one this process was started in.
    pub domain: Option<&'a str>,
}

/// The bridge of one capture.
#[derive(Debug)]
pub struct Bridge {
    started: Option<Running>,
}

impl Bridge {
    /// Uses the bridge that runs, else starts one as `wanted`. Says which on stderr.
    ///
    /// # Errors
    /// [`BridgeError`] with the remedy.
    pub fn find_or_start(link: &mut Link, wanted: &Wanted, interrupt: &Interrupt) -> Result<Self, BridgeError> {
        if link.wait_for_bridge(LOOK, || interrupt.asked())?.is_some() {
            match wanted.arm {
                Some(arm) => console::line(format_args!("using the bridge that is running; --arm {arm} has no effect")),
                None => console::line("using the bridge that is running"),
            }
            return Ok(Self { started: None });
        }
        let arm = wanted.arm.unwrap_or(DEFAULT_ARM);
        console::line(format_args!("no bridge is running: starting `rt_bridge run --arm {arm}` for this capture"));
        let mut bridge = Self { started: Some(Self::start(wanted)?) };
        bridge.wait_until_alive(link, interrupt)?;
        Ok(bridge)
    }

    fn start(wanted: &Wanted) -> Result<Running, ProcessError> {
        let arm = wanted.arm.unwrap_or(DEFAULT_ARM);
        let mut list = arguments([&"run", &"--cell", &wanted.cell, &"--arm", &arm]);
        let held = wanted.hand_eye.filter(|_| arm == DEFAULT_ARM);
        list.extend(held.into_iter().flat_map(|file| arguments([&"--hand-eye", &file])));
        list.extend(wanted.realtime.into_iter().flat_map(|way| arguments([&"--realtime", &way])));
        Running::start(Program::Bridge, &list, wanted.domain)
    }

    /// Ends the bridge that was started here and starts another one as `wanted`.
    ///
    /// # Errors
    /// [`BridgeError`] with the remedy.
    pub fn start_anew(&mut self, link: &mut Link, wanted: &Wanted, interrupt: &Interrupt) -> Result<(), BridgeError> {
        if let Some(bridge) = self.started.take() {
            bridge.stop()?;
        }
        link.forget()?;
        self.started = Some(Self::start(wanted)?);
        self.wait_until_alive(link, interrupt)
    }

    /// Waits for the first arm state of a bridge that was started.
    fn wait_until_alive(&mut self, link: &mut Link, interrupt: &Interrupt) -> Result<(), BridgeError> {
        let mut dead = None;
        let state = link.wait_for_bridge(START, || {
            dead = self.check().err();
            dead.is_some() || interrupt.asked()
        })?;
        match (state, dead) {
            (Some(_), _) => Ok(()),
            (None, Some(error)) => Err(error.into()),
            (None, None) if interrupt.asked() => Err(BridgeError::Interrupted),
            (None, None) => Err(BridgeError::NoState),
        }
    }

    /// `true` when it was started for this capture.
    #[must_use]
    pub fn is_own(&self) -> bool {
        self.started.is_some()
    }

    /// An error, with its last words, when a bridge that was started has ended.
    ///
    /// # Errors
    /// [`ProcessError::Ended`].
    pub fn check(&mut self) -> Result<(), ProcessError> {
        self.started.as_mut().map_or(Ok(()), Running::check)
    }

    /// Ends the bridge if it was started here.
    ///
    /// # Errors
    /// [`ProcessError`] when it fails or has to be killed.
    pub fn stop(self) -> Result<(), ProcessError> {
        self.started.map_or(Ok(()), |bridge| bridge.stop().map(drop))
    }
}
