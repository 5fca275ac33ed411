//! A Franka Research 3 over the Franka Control Interface, version 10, and its hand: the only place that knows `franka-rs`
//! as a client.
//!
//! The robot's packet is the clock: it sends a state each millisecond and drops a set point that comes later than the next
//! one. Torques are without gravity and friction, which the robot compensates itself, for the tool as well: cell.toml's
//! `[tool]` is declared as load, unless the robot's web page declares an end effector already.
//!
//! States are taken from the robot's address alone, and only where they go on from the ones before (`states`, `believed`).
//!
//! Frames and units are those of [`shared_mem::msg::arm`]. What runs once a millisecond (`read`, `command`) does not
//! allocate while states arrive.

mod believed;
mod hand;
mod mapping;
mod motion;
mod session;
mod settings;
mod states;
mod version;

pub use hand::Hand;

use crate::arm::{Arm, ArmFault, Clock, ConnectError, Desired, Read};
use crate::rt::Realtime;
use franka::wire::robot::v10::{AutomaticErrorRecoveryStatus, Command, RobotCommand, RobotState};
use mapping::{DOF, datagram, errors_of, fill_state, mode_of};
use motion::Motion;
use session::Session;
use settings::Settings;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::time::now_ns;
use std::time::{Duration, Instant};

/// How long error recovery may take: the robot answers when the arm stands still and its brakes are open again.
const RECOVERY_PATIENCE: Duration = Duration::from_secs(10);
/// How long the state may take to show that the recovery worked.
const RECOVERED_PATIENCE: Duration = Duration::from_secs(1);

/// Connects to the robot at `host` (name or address, optionally with `:port`; 1337 where none is given), which has to speak
/// FCI version 10. Nothing is set or moved yet.
///
/// # Errors
/// [`ConnectError`] when nobody answers there, somebody of another version does, or `realtime` demands a kernel this
/// machine does not run. At most some seconds pass.
pub fn connect(host: &str, realtime: Realtime, cell: &Cell) -> Result<Box<dyn Arm>, ConnectError> {
    if realtime == Realtime::Enforce && !franka::realtime::has_realtime_kernel() {
        let what = "this kernel is not a real-time one (/sys/kernel/realtime does not read 1)".into();
        return Err(ConnectError::Realtime { what });
    }
    let session = Session::connect(host)?;
    Ok(Box::new(Fr3 {
        session,
        settings: Settings::of_cell(cell),
        wire: RobotState::default(),
        motion: None,
        last: RobotCommand::default(),
    }))
}

/// One connected robot.
struct Fr3 {
    session: Session,
    settings: Settings,
    wire: RobotState,
    motion: Option<Motion>,
    /// Newest set point, repeated at the end of the motion.
    last: RobotCommand,
}

impl Arm for Fr3 {
    fn dof(&self) -> usize {
        DOF
    }

    fn clock(&self) -> Clock {
        Clock::Device
    }

    fn extrapolates(&self) -> bool {
        true
    }

    fn start(&mut self, interface: CommandInterface) -> Result<Desired, ArmFault> {
        self.session.receive(&mut self.wire)?;
        match mode_of(&self.wire) {
            ArmMode::Idle => {}
            ArmMode::Reflex => return Err(ArmFault::Reflex { errors: errors_of(&self.wire) }),
            ArmMode::UserStopped => return Err(ArmFault::UserStopped),
            mode => return Err(ArmFault::NotReady { mode }),
        }
        self.settings.send(&self.session, interface, f64::from(self.wire.m_ee.get()))?;
        self.motion = Some(Motion::start(&mut self.session, interface, &mut self.wire)?);
        // What a state reports as desired acted until it; what answers it acts from then on.
        Ok(Desired::Commanded)
    }

    fn read(&mut self, state: &mut ArmState) -> Result<Read, ArmFault> {
        self.session.receive(&mut self.wire)?;
        fill_state(&self.wire, now_ns(), state);
        match self.motion {
            Some(motion) if !motion.runs(&self.wire) => {
                self.motion = None;
                Err(motion.fault(&self.session, &self.wire))
            }
            _ => Ok(Read::Fresh),
        }
    }

    fn command(&mut self, command: &ArmCommand) -> Result<(), ArmFault> {
        if self.motion.is_none() {
            return Err(ArmFault::NotReady { mode: mode_of(&self.wire) });
        }
        self.last = datagram(command);
        self.session.answer(&mut self.last)
    }

    fn stop(&mut self) {
        if let Some(motion) = self.motion.take() {
            motion.finish(&mut self.session, self.last, &mut self.wire);
        }
    }

    fn recover(&mut self) -> Result<(), ArmFault> {
        let ticket = self.session.send(Command::AutomaticErrorRecovery, &[])?;
        let status = self.session.status(ticket, RECOVERY_PATIENCE)?;
        match AutomaticErrorRecoveryStatus::from_u8(status) {
            Some(AutomaticErrorRecoveryStatus::Success) => {}
            Some(AutomaticErrorRecoveryStatus::EmergencyAborted) => return Err(ArmFault::UserStopped),
            _ => return Err(ArmFault::Refused { status }),
        }
        let begin = Instant::now();
        while begin.elapsed() < RECOVERED_PATIENCE {
            self.session.receive(&mut self.wire)?;
            if mode_of(&self.wire) == ArmMode::Idle {
                return Ok(());
            }
        }
        Err(ArmFault::NotReady { mode: mode_of(&self.wire) })
    }
}
