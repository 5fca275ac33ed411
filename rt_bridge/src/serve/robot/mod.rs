//! The served robot without its sockets: a state machine that takes requests and set points and lets a millisecond pass.
//! What a test wants to know about the robot it asks here; [`super::session`] carries it to a client.
//!
//! Responsibilities: which request is possible in which mode, in which order replies and states leave, what ends a motion.
//!
//! ```text
//!          Move                    finished, StopMove
//!   idle --------> moving ----------------------------> idle (comes to rest, then holds)
//!    ^               | limit, discontinuity, collision, 20 lost commands
//!    |               v
//!    |            reflex --AutomaticErrorRecovery--> recovering
//!    +------------------------------------------------------+ once at rest
//! ```
//!
//! In any mode but moving, an arm that is too fast, beyond its range or held by too much torque is a reflex as well, and
//! its brakes close: there the robot's own controller is what failed. A client that is gone during a motion leaves a reflex behind,
//! `communication_constraints_violation`. At rest a state in reflex shows no errors, but why the last motion ended.
//!
//! Deterministic: the same requests and set points give the same states.
#![allow(non_snake_case)] // the field's own symbols

#[cfg(test)]
mod fuzz;
mod recovery;
#[cfg(test)]
mod recovery_tests;
mod requests;
#[cfg(test)]
mod target_tests;
#[cfg(test)]
mod tests;

use super::ServeError;
use super::body::Body;
use super::faults::Fault;
use super::generator::Surroundings;
use super::generator::rules::JointRules;
use super::hold::Hold;
use super::impedance;
use super::kinematics::{Frame, least_stretch};
use super::motion::{Course, Motion};
use super::notices::{About, Notices};
use super::settings::Settings;
use super::state::{Facts, Modes, fill};
use super::watch::{deviates, objections, runs_away, touches};
use super::wire::{
    Controller, ControllerMode, GeneratorKind, MotionGeneratorMode, MotionRequest, MoveStatus, RobotMode, SetPoint,
    WireState,
};
use crate::arm::ReflexErrors;
use crate::safety::{Limits, Trace};
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use std::ops::RangeInclusive;
use twin::arm::{JointState, Joints};
use twin::control::Drive;

/// A pose whose Jacobian stretches less than this in some direction is no start of a Cartesian motion.
const SINGULAR: f64 = 0.01;

/// Numbers of the requests that are answered later than at once.
const MOVE: u32 = 1;
const RECOVER: u32 = 10;

/// A reply that is to be sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Reply {
    pub(super) number: u32,
    pub(super) id: u32,
    pub(super) payload: Vec<u8>,
}

/// Replies in the order in which a client has to see them: a motion is announced before a state shows it, and its end is
/// shown before it is announced.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    pub(super) before_state: Vec<Reply>,
    pub(super) after_state: Vec<Reply>,
}

/// What has happened so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Tally {
    /// Milliseconds the robot has lived.
    pub cycles: u64,
    /// Motions that were started.
    pub motions: u64,
    /// Motions that the robot ended by itself.
    pub reflexes: u64,
    /// Commands that did not come in time while one was awaited.
    pub lost_commands: u64,
}

/// The mode of the robot.
#[derive(Debug)]
enum Mode {
    Idle,
    Moving(Box<Motion>),
    Reflex,
    /// Error recovery, asked for by the request `id` of a client that is still there, for `passed` milliseconds since the
    /// arm came to rest.
    Recovering {
        id: Option<u32>,
        passed: u32,
    },
}

pub(super) struct Robot {
    body: Body,
    rules: JointRules,
    settings: Settings,
    /// Those that a new client finds.
    at_power_on: Settings,
    mode: Mode,
    /// The arm's brakes are closed.
    braked: bool,
    /// A motion that was asked for while the arm still came to rest from the one before.
    waiting: Option<(u32, MotionRequest)>,
    hold: Hold,
    errors: ReflexErrors,
    reflex_reason: ReflexErrors,
    state: WireState,
    outbox: Outbox,
    tally: Tally,
    pub(super) notices: Notices,
}

impl Robot {
    /// The robot of a cell, idle where `[simulation]` puts it. `theta` are parameters and effects that are hidden from clients.
    pub(super) fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, ServeError> {
        let body = Body::new(cell, theta)?;
        let limits = Limits::of(cell, body.model());
        let at_power_on = Settings::at_power_on(cell.tool.as_ref());
        let mut robot = Self {
            rules: JointRules { limits },
            settings: at_power_on.clone(),
            at_power_on,
            mode: Mode::Idle,
            braked: false,
            waiting: None,
            hold: Hold::at_rest(limits, &body.true_reading().q),
            errors: ReflexErrors::default(),
            reflex_reason: ReflexErrors::default(),
            state: WireState::default(),
            outbox: Outbox::default(),
            tally: Tally { cycles: 1, ..Tally::default() },
            notices: Notices::new(),
            body,
        };
        robot.show();
        Ok(robot)
    }

    /// The newest state.
    pub(super) fn state(&self) -> &WireState {
        &self.state
    }

    /// Counter of the newest state: the robot's clock [ms].
    pub(super) fn now(&self) -> u64 {
        self.tally.cycles
    }

    /// Counters of the states that a set point may answer.
    pub(super) fn answers(&self) -> RangeInclusive<u64> {
        self.running().map_or(self.now()..=self.now(), |motion| motion.answers(self.now()))
    }

    /// What has happened so far.
    pub(super) fn tally(&self) -> Tally {
        Tally { lost_commands: self.tally.lost_commands + self.running().map_or(0, |m| m.losses.total()), ..self.tally }
    }

    /// The replies that wait to be sent.
    pub(super) fn outbox(&mut self) -> Outbox {
        std::mem::take(&mut self.outbox)
    }

    /// `true` while a motion runs that its client has begun to command.
    pub(super) fn is_commanded(&self) -> bool {
        self.running().is_some_and(|motion| motion.losses.has_begun())
    }

    fn running(&self) -> Option<&Motion> {
        match &self.mode {
            Mode::Moving(motion) => Some(motion),
            Mode::Idle | Mode::Reflex | Mode::Recovering { .. } => None,
        }
    }

    /// The client is gone, and what it has set goes with it. A motion that it leaves behind gets no commands any more, which is a
    /// reflex as any other loss of them; the next client finds it.
    pub(super) fn client_left(&mut self) {
        self.waiting = None;
        if self.running().is_some() {
            self.notices.warn(About::Client, "the client left during a motion; the arm comes to rest");
            self.reflex(Fault::CommunicationConstraints.alone());
        }
        if let Mode::Recovering { id, .. } = &mut self.mode {
            *id = None;
        }
        self.settings = self.at_power_on.clone();
        self.hand_on_settings();
        self.outbox = Outbox::default();
    }

    /// Has the body act by the load and the joint stiffness at power-on.
    fn hand_on_settings(&mut self) {
        self.body.declare_load(&self.at_power_on.load);
        // It fails where cell.toml has no controller, and such a cell is not served.
        let _has_one = self.body.restore_stiffness();
    }

    /// Starts the motion that waits, once the arm is at rest.
    fn begin_waiting(&mut self) {
        let Some((id, request)) = self.waiting.take_if(|_| self.hold.rests()) else { return };
        self.answer_move(id, MoveStatus::MotionStarted);
        let around = Surroundings::new(self.body.model(), &self.rules, &self.settings);
        let q = &self.hold.trace().q;
        let cartesian = matches!(request.generator, GeneratorKind::CartesianPose | GeneratorKind::CartesianVelocity);
        if cartesian && least_stretch(&around.ee.jacobian(q)) < SINGULAR {
            let payload = vec![MoveStatus::StartAtSingularPoseRejected.to_u8()];
            self.outbox.after_state.push(Reply { number: MOVE, id, payload });
            return;
        }
        let motion = Motion::begin(request, id, self.now(), q, &around);
        self.tally.motions += 1;
        self.reflex_reason = ReflexErrors::default();
        self.mode = Mode::Moving(Box::new(motion));
    }

    /// Lets a millisecond pass; `set_point` is the newest that has arrived since the last one.
    pub(super) fn tick(&mut self, set_point: Option<&SetPoint>) {
        self.forget_what_is_over();
        self.go_on_recovering();
        self.begin_waiting();
        self.cycle(set_point);
        self.hold.step();
        if self.braked {
            self.body.step_braked();
            self.hold.settle(&self.body.measured.q);
        } else {
            let drive = self.drive();
            self.body.step(&drive, &self.settings);
        }
        self.tally.cycles += 1;
        self.watch();
        self.show();
    }

    /// Of an arm that has come to rest after a reflex nothing is wrong any more: why it stopped stays, the reason of its last motion's end.
    fn forget_what_is_over(&mut self) {
        let rests = if self.braked { self.body.stands() } else { self.hold.rests() };
        if matches!(self.mode, Mode::Reflex) && rests {
            self.errors = ReflexErrors::default();
        }
    }

    fn cycle(&mut self, set_point: Option<&SetPoint>) {
        let now = self.now();
        let Self { mode: Mode::Moving(motion), body, rules, settings, .. } = self else { return };
        let around = Surroundings::new(body.model(), rules, settings);
        match motion.cycle(set_point, now, &body.measured.tau_J_d, &around) {
            Ok(Course::Runs) => {}
            Ok(Course::Finished) if deviates(body, motion, &motion.request.goal_deviation, rules, settings) => {
                self.reflex(Fault::GoalPoseDeviation.alone());
            }
            Ok(Course::Finished) => {
                if let Some(id) = self.end() {
                    let payload = vec![MoveStatus::Success.to_u8()];
                    self.outbox.after_state.push(Reply { number: MOVE, id, payload });
                }
            }
            Err(errors) => self.reflex(errors),
        }
    }

    fn watch(&mut self) {
        let Self { body, mode, rules, settings, .. } = self;
        match mode {
            Mode::Moving(motion) => {
                let errors = objections(body, motion, rules, settings);
                if !errors.is_empty() {
                    self.reflex(errors);
                }
            }
            Mode::Idle | Mode::Reflex | Mode::Recovering { .. } => {
                drop(touches(body, None, settings));
                // A recovering arm may be beyond its range: it is on its way back.
                let errors = runs_away(body, rules, settings, !matches!(mode, Mode::Recovering { .. }));
                if !self.braked && !errors.is_empty() {
                    self.brake(errors);
                }
            }
        }
    }

    /// The robot stops by itself.
    fn reflex(&mut self, errors: ReflexErrors) {
        self.notices.warn(About::Robot, format_args!("the robot stopped itself: {errors}"));
        if let Some(id) = self.end() {
            let payload = vec![MoveStatus::ReflexAborted.to_u8()];
            self.outbox.after_state.push(Reply { number: MOVE, id, payload });
        }
        (self.errors, self.reflex_reason) = (errors, errors);
        self.tally.reflexes += 1;
        self.mode = Mode::Reflex;
    }

    /// Ends the motion that runs: idle from now on, the arm comes to rest. Returns the client's counter of the motion.
    fn end(&mut self) -> Option<u32> {
        let motion = match std::mem::replace(&mut self.mode, Mode::Idle) {
            Mode::Moving(motion) => motion,
            other => {
                self.mode = other;
                return None;
            }
        };
        self.tally.lost_commands += motion.losses.total();
        match (motion.request.controller, motion.generator.joints()) {
            (Controller::JointImpedance, Some(trace)) => self.hold.stop(trace),
            // No torque has come yet: the robot's own controller holds the arm all the while.
            (Controller::External, _) if motion.torque().is_none() => {}
            _ => self.hold.catch(&self.body.measured.q, &self.body.measured.dq),
        }
        Some(motion.id)
    }

    /// What moves the arm in the coming period.
    fn drive(&self) -> Drive {
        let hold = || Drive::JointImpedance { q_d: self.hold.trace().q, dq_d: *self.hold.dq_d() };
        let Some(motion) = self.running() else { return hold() };
        match (motion.request.controller, motion.generator.joints()) {
            (Controller::External, _) | (_, None) => {
                motion.torque().map_or_else(hold, |tau_J_d| Drive::Torque { tau_J_d: *tau_J_d })
            }
            (Controller::JointImpedance, Some(trace)) => {
                let JointState { q: q_d, dq: dq_d } = aim(trace);
                Drive::JointImpedance { q_d, dq_d }
            }
            (Controller::CartesianImpedance, Some(trace)) => {
                let frame = Frame { model: self.body.model(), on_flange: self.settings.F_T_K() };
                let stiffness = &self.settings.cartesian_stiffness;
                let tau_J_d = impedance::torque(&frame, stiffness, &self.body.joints(), &aim(trace));
                Drive::Torque { tau_J_d }
            }
        }
    }

    /// Makes the state that is sent.
    fn show(&mut self) {
        let around = Surroundings::new(self.body.model(), &self.rules, &self.settings);
        let generator = self.running().map(|motion| &motion.generator);
        let facts = Facts {
            id: self.now(),
            modes: self.modes(),
            around,
            settings: &self.settings,
            measured: &self.body.measured,
            tau_J_before: &self.body.tau_J_before,
            desired: generator.and_then(|g| g.joints()).unwrap_or(self.hold.trace()),
            commanded: generator.and_then(|g| g.end_effector()),
            tau_ext: self.body.tau_ext(),
            wrench: &self.body.wrench,
            touched: &self.body.touched,
            errors: self.errors,
            reflex_reason: self.reflex_reason,
            success_rate: self.running().map_or(0.0, |motion| motion.losses.success_rate()),
        };
        let mut state = WireState::default();
        fill(&mut state, &facts);
        self.state = state;
    }

    fn modes(&self) -> Modes {
        let standing = |robot| Modes { robot, generator: MotionGeneratorMode::Idle, controller: ControllerMode::Other };
        match &self.mode {
            Mode::Idle => standing(RobotMode::Idle),
            Mode::Reflex => standing(RobotMode::Reflex),
            Mode::Recovering { .. } => standing(RobotMode::AutomaticErrorRecovery),
            Mode::Moving(motion) => Modes {
                robot: RobotMode::Move,
                generator: match motion.request.generator {
                    GeneratorKind::JointPosition => MotionGeneratorMode::JointPosition,
                    GeneratorKind::JointVelocity => MotionGeneratorMode::JointVelocity,
                    GeneratorKind::CartesianPose => MotionGeneratorMode::CartesianPosition,
                    GeneratorKind::CartesianVelocity => MotionGeneratorMode::CartesianVelocity,
                    GeneratorKind::None => MotionGeneratorMode::None,
                },
                controller: match motion.request.controller {
                    Controller::JointImpedance => ControllerMode::JointImpedance,
                    Controller::CartesianImpedance => ControllerMode::CartesianImpedance,
                    Controller::External => ControllerMode::ExternalController,
                },
            },
        }
    }
}

/// Where the joints should be and how fast, at the end of the period that a set point speaks of.
fn aim(trace: &Trace) -> JointState {
    let dq: Joints = std::array::from_fn(|i| trace.velocity_now(i, TICK));
    JointState { q: trace.q, dq }
}
