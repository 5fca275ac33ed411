//! What the effects on an arm remember from tick to tick.
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

use super::ArmEffects;
use super::delay_line::DelayLine;
use crate::arm::{JointState, Joints};

/// Past commands and torques, and the motors' own positions. Made by [`ArmEffects::start`].
#[derive(Debug)]
pub struct ArmMemory {
    pub(super) q_d: DelayLine,
    pub(super) dq_d: DelayLine,
    /// The lagging command: positions and velocities.
    pub(super) lagging: JointState,
    /// What the controller's integral action asks for [N m]; `None` before the first tick.
    pub(super) summed: Option<Joints>,
    pub(super) torque: DelayLine,
    pub(super) motor: JointState,
    /// By what share of what they can the bristles of presliding friction are bent; `None` before the first step.
    pub(super) bent: Option<Joints>,
    /// Torque behind the gears, mean over the last step [N m].
    pub(super) tau_J: Joints,
    /// What joints resisted a push with in the last step, beyond their inertia [kg m²].
    pub(super) grip: Joints,
}

impl Clone for ArmMemory {
    fn clone(&self) -> Self {
        let (q_d, dq_d, torque) = (self.q_d.clone(), self.dq_d.clone(), self.torque.clone());
        Self { q_d, dq_d, torque, ..*self }
    }

    /// Keeps the memory it has.
    fn clone_from(&mut self, source: &Self) {
        self.q_d.clone_from(&source.q_d);
        self.dq_d.clone_from(&source.dq_d);
        self.torque.clone_from(&source.torque);
        (self.lagging, self.motor, self.bent) = (source.lagging, source.motor, source.bent);
        self.summed = source.summed;
        (self.tau_J, self.grip) = (source.tau_J, source.grip);
    }
}

/// The part of a memory that a step of the arm changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointMemory {
    motor: JointState,
    bent: Option<Joints>,
    tau_J: Joints,
}

impl ArmMemory {
    /// What a step of the arm changes.
    pub(crate) fn joints(&self) -> JointMemory {
        JointMemory { motor: self.motor, bent: self.bent, tau_J: self.tau_J }
    }

    /// [`crate::arm::Passed::grip`] of the last step.
    pub(crate) fn grip(&self) -> &Joints {
        &self.grip
    }

    /// Takes a step of the arm back.
    pub(crate) fn set_joints(&mut self, joints: &JointMemory) {
        (self.motor, self.bent, self.tau_J) = (joints.motor, joints.bent, joints.tau_J);
    }

    /// As if the arm had had this command for long.
    pub(super) fn restart(&mut self, q_d: &Joints, dq_d: &Joints) {
        self.q_d.restart(q_d);
        self.dq_d.restart(dq_d);
        self.torque.clear();
        (self.bent, self.summed) = (None, None);
        self.lagging = JointState { q: *q_d, dq: *dq_d };
    }

    pub(super) fn new(effects: &ArmEffects, q_d: &Joints, dq_d: &Joints) -> Self {
        let command = effects.command_delay.map_or(0.0, |effect| effect.delay);
        let torque = effects.torque_delay.map_or(0.0, |effect| effect.delay);
        Self {
            q_d: DelayLine::new(command, q_d),
            dq_d: DelayLine::new(command, dq_d),
            lagging: JointState { q: *q_d, dq: *dq_d },
            summed: None,
            torque: DelayLine::empty(torque),
            motor: JointState::default(),
            bent: None,
            tau_J: Joints::default(),
            grip: Joints::default(),
        }
    }
}
