//! What a client may ask of the robot, when, and with which status it is answered.

use super::{MOVE, Mode, Reply, Robot};
use crate::serve::settings::Invalid;
use crate::serve::wire::{
    Controller, GeneratorKind, GetterSetterStatus, MotionRequest, MoveStatus, Request, StopMoveStatus,
};
use shared_mem::msg::joints_from;

/// The robot's own description, as it hands it out: links and joints by the names its clients look for.
pub(super) const URDF: &str = include_str!("../fr3.urdf");

impl Robot {
    /// Takes a request with the client's counter; the replies are in the outbox. A handshake is none of its business.
    pub(in crate::serve) fn request(&mut self, number: u32, id: u32, request: &Request) {
        let payload = match request {
            Request::Connect { .. } => return,
            Request::Move(motion) => return self.ask_motion(id, motion),
            Request::StopMove => vec![self.stop_motion().to_u8()],
            Request::AutomaticErrorRecovery => return self.recover(id),
            Request::GetRobotModel => [&[0], URDF.as_bytes()].concat(),
            _ => vec![self.set(request).to_u8()],
        };
        self.outbox.before_state.push(Reply { number, id, payload });
    }

    fn set(&mut self, request: &Request) -> GetterSetterStatus {
        if !matches!(self.mode, Mode::Idle) || self.waiting.is_some() {
            return GetterSetterStatus::CommandNotPossibleRejected;
        }
        match self.apply(request) {
            Ok(()) => GetterSetterStatus::Success,
            Err(Invalid) => GetterSetterStatus::InvalidArgumentRejected,
        }
    }

    fn apply(&mut self, request: &Request) -> Result<(), Invalid> {
        match request {
            Request::SetCollisionBehavior(thresholds) => self.settings.set_thresholds(thresholds),
            Request::SetJointImpedance(stiffness) => {
                self.settings.set_joint_stiffness(*stiffness)?;
                self.body.ask_stiffness(&joints_from(stiffness)).map_err(|_| Invalid)
            }
            Request::SetCartesianImpedance(stiffness) => self.settings.set_cartesian_stiffness(*stiffness),
            Request::SetEEToK(matrix) => self.settings.set_EE_T_K(matrix),
            Request::SetNEToEE(matrix) => self.settings.set_NE_T_EE(matrix),
            Request::SetLoad(load) => {
                self.settings.set_load(load)?;
                self.body.declare_load(&self.settings.load);
                Ok(())
            }
            // Which way a hand may push the arm matters only to a hand, and this cell has none.
            Request::SetGuidingMode(_)
            | Request::Connect { .. }
            | Request::Move(_)
            | Request::StopMove
            | Request::AutomaticErrorRecovery
            | Request::GetRobotModel => Ok(()),
        }
    }

    pub(super) fn answer_move(&mut self, id: u32, status: MoveStatus) {
        self.outbox.before_state.push(Reply { number: MOVE, id, payload: vec![status.to_u8()] });
    }

    fn ask_motion(&mut self, id: u32, request: &MotionRequest) {
        let torques_alone = request.generator == GeneratorKind::None;
        let deviations = request.path_deviation.iter().chain(&request.goal_deviation);
        if !matches!(self.mode, Mode::Idle) || self.waiting.is_some() {
            self.answer_move(id, MoveStatus::CommandNotPossibleRejected);
        } else if torques_alone && request.controller != Controller::External
            || deviations.into_iter().any(|d| !(*d > 0.0 && d.is_finite()))
            || request.targets.is_some_and(|fastest| !plans_to_targets(request, &fastest))
        {
            self.answer_move(id, MoveStatus::InvalidArgumentRejected);
        } else {
            self.waiting = Some((id, *request));
        }
    }

    fn stop_motion(&mut self) -> StopMoveStatus {
        if let Some((id, _)) = self.waiting.take() {
            self.answer_move(id, MoveStatus::Preempted);
        }
        // Clients send this after every reflex, too, when nothing moves.
        if let Some(id) = self.end() {
            self.answer_move(id, MoveStatus::Preempted);
        }
        StopMoveStatus::Success
    }
}

/// Targets are planned to in joint space, at some speed, and followed by the robot's own controllers.
fn plans_to_targets(request: &MotionRequest, fastest: &[f64; 7]) -> bool {
    request.generator == GeneratorKind::JointPosition
        && request.controller != Controller::External
        && fastest.iter().all(|speed| *speed > 0.0 && speed.is_finite())
}
