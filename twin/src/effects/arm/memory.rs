//! What the effects on an arm remember from tick to tick.
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

use super::ArmEffects;
use super::delay_line::DelayLine;
use crate::arm::{JointState, Joints};

/// Past commands and torques, and the motors' own positions. Made by [`ArmEffects::start`].
#[derive(Debug, Clone)]
pub struct ArmMemory {
    pub(super) q_d: DelayLine,
    pub(super) dq_d: DelayLine,
    /// The lagging command: positions and velocities.
    pub(super) lagging: JointState,
    pub(super) torque: DelayLine,
    pub(super) motor: JointState,
    /// Torque behind the gears, mean over the last step [N m].
    pub(super) tau_J: Joints,
}

impl ArmMemory {
    pub(super) fn new(effects: &ArmEffects, q_d: &Joints, dq_d: &Joints) -> Self {
        let command = effects.command_delay.map_or(0.0, |effect| effect.delay);
        let torque = effects.torque_delay.map_or(0.0, |effect| effect.delay);
        Self {
            q_d: DelayLine::new(command, q_d),
            dq_d: DelayLine::new(command, dq_d),
            lagging: JointState { q: *q_d, dq: *dq_d },
            torque: DelayLine::empty(torque),
            motor: JointState::default(),
            tau_J: Joints::default(),
        }
    }
}
