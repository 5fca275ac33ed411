//! What the arm reports and what it is told, once per control cycle (1 kHz on an FR3).
//!
//! Symbols are those of the Franka Control Interface: `tau_J` is measured behind the gear and contains gravity,
//! `tau_J_d` is what the controller asks for without gravity.
#![allow(non_snake_case)] // the field's own symbols

use super::check::{self, Wrong};
use super::origin::ArmOrigin;
use super::wire::{codes, wire};
use super::{Joints, MAX_JOINTS};
use iceoryx2::prelude::ZeroCopySend;

/// State of the arm as of one cycle. Topic `/arm/state`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmState {
    /// When the state reached this machine: monotonic clock [ns].
    pub stamp_ns: u64,
    /// The robot's own clock [ns]: its millisecond counter on an FR3. Gaps in it are lost packets.
    pub device_ns: u64,
    /// Cycles since the bridge started. Goes on counting over lost packets by one per received state.
    pub cycle: u64,
    /// Drawn anew at each start of the bridge, so that readers notice a restart.
    pub session: u64,
    /// Number of joints that count in the arrays below.
    pub dof: u32,
    /// What the robot is doing.
    pub mode: ArmMode,
    /// Joint positions [rad].
    pub q: Joints,
    /// Joint velocities [rad/s].
    pub dq: Joints,
    /// Desired joint positions of this cycle [rad].
    pub q_d: Joints,
    /// Desired joint velocities of this cycle [rad/s].
    pub dq_d: Joints,
    /// Torque measured behind the gear, with gravity [N m].
    pub tau_J: Joints,
    /// Desired torque, without gravity [N m].
    pub tau_J_d: Joints,
    /// Estimated torque of the surroundings on the arm, without the robot's and its tool's own weight [N m].
    pub tau_ext: Joints,
    /// Flange (or declared end effector) in the base frame: homogeneous 4x4, column-major [m].
    pub O_T_EE: [f64; 16],
    /// Share of the last 100 commands that reached the robot in time, 0 to 1.
    pub success_rate: f64,
    /// Motion that is being played, 0 when none was ever started: see [`super::motion::MotionChunk`].
    pub motion_id: u64,
    /// Set points of that motion already played.
    pub motion_played: u32,
    /// Set points of that motion waiting in the control thread.
    pub motion_queued: u32,
    /// How that motion stands.
    pub motion: MotionStatus,
    /// Keeps the size a multiple of 8; always 0.
    pub reserved: u32,
    /// Which arm this is. Own clips say it once, for the whole clip, and not in each state.
    pub origin: ArmOrigin,
}

impl Default for ArmState {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            device_ns: 0,
            cycle: 0,
            session: 0,
            dof: 0,
            mode: ArmMode::Other,
            q: [0.0; MAX_JOINTS],
            dq: [0.0; MAX_JOINTS],
            q_d: [0.0; MAX_JOINTS],
            dq_d: [0.0; MAX_JOINTS],
            tau_J: [0.0; MAX_JOINTS],
            tau_J_d: [0.0; MAX_JOINTS],
            tau_ext: [0.0; MAX_JOINTS],
            O_T_EE: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            success_rate: 0.0,
            motion_id: 0,
            motion_played: 0,
            motion_queued: 0,
            motion: MotionStatus::None,
            reserved: 0,
            origin: ArmOrigin::default(),
        }
    }
}

impl ArmState {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("device_ns", self.device_ns)?;
        check::running("cycle", self.cycle)?;
        check::dof(self.dof)?;
        check::joints(&[("q", &self.q), ("dq", &self.dq), ("q_d", &self.q_d), ("dq_d", &self.dq_d)])?;
        check::joints(&[("tau_J", &self.tau_J), ("tau_J_d", &self.tau_J_d), ("tau_ext", &self.tau_ext)])?;
        check::numbers("O_T_EE", &self.O_T_EE)?;
        check::number("success_rate", self.success_rate)
    }
}

wire!("twinalign/ArmState/3" ArmStateWire: ArmState {
    stamp_ns: u64,
    device_ns: u64,
    cycle: u64,
    session: u64,
    dof: u32,
    mode: ArmMode,
    q: Joints,
    dq: Joints,
    q_d: Joints,
    dq_d: Joints,
    tau_J: Joints,
    tau_J_d: Joints,
    tau_ext: Joints,
    O_T_EE: [f64; 16],
    success_rate: f64,
    motion_id: u64,
    motion_played: u32,
    motion_queued: u32,
    motion: MotionStatus,
    reserved: u32,
    origin: ArmOrigin,
});

/// What the robot is doing. Values are those of the Franka Control Interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ArmMode {
    /// Nothing of the below, or not known.
    #[default]
    Other = 0,
    /// Ready, no motion runs.
    Idle = 1,
    /// A motion or a torque controller runs.
    Move = 2,
    /// Moved by hand.
    Guiding = 3,
    /// Stopped by its own safety functions; wants error recovery.
    Reflex = 4,
    /// Stopped by the user's button.
    UserStopped = 5,
    /// Recovering from an error.
    Recovery = 6,
}

codes!(ArmMode: Other, Idle, Move, Guiding, Reflex, UserStopped, Recovery);

/// How the motion named by `motion_id` stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MotionStatus {
    /// No motion was started since the bridge came up; the pose is held.
    #[default]
    None = 0,
    /// Set points are being played.
    Playing = 1,
    /// Played to its end; the last set point is held.
    Done = 2,
    /// Refused before it began; the reason is on `/events`.
    Refused = 3,
    /// Set points ran out, a limit was met or a stop was asked for: the arm was braked and holds where it came to rest.
    Braked = 4,
}

codes!(MotionStatus: None, Playing, Done, Refused, Braked);

/// What the bridge told the arm in one cycle. Topic `/arm/command`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmCommand {
    /// When the command was handed to the arm: monotonic clock [ns].
    pub stamp_ns: u64,
    /// `device_ns` of the state this command answers.
    pub answers_device_ns: u64,
    /// `cycle` of that state.
    pub cycle: u64,
    /// Number of joints that count.
    pub dof: u32,
    /// Which of the fields the arm follows.
    pub interface: CommandInterface,
    /// Desired joint positions [rad].
    pub q_d: Joints,
    /// Desired joint velocities [rad/s].
    pub dq_d: Joints,
    /// Torque asked for, without gravity [N m]; 0 where the robot's own controller computes it.
    pub tau_J_d: Joints,
}

impl Default for ArmCommand {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            answers_device_ns: 0,
            cycle: 0,
            dof: 0,
            interface: CommandInterface::Torque,
            q_d: [0.0; MAX_JOINTS],
            dq_d: [0.0; MAX_JOINTS],
            tau_J_d: [0.0; MAX_JOINTS],
        }
    }
}

impl ArmCommand {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("answers_device_ns", self.answers_device_ns)?;
        check::running("cycle", self.cycle)?;
        check::dof(self.dof)?;
        check::joints(&[("q_d", &self.q_d), ("dq_d", &self.dq_d), ("tau_J_d", &self.tau_J_d)])
    }
}

wire!("twinalign/ArmCommand/2" ArmCommandWire: ArmCommand {
    stamp_ns: u64,
    answers_device_ns: u64,
    cycle: u64,
    dof: u32,
    interface: CommandInterface,
    q_d: Joints,
    dq_d: Joints,
    tau_J_d: Joints,
});

/// Which field of an [`ArmCommand`] the arm follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CommandInterface {
    /// `tau_J_d`: the bridge runs the joint-impedance law itself.
    #[default]
    Torque = 0,
    /// `q_d`: the robot's internal joint impedance follows.
    JointPosition = 1,
}

codes!(CommandInterface: Torque, JointPosition);
