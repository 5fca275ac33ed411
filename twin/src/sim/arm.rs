//! The arm of the simulated cell: its plant, its motion, and what it reports.
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::SimError;
use super::joint_noise::JointNoise;
use super::tool_path::{Reaction, ToolPath};
use crate::arm::{ArmModel, FlangeMotion, JointState, Joints, MAX_JOINTS};
use crate::control::{ArmMotion, CommandTrack, Drive, Plant, Reading};
use crate::effects::{ArmEffects, ArmMemory, JointMemory};
use shared_mem::cell::{Cell, Controller};
use shared_mem::msg::arm::{ArmMode, ArmState};
use shared_mem::msg::joints_from;
use shared_mem::theta::Theta;
use shared_mem::time::TICK;

#[derive(Clone)]
pub(super) struct SimArm {
    plant: Plant,
    pub(super) motion: ArmMotion,
    noise: JointNoise,
    q_d: Joints,
    dq_d: Joints,
    /// Velocities at the start of the period [rad/s].
    before: Joints,
    /// Torque from outside that is known beforehand and holds for the period [N m].
    outside: Joints,
    /// Torque behind the gears in this period so far, times the share of it that has passed [N m].
    sensed: Joints,
    start: StretchStart,
    /// A period is integrated in so many parts.
    parts: u32,
}

/// The arm at the start of a stretch.
#[derive(Clone, Default)]
struct StretchStart {
    state: JointState,
    joints: Option<JointMemory>,
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
        let mut arm = Self {
            plant,
            motion,
            noise,
            q_d: q,
            dq_d: zero,
            before: zero,
            outside: zero,
            sensed: zero,
            start: StretchStart::default(),
            parts: 1,
        };
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
        if self.in_one_go(drive).is_none() {
            self.plant.rollout().begin(&mut self.motion, drive);
        }
    }

    /// See [`super::SimCell::refine`].
    pub(super) fn refine(&mut self, parts: u32) {
        self.parts = parts;
    }

    /// What the arm is to follow where controller and period can be computed together: its controller knows the arm
    /// exactly, nothing but the object pushes it, and the period is taken whole.
    fn in_one_go<'d>(&self, drive: &'d Drive) -> Option<(&'d Joints, &'d Joints)> {
        self.plant.rollout().exactly_known(drive).filter(|_| self.is_whole())
    }

    fn is_whole(&self) -> bool {
        self.parts == 1 && self.outside == [0.0; MAX_JOINTS]
    }

    /// Parts of a period in which the arm's way may be corrected after the contact: a link on its spring does not answer to
    /// a force as the path takes it, so it must be short for it.
    pub(super) fn stretches(&self) -> u32 {
        self.parts * if self.plant.yields_in_joints() { 4 } else { 1 }
    }

    /// Moves the arm on by `length` seconds of the period under `drive` as if nothing touched it; the tool's way there,
    /// which begins with `from`.
    pub(super) fn path(&mut self, drive: &Drive, from: FlangeMotion, length: f64) -> ToolPath {
        self.start =
            StretchStart { state: self.motion.state, joints: self.motion.memory.as_ref().map(ArmMemory::joints) };
        let rollout = self.plant.rollout();
        let yielding = if let Some(desired) = self.in_one_go(drive) {
            rollout.yielding_period(&mut self.motion, desired)
        } else {
            rollout.advance(&mut self.motion, &self.outside, length);
            let grip = self.motion.memory.as_ref().map_or([0.0; MAX_JOINTS], |memory| *memory.grip());
            self.plant.yielding(&self.start.state.q, &grip)
        };
        ToolPath::new(from, self.flange_motion(), length, yielding)
    }

    pub(super) fn flange_motion(&self) -> FlangeMotion {
        self.model().flange_motion(&self.motion.state)
    }

    /// What the contact along the path did to the arm.
    pub(super) fn end_path(&mut self, path: &ToolPath) {
        let rollout = self.plant.rollout();
        let share = path.length() / TICK;
        if path.was_pushed() {
            let Reaction { torque, dq, q } = path.reaction();
            if let (Some(memory), Some(joints)) = (&mut self.motion.memory, &self.start.joints) {
                memory.set_joints(joints);
                self.motion.state = self.start.state;
                let both = std::array::from_fn(|i| torque[i] + self.outside[i]);
                // What is known beforehand was counted on the way that is taken again here.
                for (sum, outside) in self.motion.external.iter_mut().zip(&self.outside) {
                    *sum -= outside * share;
                }
                rollout.advance(&mut self.motion, &both, path.length());
                if !self.plant.yields_in_joints() {
                    // The force acted early or late in the stretch, not evenly.
                    for i in 0..MAX_JOINTS {
                        self.motion.state.q[i] += q[i] - 0.5 * path.length() * dq[i];
                    }
                }
            } else {
                for i in 0..MAX_JOINTS {
                    self.motion.state.q[i] += q[i];
                    self.motion.state.dq[i] += dq[i];
                    self.motion.external[i] += torque[i] * share;
                }
            }
        }
        self.sense(share);
    }

    /// Adds what the sensors behind the gears measured in this `share` of the period.
    fn sense(&mut self, share: f64) {
        self.plant.rollout().sense(&mut self.motion, &self.before);
        for (sum, torque) in self.sensed.iter_mut().zip(&self.motion.tau_J) {
            *sum += torque * share;
        }
    }

    pub(super) fn end_period(&mut self) {
        match self.motion.memory {
            Some(_) => self.motion.tau_J = self.sensed,
            None => self.plant.rollout().sense(&mut self.motion, &self.before),
        }
    }

    /// A whole period in which nothing touches the arm.
    pub(super) fn period(&mut self, drive: &Drive) {
        self.remember(drive);
        if self.is_whole() {
            self.plant.rollout().period(&mut self.motion, drive);
            return;
        }
        self.plant.rollout().begin(&mut self.motion, drive);
        let share = 1.0 / f64::from(self.parts);
        for _ in 0..self.parts {
            self.plant.rollout().advance(&mut self.motion, &self.outside, TICK * share);
            self.sense(share);
        }
        self.end_period();
    }

    /// Has `torque` [N m] act on the joints from outside during the next period, beside the contact with the object.
    pub(super) fn push(&mut self, torque: Joints) {
        self.outside = torque;
    }

    fn remember(&mut self, drive: &Drive) {
        if let Drive::JointImpedance { q_d, dq_d } = drive {
            (self.q_d, self.dq_d) = (*q_d, *dq_d);
        }
        self.before = self.motion.state.dq;
        self.sensed = [0.0; MAX_JOINTS];
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

    pub(super) fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    pub(super) fn model(&self) -> &ArmModel {
        self.plant.arm()
    }

    /// The command in force, which an arm keeps until a new one.
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
