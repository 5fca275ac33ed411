//! Between the robot's datagrams and the project's messages. Pure: no sockets, no clocks. Called by [`super::Fr3`].
//!
//! A state is 1377 bytes of 32-bit floats, a command 371 bytes of 64-bit floats; both name their quantities as the
//! messages here do. The millisecond counter of the robot is its clock.
#![allow(non_snake_case)] // the field's own symbols

use crate::arm::ReflexErrors;
use franka::wire::robot::v10::{RobotCommand, RobotState};
use franka::wire::{f32s_to_f64, f64s_to_wire};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::joints_from;
use shared_mem::time::TICK_NS;

/// Joints of an FR3.
pub(super) const DOF: usize = 7;

/// Fills all of `state` that the robot knows; the arrival is `stamp_ns` [ns]. `q_d` and `dq_d` are what the robot's own
/// controller follows, or followed last where torques are commanded.
pub(super) fn fill_state(wire: &RobotState, stamp_ns: u64, state: &mut ArmState) {
    state.stamp_ns = stamp_ns;
    state.device_ns = wire.message_id.get().saturating_mul(TICK_NS);
    state.mode = mode_of(wire);
    state.q = joints_from(&f32s_to_f64(&wire.q));
    state.dq = joints_from(&f32s_to_f64(&wire.dq));
    state.q_d = joints_from(&f32s_to_f64(&wire.q_d));
    state.dq_d = joints_from(&f32s_to_f64(&wire.dq_d));
    state.tau_J = joints_from(&f32s_to_f64(&wire.tau_J));
    state.tau_J_d = joints_from(&f32s_to_f64(&wire.tau_J_d));
    // The robot reports what it exerts on its surroundings (`tau_J` less what its model expects); a state holds what acts
    // on the arm.
    state.tau_ext = joints_from(&f32s_to_f64(&wire.tau_ext_hat_filtered).map(|tau| -tau));
    state.O_T_EE = f32s_to_f64(&wire.O_T_EE);
    state.success_rate = f64::from(wire.control_command_success_rate.get());
}

/// Whether every number that is taken from a state is one, and every flag is set or not: anything else was not laid out by
/// a robot.
pub(super) fn is_sound(wire: &RobotState) -> bool {
    let joints = [&wire.q, &wire.dq, &wire.q_d, &wire.dq_d, &wire.tau_J, &wire.tau_J_d, &wire.tau_ext_hat_filtered];
    joints.into_iter().flatten().chain(&wire.O_T_EE).all(|number| number.get().is_finite())
        && wire.control_command_success_rate.get().is_finite()
        && wire.m_ee.get().is_finite()
        && wire.errors.iter().chain(&wire.reflex_reason).all(|flag| *flag <= 1)
}

/// What the robot says it is doing.
pub(super) fn mode_of(wire: &RobotState) -> ArmMode {
    match wire.robot_mode {
        1 => ArmMode::Idle,
        2 => ArmMode::Move,
        3 => ArmMode::Guiding,
        4 => ArmMode::Reflex,
        5 => ArmMode::UserStopped,
        6 => ArmMode::Recovery,
        _ => ArmMode::Other,
    }
}

/// What the robot objects to now or, where that is cleared already, what ended its last motion.
pub(super) fn errors_of(wire: &RobotState) -> ReflexErrors {
    let now = ReflexErrors::from_flags(&wire.errors.map(|flag| flag != 0));
    if now.is_empty() { ReflexErrors::from_flags(&wire.reflex_reason.map(|flag| flag != 0)) } else { now }
}

/// The datagram that carries `command`; only the block of the running interface is filled, as libfranka does it.
pub(super) fn datagram(command: &ArmCommand) -> RobotCommand {
    let mut wire = RobotCommand::default();
    match command.interface {
        CommandInterface::Torque => wire.control.tau_J_d = f64s_to_wire(&seven(&command.tau_J_d)),
        CommandInterface::JointPosition => wire.motion.q_c = f64s_to_wire(&seven(&command.q_d)),
    }
    wire
}

fn seven(joints: &[f64]) -> [f64; DOF] {
    let mut out = [0.0; DOF];
    for (o, value) in out.iter_mut().zip(joints) {
        *o = *value;
    }
    out
}
