//! What arm and gripper are steered by: `/arm/target`, `/gripper/target`.

use super::proto::twinalign as wire;
use super::{UnixClock, Wire, array};
use crate::msg::joints_from;
use crate::msg::target::{ArmTarget, GripperTarget, TargetKind};
use crate::topics;

impl Wire for ArmTarget {
    const TOPIC: &'static str = topics::ARM_TARGET.name;
    const SCHEMA: &'static str = "twinalign.ArmTarget";
    type Message = wire::ArmTarget;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::ArmTarget {
        wire::ArmTarget {
            stamp_ns: self.stamp_ns,
            stream: self.stream,
            kind: self.kind as i32,
            speed: self.speed,
            q: self.q.iter().take(self.dof as usize).copied().collect(),
            position: self.position.to_vec(),
            orientation: self.wxyz.to_vec(),
        }
    }

    fn from_wire(m: wire::ArmTarget) -> Self {
        Self {
            stamp_ns: m.stamp_ns,
            stream: m.stream,
            kind: match m.kind() {
                wire::TargetKind::Joints => TargetKind::Joints,
                wire::TargetKind::Pose => TargetKind::Pose,
            },
            dof: u32::try_from(m.q.len().min(crate::msg::MAX_JOINTS)).unwrap_or(0),
            speed: m.speed,
            q: joints_from(&m.q),
            position: array(&m.position),
            wxyz: array(&m.orientation),
        }
    }
}

impl Wire for GripperTarget {
    const TOPIC: &'static str = topics::GRIPPER_TARGET.name;
    const SCHEMA: &'static str = "twinalign.GripperTarget";
    type Message = wire::GripperTarget;

    fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    fn to_wire(&self, _clock: UnixClock) -> wire::GripperTarget {
        let Self { stamp_ns, stream, width, speed, force } = *self;
        wire::GripperTarget { stamp_ns, stream, width, speed, force }
    }

    fn from_wire(m: wire::GripperTarget) -> Self {
        let wire::GripperTarget { stamp_ns, stream, width, speed, force } = m;
        Self { stamp_ns, stream, width, speed, force }
    }
}
