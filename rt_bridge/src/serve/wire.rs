//! Between the bytes of FCI version 10 and what the served robot understands. Pure: no sockets, no clocks. With
//! [`super::hand::wire`] the only file of the server that knows `franka-rs`, whose structs lay out every message.
//!
//! Requests arrive as a number and a payload, set points as datagrams of 371 bytes; states leave as 1377 bytes. Whatever
//! else arrives is refused, never trusted: both readers are total functions over bytes.
#![allow(non_snake_case)] // the field's own symbols

use franka::wire::robot::v10::{
    Command, ConnectRequest, MoveControllerMode, MoveMotionGeneratorMode, MoveRequest, RobotCommand,
    SetCartesianImpedanceRequest, SetCollisionBehaviorRequest, SetEEToKRequest, SetGuidingModeRequest,
    SetJointImpedanceRequest, SetLoadRequest, SetNEToEERequest,
};
use franka::wire::{HeaderLayout, f64s_to_f64};
use zerocopy::FromBytes;

pub(super) use franka::wire::robot::v10::{
    AutomaticErrorRecoveryStatus, ConnectStatus, ControllerMode, GetterSetterStatus, MotionGeneratorMode, MoveStatus,
    RobotMode, RobotState as WireState, StopMoveStatus,
};
pub(super) use franka::wire::{ROBOT_COMMAND_PORT, ROBOT_VERSION};

/// Who turns set points into torques.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Controller {
    /// The robot, joint by joint.
    JointImpedance,
    /// The robot, at the end effector.
    CartesianImpedance,
    External,
}

/// What the client's set points are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GeneratorKind {
    /// `q_c`.
    JointPosition,
    /// `dq_c`.
    JointVelocity,
    /// `O_T_EE_c`.
    CartesianPose,
    /// `O_dP_EE_c`.
    CartesianVelocity,
    /// Nothing: torques alone.
    None,
}

/// A motion that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionRequest {
    pub(super) controller: Controller,
    pub(super) generator: GeneratorKind,
    /// How far the arm may stray from the commanded path: translation [m], rotation [rad], elbow [rad].
    pub(super) path_deviation: [f64; 3],
    /// How far from its goal it may end, likewise.
    pub(super) goal_deviation: [f64; 3],
    /// Sparse targets that the robot plans to by itself, rather than one set point a cycle; no joint faster than this
    /// [rad/s].
    pub(super) targets: Option<[f64; 7]>,
}

/// Contact and collision thresholds of one regime: joints [N m], then Cartesian [N, N m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Thresholds {
    pub(super) contact_torque: [f64; 7],
    pub(super) collision_torque: [f64; 7],
    pub(super) contact_force: [f64; 6],
    pub(super) collision_force: [f64; 6],
}

/// A body at the flange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Load {
    /// [kg].
    pub(super) mass: f64,
    /// In the flange frame [m].
    pub(super) centre: [f64; 3],
    /// About the centre of mass, column-major [kg m²].
    pub(super) inertia: [f64; 9],
}

/// What a client asks for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Request {
    Connect {
        version: u16,
        udp_port: u16,
    },
    Move(MotionRequest),
    StopMove,
    /// While something is commanded to accelerate, and otherwise.
    SetCollisionBehavior(Box<[Thresholds; 2]>),
    SetJointImpedance([f64; 7]),
    SetCartesianImpedance([f64; 6]),
    /// Which directions a hand may push the arm in, and whether the elbow is free.
    SetGuidingMode([bool; 7]),
    SetEEToK([f64; 16]),
    SetNEToEE([f64; 16]),
    SetLoad(Load),
    AutomaticErrorRecovery,
    GetRobotModel,
}

/// Why a message is no request. The number says how it is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotARequest {
    /// A number that version 10 does not know.
    #[error("request {0} is none of FCI version 10")]
    Unknown(u32),
    /// The payload has another length than the request, or holds a number that stands for nothing.
    #[error("the payload of request {0} is none of FCI version 10")]
    Payload(u32),
}

/// Reads a request.
pub(super) fn request(number: u32, payload: &[u8]) -> Result<Request, NotARequest> {
    let command = Command::from_u32(number).ok_or(NotARequest::Unknown(number))?;
    read(command, payload).ok_or(NotARequest::Payload(number))
}

fn read(command: Command, payload: &[u8]) -> Option<Request> {
    let empty = |request| payload.is_empty().then_some(request);
    Some(match command {
        Command::Connect => {
            let connect = ConnectRequest::read_from_bytes(payload).ok()?;
            Request::Connect { version: connect.version.get(), udp_port: connect.udp_port.get() }
        }
        Command::Move => Request::Move(motion(&MoveRequest::read_from_bytes(payload).ok()?)?),
        Command::StopMove => return empty(Request::StopMove),
        Command::SetCollisionBehavior => collision(&SetCollisionBehaviorRequest::read_from_bytes(payload).ok()?),
        Command::SetJointImpedance => {
            let set = SetJointImpedanceRequest::read_from_bytes(payload).ok()?;
            Request::SetJointImpedance(f64s_to_f64(&set.K_theta))
        }
        Command::SetCartesianImpedance => {
            let set = SetCartesianImpedanceRequest::read_from_bytes(payload).ok()?;
            Request::SetCartesianImpedance(f64s_to_f64(&set.K_x))
        }
        Command::SetGuidingMode => {
            let set = SetGuidingModeRequest::read_from_bytes(payload).ok()?;
            let [x, y, z, roll, pitch, yaw] = set.guiding_mode.map(|flag| flag != 0);
            Request::SetGuidingMode([x, y, z, roll, pitch, yaw, set.nullspace != 0])
        }
        Command::SetEEToK => Request::SetEEToK(f64s_to_f64(&SetEEToKRequest::read_from_bytes(payload).ok()?.EE_T_K)),
        Command::SetNEToEE => {
            Request::SetNEToEE(f64s_to_f64(&SetNEToEERequest::read_from_bytes(payload).ok()?.NE_T_EE))
        }
        Command::SetLoad => {
            let set = SetLoadRequest::read_from_bytes(payload).ok()?;
            let (centre, inertia) = (f64s_to_f64(&set.F_x_Cload), f64s_to_f64(&set.I_load));
            Request::SetLoad(Load { mass: set.m_load.get(), centre, inertia })
        }
        Command::AutomaticErrorRecovery => return empty(Request::AutomaticErrorRecovery),
        Command::GetRobotModel => return empty(Request::GetRobotModel),
    })
}

fn motion(wire: &MoveRequest) -> Option<MotionRequest> {
    let controller = match MoveControllerMode::from_u32(wire.controller_mode.get())? {
        MoveControllerMode::JointImpedance => Controller::JointImpedance,
        MoveControllerMode::CartesianImpedance => Controller::CartesianImpedance,
        MoveControllerMode::ExternalController => Controller::External,
    };
    let generator = match MoveMotionGeneratorMode::from_u32(wire.motion_generator_mode.get())? {
        MoveMotionGeneratorMode::JointPosition => GeneratorKind::JointPosition,
        MoveMotionGeneratorMode::JointVelocity => GeneratorKind::JointVelocity,
        MoveMotionGeneratorMode::CartesianPosition => GeneratorKind::CartesianPose,
        MoveMotionGeneratorMode::CartesianVelocity => GeneratorKind::CartesianVelocity,
        MoveMotionGeneratorMode::None => GeneratorKind::None,
    };
    let deviation = |d: &franka::wire::robot::v10::Deviation| [d.translation.get(), d.rotation.get(), d.elbow.get()];
    Some(MotionRequest {
        controller,
        generator,
        path_deviation: deviation(&wire.maximum_path_deviation),
        goal_deviation: deviation(&wire.maximum_goal_pose_deviation),
        targets: (wire.use_async_motion_generator != 0).then(|| f64s_to_f64(&wire.maximum_velocity)),
    })
}

fn collision(set: &SetCollisionBehaviorRequest) -> Request {
    Request::SetCollisionBehavior(Box::new([
        Thresholds {
            contact_torque: f64s_to_f64(&set.lower_torque_thresholds_acceleration),
            collision_torque: f64s_to_f64(&set.upper_torque_thresholds_acceleration),
            contact_force: f64s_to_f64(&set.lower_force_thresholds_acceleration),
            collision_force: f64s_to_f64(&set.upper_force_thresholds_acceleration),
        },
        Thresholds {
            contact_torque: f64s_to_f64(&set.lower_torque_thresholds_nominal),
            collision_torque: f64s_to_f64(&set.upper_torque_thresholds_nominal),
            contact_force: f64s_to_f64(&set.lower_force_thresholds_nominal),
            collision_force: f64s_to_f64(&set.upper_force_thresholds_nominal),
        },
    ]))
}

/// One set point, as it arrived.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(test, derive(Default))]
pub(super) struct SetPoint {
    /// Counter of the state it answers [ms].
    pub(super) answers: u64,
    pub(super) q_c: [f64; 7],
    pub(super) dq_c: [f64; 7],
    pub(super) O_T_EE_c: [f64; 16],
    pub(super) O_dP_EE_c: [f64; 6],
    /// Position of joint 3 and the elbow's side, where the client gives them.
    pub(super) elbow_c: Option<[f64; 2]>,
    pub(super) tau_J_d: [f64; 7],
    pub(super) motion_finished: bool,
    pub(super) torque_finished: bool,
}

/// Reads a set point; a datagram of another length is none.
pub(super) fn set_point(datagram: &[u8]) -> Option<SetPoint> {
    let wire = RobotCommand::read_from_bytes(datagram).ok()?;
    let motion = wire.motion;
    Some(SetPoint {
        answers: wire.message_id.get(),
        q_c: f64s_to_f64(&motion.q_c),
        dq_c: f64s_to_f64(&motion.dq_c),
        O_T_EE_c: f64s_to_f64(&motion.O_T_EE_c),
        O_dP_EE_c: f64s_to_f64(&motion.O_dP_EE_c),
        elbow_c: (motion.valid_elbow != 0).then(|| f64s_to_f64(&motion.elbow_c)),
        tau_J_d: f64s_to_f64(&wire.control.tau_J_d),
        motion_finished: motion.motion_generation_finished != 0,
        torque_finished: wire.control.torque_command_finished != 0,
    })
}

/// A reply: header and payload.
pub(super) fn reply(number: u32, id: u32, payload: &[u8]) -> Vec<u8> {
    let mut message = HeaderLayout::Robot.encode_header(number, id, payload.len());
    message.extend_from_slice(payload);
    message
}

/// Payload of the reply to a handshake.
pub(super) fn connect_reply(status: ConnectStatus) -> [u8; 3] {
    let [low, high] = ROBOT_VERSION.to_le_bytes();
    [status.to_u8(), low, high]
}

/// Payload of the reply to the handshake of a client for whom there is no place. The protocol has no status for that, and
/// libfranka calls every one but 0 and 1 a "protocol error during connection attempt".
pub(super) fn busy_reply() -> [u8; 3] {
    const TAKEN: u8 = 2;
    let [low, high] = ROBOT_VERSION.to_le_bytes();
    [TAKEN, low, high]
}
