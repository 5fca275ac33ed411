//! The bridge a capture works through: the one that runs already, or one that is started for it and ended after it.

use super::admission::{Admission, AdmissionError};
use super::link::{Link, LinkError};
use crate::processes::{ProcessError, Program, Running, arguments};
use shared_mem::console;
use shared_mem::interrupt::Interrupt;
use shared_mem::origin::Origin;
use std::path::Path;
use std::time::Duration;

/// How long to look for a running bridge.
const FIND_TIMEOUT: Duration = Duration::from_millis(500);
/// How long a bridge may take to its first arm state: a robot has to be reached and its brakes opened.
const START_TIMEOUT: Duration = Duration::from_secs(30);
/// The simulated arm, which alone holds a simulated camera.
const SIMULATED: &str = "sim";

/// No bridge could be had.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// Shared memory failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It could not be started, or ended at once.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// Its arm does not go with the session.
    #[error(transparent)]
    Refused(#[from] AdmissionError),
    /// It drives another arm than the one asked for.
    #[error("the bridge that is running drives {running}, not {asked}: end it, or ask for --arm {arm}")]
    OtherArm {
        /// What it drives.
        running: Origin,
        /// What was asked for.
        asked: Origin,
        /// What to ask for instead.
        arm: String,
    },
    /// It runs but reports no arm.
    #[error("the bridge reported no arm state within {} s; check the robot's address and whether it is unlocked, then start again", START_TIMEOUT.as_secs())]
    NoState,
    /// The user gave up first.
    #[error("ended before the bridge was ready")]
    Interrupted,
}

/// Which bridge to start where none runs.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    pub cell: &'a Path,
    /// The arm; default: what the session admits.
    pub arm: Option<&'a str>,
    /// How a simulated arm holds the simulated camera; default: it stands where cell.toml says.
    pub hand_eye: Option<&'a Path>,
    /// Whether it goes without a camera; else with the one that is usual for its arm.
    pub no_camera: bool,
    /// Whether it insists on real time; default: its own.
    pub realtime: Option<&'a str>,
    /// Shared-memory domain; default: the one this process was started in.
    pub domain: Option<&'a str>,
}

/// The bridge of one capture.
#[derive(Debug)]
pub struct Bridge {
    started: Option<Running>,
    origin: Option<Origin>,
}

impl Bridge {
    /// Uses the bridge that runs, else starts one as `wanted`. Says which on stderr.
    ///
    /// # Errors
    /// [`BridgeError`] with the remedy.
    pub fn find_or_start(
        link: &mut Link,
        wanted: &Wanted,
        admission: &Admission,
        interrupt: &Interrupt,
    ) -> Result<Self, BridgeError> {
        if let Some(state) = link.wait_for_bridge(FIND_TIMEOUT, || interrupt.asked())? {
            return Self::running(state.origin.origin(), wanted.arm, admission);
        }
        let arm = admission.arm(wanted.arm)?;
        let origin = arm.parse().ok();
        admission.admits(origin.as_ref())?;
        let why = match wanted.arm {
            Some(_) => "",
            None => ": the simulation, because the session is new and --arm names no robot",
        };
        console::line(format_args!("no bridge is running: starting `rt_bridge run --arm {arm}` for this capture{why}"));
        let mut bridge = Self { started: Some(Self::start(arm, wanted)?), origin };
        bridge.wait_until_alive(link, interrupt)?;
        Ok(bridge)
    }

    /// The bridge that runs, where its arm is the one asked for and goes with the session.
    fn running(origin: Option<Origin>, asked: Option<&str>, admission: &Admission) -> Result<Self, BridgeError> {
        if let (Some(running), Some(arm)) = (&origin, asked)
            && let Ok(asked) = arm.parse::<Origin>()
            && asked.source() != running.source()
        {
            let arm = running.arm().unwrap_or_else(|| "as it is".to_owned());
            return Err(BridgeError::OtherArm { running: running.clone(), asked, arm });
        }
        admission.admits(origin.as_ref())?;
        match &origin {
            Some(origin) => console::line(format_args!("using the bridge that is running: {origin}")),
            None => console::line("using the bridge that is running, which does not say which arm it drives"),
        }
        Ok(Self { started: None, origin })
    }

    /// Where what it records comes from; `None` where it does not say.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    fn start(arm: &str, wanted: &Wanted) -> Result<Running, ProcessError> {
        let mut list = arguments([&"run", &"--cell", &wanted.cell, &"--arm", &arm]);
        let held = wanted.hand_eye.filter(|_| arm == SIMULATED);
        list.extend(held.into_iter().flat_map(|file| arguments([&"--hand-eye", &file])));
        list.extend(wanted.no_camera.then(|| arguments([&"--camera", &"off"])).into_iter().flatten());
        list.extend(wanted.realtime.into_iter().flat_map(|way| arguments([&"--realtime", &way])));
        Running::start(Program::Bridge, &list, wanted.domain)
    }

    /// Ends the bridge that was started here and starts another one of the simulated arm, as `wanted`.
    ///
    /// # Errors
    /// [`BridgeError`] with the remedy.
    pub fn simulate_anew(
        &mut self,
        link: &mut Link,
        wanted: &Wanted,
        interrupt: &Interrupt,
    ) -> Result<(), BridgeError> {
        if let Some(bridge) = self.started.take() {
            bridge.stop()?;
        }
        link.forget()?;
        self.started = Some(Self::start(SIMULATED, wanted)?);
        self.wait_until_alive(link, interrupt)
    }

    /// Waits for the first arm state of a bridge that was started.
    fn wait_until_alive(&mut self, link: &mut Link, interrupt: &Interrupt) -> Result<(), BridgeError> {
        let mut dead = None;
        let state = link.wait_for_bridge(START_TIMEOUT, || {
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
