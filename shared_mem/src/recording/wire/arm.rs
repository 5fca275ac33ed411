//! Arm and twin: `/arm/state`, `/arm/command`, `/twin/state`, `/twin/gap`, `/twin/objects`.
#![allow(non_snake_case)] // the field's own symbols

use super::proto::twinalign as wire;
use super::{UnixClock, Wire, array};
use crate::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface, MotionStatus};
use crate::msg::object::ObjectName;
use crate::msg::origin::ArmOrigin;
use crate::msg::twin::{TwinGap, TwinObject, TwinState};
use crate::msg::{Joints, joints_from};
use crate::topics;

/// The joints that count.
fn joints(values: &Joints, dof: u32) -> Vec<f64> {
    values.iter().take(dof as usize).copied().collect()
}

/// Joints that a message of that many numbers speaks of, as far as they fit.
fn dof(values: &[f64]) -> u32 {
    u32::try_from(values.len().min(crate::msg::MAX_JOINTS)).unwrap_or(0)
}

impl Wire for ArmState {
    const TOPIC: &'static str = topics::ARM_STATE.name;
    const SCHEMA: &'static str = "twinalign.ArmState";
    type Message = wire::ArmState;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::ArmState {
        wire::ArmState {
            stamp_ns: self.stamp_ns,
            device_ns: self.device_ns,
            cycle: self.cycle,
            session: self.session,
            mode: self.mode as i32,
            q: joints(&self.q, self.dof),
            dq: joints(&self.dq, self.dof),
            q_d: joints(&self.q_d, self.dof),
            dq_d: joints(&self.dq_d, self.dof),
            tau_j: joints(&self.tau_J, self.dof),
            tau_j_d: joints(&self.tau_J_d, self.dof),
            tau_ext: joints(&self.tau_ext, self.dof),
            o_t_ee: self.O_T_EE.to_vec(),
            success_rate: self.success_rate,
            motion_id: self.motion_id,
            motion_played: self.motion_played,
            motion_queued: self.motion_queued,
            motion: self.motion as i32,
            origin: self.origin.text().to_owned(),
        }
    }

    fn from_wire(m: wire::ArmState) -> Self {
        let (mode, motion) = (m.mode(), m.motion());
        Self {
            stamp_ns: m.stamp_ns,
            device_ns: m.device_ns,
            cycle: m.cycle,
            session: m.session,
            dof: dof(&m.q),
            mode: match mode {
                wire::ArmMode::Other => ArmMode::Other,
                wire::ArmMode::Idle => ArmMode::Idle,
                wire::ArmMode::Move => ArmMode::Move,
                wire::ArmMode::Guiding => ArmMode::Guiding,
                wire::ArmMode::Reflex => ArmMode::Reflex,
                wire::ArmMode::UserStopped => ArmMode::UserStopped,
                wire::ArmMode::Recovery => ArmMode::Recovery,
            },
            q: joints_from(&m.q),
            dq: joints_from(&m.dq),
            q_d: joints_from(&m.q_d),
            dq_d: joints_from(&m.dq_d),
            tau_J: joints_from(&m.tau_j),
            tau_J_d: joints_from(&m.tau_j_d),
            tau_ext: joints_from(&m.tau_ext),
            O_T_EE: array(&m.o_t_ee),
            success_rate: m.success_rate,
            motion_id: m.motion_id,
            motion_played: m.motion_played,
            motion_queued: m.motion_queued,
            motion: match motion {
                wire::MotionStatus::None => MotionStatus::None,
                wire::MotionStatus::Playing => MotionStatus::Playing,
                wire::MotionStatus::Done => MotionStatus::Done,
                wire::MotionStatus::Refused => MotionStatus::Refused,
                wire::MotionStatus::Braked => MotionStatus::Braked,
            },
            reserved: 0,
            origin: ArmOrigin::new(&m.origin),
        }
    }
}

impl Wire for ArmCommand {
    const TOPIC: &'static str = topics::ARM_COMMAND.name;
    const SCHEMA: &'static str = "twinalign.ArmCommand";
    type Message = wire::ArmCommand;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::ArmCommand {
        wire::ArmCommand {
            stamp_ns: self.stamp_ns,
            answers_device_ns: self.answers_device_ns,
            cycle: self.cycle,
            interface: self.interface as i32,
            q_d: joints(&self.q_d, self.dof),
            dq_d: joints(&self.dq_d, self.dof),
            tau_j_d: joints(&self.tau_J_d, self.dof),
        }
    }

    fn from_wire(m: wire::ArmCommand) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            answers_device_ns: m.answers_device_ns,
            cycle: m.cycle,
            dof: dof(&m.q_d),
            interface: match m.interface() {
                wire::CommandInterface::Torque => CommandInterface::Torque,
                wire::CommandInterface::JointPosition => CommandInterface::JointPosition,
            },
            q_d: joints_from(&m.q_d),
            dq_d: joints_from(&m.dq_d),
            tau_J_d: joints_from(&m.tau_j_d),
        }
    }
}

impl Wire for TwinState {
    const TOPIC: &'static str = topics::TWIN_STATE.name;
    const SCHEMA: &'static str = "twinalign.TwinState";
    type Message = wire::TwinState;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::TwinState {
        wire::TwinState {
            stamp_ns: self.stamp_ns,
            mirrors_ns: self.mirrors_ns,
            cycle: self.cycle,
            has_object: self.has_object != 0,
            q: joints(&self.q, self.dof),
            dq: joints(&self.dq, self.dof),
            tau_j: joints(&self.tau_J, self.dof),
            object_position: self.object_position.to_vec(),
            object_orientation: self.object_wxyz.to_vec(),
            contact_force: self.contact_force,
        }
    }

    fn from_wire(m: wire::TwinState) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            mirrors_ns: m.mirrors_ns,
            cycle: m.cycle,
            dof: dof(&m.q),
            has_object: u32::from(m.has_object),
            q: joints_from(&m.q),
            dq: joints_from(&m.dq),
            tau_J: joints_from(&m.tau_j),
            object_position: array(&m.object_position),
            object_wxyz: array(&m.object_orientation),
            contact_force: m.contact_force,
        }
    }
}

impl Wire for TwinGap {
    const TOPIC: &'static str = topics::TWIN_GAP.name;
    const SCHEMA: &'static str = "twinalign.TwinGap";
    type Message = wire::TwinGap;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::TwinGap {
        wire::TwinGap {
            stamp_ns: self.stamp_ns,
            cycle: self.cycle,
            alignments: self.alignments,
            joint_error: joints(&self.joint_error, self.dof),
            joint_rms: joints(&self.joint_rms, self.dof),
            object_add: self.object_add_m,
            object_add_s: self.object_add_s_m,
            age_ns: self.age_ns,
        }
    }

    fn from_wire(m: wire::TwinGap) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            cycle: m.cycle,
            dof: dof(&m.joint_error),
            alignments: m.alignments,
            joint_error: joints_from(&m.joint_error),
            joint_rms: joints_from(&m.joint_rms),
            object_add_m: m.object_add,
            object_add_s_m: m.object_add_s,
            age_ns: m.age_ns,
        }
    }
}

impl Wire for TwinObject {
    const TOPIC: &'static str = topics::TWIN_OBJECTS.name;
    const SCHEMA: &'static str = "twinalign.TwinObject";
    type Message = wire::TwinObject;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::TwinObject {
        wire::TwinObject {
            stamp_ns: self.stamp_ns,
            mirrors_ns: self.mirrors_ns,
            name: self.name.text().to_owned(),
            position: self.position.to_vec(),
            orientation: self.wxyz.to_vec(),
            add: self.add_m,
            add_s: self.add_s_m,
        }
    }

    fn from_wire(m: wire::TwinObject) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            mirrors_ns: m.mirrors_ns,
            position: array(&m.position),
            wxyz: array(&m.orientation),
            add_m: m.add,
            add_s_m: m.add_s,
            name: ObjectName::new(&m.name).unwrap_or_default(),
        }
    }
}
