//! The arm of the simulated cell: its plant, its motion, and what it reports.
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::SimError;
use crate::arm::{ArmModel, JointState, Joints, MAX_JOINTS, PointForce};
use crate::effects::ArmEffects;
use crate::rollout::{ArmMotion, CommandTrack, Drive, Plant, Reading};
use crate::sensors::joint::JointNoise;
use shared_mem::cell::{Cell, Controller};
use shared_mem::msg::arm::{ArmMode, ArmState};
use shared_mem::msg::joints_from;
use shared_mem::theta::Theta;

#[derive(Clone)]
pub(super) struct SimArm {
    plant: Plant,
    pub(super) motion: ArmMotion,
    noise: JointNoise,
    q_d: Joints,
    dq_d: Joints,
    /// Velocities at the start of the period [rad/s].
    before: Joints,
}

impl SimArm {
    pub(super) fn new(
        cell: &Cell,
        nominal: ArmModel,
        theta: Option<&Theta>,
        effects: &ArmEffects,
    ) -> Result<Self, SimError> {
        let given = cell.simulation.q.len();
        if given != 0 && given != nominal.dof() {
            return Err(SimError::StartPose { given, dof: nominal.dof() });
        }
        let q = if given == 0 { *nominal.ready() } else { joints_from(&cell.simulation.q) };
        let zero = [0.0; MAX_JOINTS];
        let plant = Plant::new(cell, nominal, theta, effects)?;
        let (motion, noise) = (ArmMotion::unstarted(), JointNoise::new(cell));
        let mut arm = Self { plant, motion, noise, q_d: q, dq_d: zero, before: zero };
        arm.set(&q, &zero);
        Ok(arm)
    }

    /// Other gains and effects. The arm must be set or started afterwards.
    pub(super) fn set_parameters(
        &mut self,
        controller: Option<&Controller>,
        theta: &Theta,
        effects: &ArmEffects,
    ) -> Result<(), SimError> {
        self.plant.set(controller, Some(theta), effects)?;
        // What the former effects remembered may have another length.
        self.motion.memory = None;
        Ok(())
    }

    /// Evaluates the controller once for the coming period, from the state at its start.
    pub(super) fn begin_period(&mut self, drive: &Drive) {
        self.remember(drive);
        self.plant.rollout().begin(&mut self.motion, drive);
    }

    /// Moves on by `dt` under the period's motor torque and, perhaps, forces on the tool.
    pub(super) fn advance(&mut self, dt: f64, loads: &[PointForce]) {
        let mut external = [0.0; MAX_JOINTS];
        for load in loads {
            let torque = self.plant.arm().torque_of(&self.motion.state.q, load);
            external.iter_mut().zip(torque).for_each(|(sum, torque)| *sum += torque);
        }
        self.plant.rollout().advance(&mut self.motion, &external, dt);
    }

    pub(super) fn end_period(&mut self) {
        self.plant.rollout().sense(&mut self.motion, &self.before);
    }

    /// A whole period in which nothing touches the arm.
    pub(super) fn period(&mut self, drive: &Drive) {
        self.remember(drive);
        self.plant.rollout().period(&mut self.motion, drive);
    }

    fn remember(&mut self, drive: &Drive) {
        if let Drive::JointImpedance { q_d, dq_d } = drive {
            (self.q_d, self.dq_d) = (*q_d, *dq_d);
        }
        self.before = self.motion.state.dq;
    }

    pub(super) fn set(&mut self, q: &[f64], dq: &[f64]) {
        let state = JointState { q: joints_from(q), dq: joints_from(dq) };
        (self.q_d, self.dq_d) = (state.q, state.dq);
        self.plant.rollout().put(&mut self.motion, &state, &self.q_d, &self.dq_d);
    }

    /// Puts the arm where it is at the stamp `at_ns` of a command series.
    pub(super) fn start(&mut self, reading: &JointState, at_ns: u64, commands: &CommandTrack) {
        (self.q_d, self.dq_d) = (reading.q, reading.dq);
        self.plant.rollout().start(&mut self.motion, reading, at_ns, commands);
    }

    pub(super) fn reading(&self) -> Reading {
        self.plant.rollout().reading(&self.motion)
    }

    pub(super) fn state(&self) -> &JointState {
        &self.motion.state
    }

    pub(super) fn plant(&self) -> &Plant {
        &self.plant
    }

    pub(super) fn model(&self) -> &ArmModel {
        self.plant.arm()
    }

    /// The command in force, which an arm keeps that is told nothing new.
    pub(super) fn command(&self) -> Drive {
        Drive::JointImpedance { q_d: self.q_d, dq_d: self.dq_d }
    }

    pub(super) fn read(&mut self, out: &mut ArmState) {
        let dof = self.model().dof();
        out.dof = u32::try_from(dof).unwrap_or(0);
        out.mode = ArmMode::Move;
        let Reading { state, tau_J, tau_J_d } = self.reading();
        (out.q, out.dq) = (state.q, state.dq);
        self.noise.add(dof, &mut out.q, &mut out.dq);
        (out.q_d, out.dq_d) = (self.q_d, self.dq_d);
        (out.tau_J, out.tau_J_d) = (tau_J, tau_J_d);
        out.tau_ext = self.motion.external;
        if self.model().has_geometry() {
            out.O_T_EE = self.model().O_T_EE(&out.q);
        }
    }
}
