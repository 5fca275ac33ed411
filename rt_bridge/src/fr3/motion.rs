//! The life of one motion: asked for, running, finished in order or ended by the robot. Called by [`super::Fr3`].
//!
//! The order of events is that of FCI version 10. The robot answers a Move twice, once when it starts and once when it is
//! over; in between the modes in its state say whether it runs. It ends in order when it is sent set points marked as the
//! last ones until its state is idle.

use super::mapping::{errors_of, mode_of};
use super::session::{Session, Ticket};
use crate::arm::ArmFault;
use franka::wire::robot::v10::{
    Command, ControllerMode, Deviation, MotionGeneratorMode, MoveControllerMode, MoveMotionGeneratorMode, MoveRequest,
    MoveStatus, RobotCommand, RobotState,
};
use shared_mem::msg::arm::{ArmMode, CommandInterface};
use std::time::{Duration, Instant};
use zerocopy::IntoBytes;

/// How long the robot may take to accept a motion, and then to show it in its state.
const START_PATIENCE: Duration = Duration::from_secs(1);
/// How long an orderly end may take before the motion is cut off.
const FINISH_PATIENCE: Duration = Duration::from_millis(700);
/// How long the last word on a motion may come after the state that shows its end.
const LAST_WORD_PATIENCE: Duration = Duration::from_millis(200);
/// Permitted deviations of a Move [m, rad, rad]: so wide that they never speak, as libfranka's default.
const DEVIATION: (f64, f64, f64) = (10.0, 3.12, 2.0 * std::f64::consts::PI);

/// A motion the robot has accepted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    ticket: Ticket,
    interface: CommandInterface,
}

impl Motion {
    /// Asks for a motion and waits until the state shows it. `wire` becomes the newest state.
    pub(super) fn start(
        session: &mut Session,
        interface: CommandInterface,
        wire: &mut RobotState,
    ) -> Result<Self, ArmFault> {
        let (controller, generator) = match interface {
            CommandInterface::Torque => (MoveControllerMode::ExternalController, MoveMotionGeneratorMode::None),
            CommandInterface::JointPosition => {
                (MoveControllerMode::JointImpedance, MoveMotionGeneratorMode::JointPosition)
            }
        };
        let deviation = Deviation::new(DEVIATION.0, DEVIATION.1, DEVIATION.2);
        let request = MoveRequest::new(controller, generator, deviation, deviation);
        let ticket = session.send(Command::Move, request.as_bytes())?;
        let status = session.status(ticket, START_PATIENCE)?;
        if status != MoveStatus::MotionStarted.to_u8() {
            return Err(ArmFault::Refused { status });
        }
        let motion = Self { ticket, interface };
        let begin = Instant::now();
        loop {
            session.receive(wire)?;
            if motion.runs(wire) {
                return Ok(motion);
            }
            if let Some(status) = session.try_status(ticket)? {
                return Err(ended(status, wire));
            }
            if begin.elapsed() > START_PATIENCE {
                return Err(ArmFault::NotReady { mode: mode_of(wire) });
            }
        }
    }

    /// `true` while the state shows this motion.
    pub(super) fn runs(&self, wire: &RobotState) -> bool {
        let (controller, generator) = match self.interface {
            CommandInterface::Torque => (ControllerMode::ExternalController, MotionGeneratorMode::None),
            CommandInterface::JointPosition => (ControllerMode::JointImpedance, MotionGeneratorMode::JointPosition),
        };
        mode_of(wire) == ArmMode::Move
            && wire.controller_mode == controller.to_u8()
            && wire.motion_generator_mode == generator.to_u8()
    }

    /// Why the motion is over although nobody finished it; `wire` is the state that showed so.
    pub(super) fn fault(&self, session: &Session, wire: &RobotState) -> ArmFault {
        match mode_of(wire) {
            ArmMode::Reflex => ArmFault::Reflex { errors: errors_of(wire) },
            ArmMode::UserStopped => ArmFault::UserStopped,
            mode => match session.status(self.ticket, LAST_WORD_PATIENCE) {
                Ok(status) => ended(status, wire),
                Err(ArmFault::Silent { .. }) => ArmFault::NotReady { mode },
                Err(fault) => fault,
            },
        }
    }

    /// Ends the motion in order: repeats `last` as the last set point until the robot stands idle. Cuts it off where that
    /// does not help, so that the robot's internal controller holds the arm in any case.
    pub(super) fn finish(self, session: &mut Session, mut last: RobotCommand, wire: &mut RobotState) {
        match self.interface {
            CommandInterface::Torque => last.control.torque_command_finished = 1,
            CommandInterface::JointPosition => last.motion.motion_generation_finished = 1,
        }
        let begin = Instant::now();
        while self.runs(wire) && begin.elapsed() < FINISH_PATIENCE {
            if session.answer(&mut last).and_then(|()| session.receive(wire)).is_err() {
                return;
            }
        }
        // Nobody is left to hear how these end; either way the state goes on telling the truth.
        if self.runs(wire) {
            let _ = session.request(Command::StopMove, &[], LAST_WORD_PATIENCE);
        } else {
            let _ = session.status(self.ticket, LAST_WORD_PATIENCE);
        }
    }
}

/// What the last word on a motion means for who commanded it.
fn ended(status: u8, wire: &RobotState) -> ArmFault {
    match MoveStatus::from_u8(status) {
        Some(MoveStatus::ReflexAborted) => ArmFault::Reflex { errors: errors_of(wire) },
        Some(MoveStatus::EmergencyAborted) => ArmFault::UserStopped,
        _ => ArmFault::Refused { status },
    }
}
