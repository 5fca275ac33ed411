//! The arm of the simulated cell: its model, the controller inside the robot, and what it reports.
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::SimError;
use crate::arm::{ArmModel, ControlLaw, JointState, Joints, MAX_JOINTS, PointForce};
use crate::sensors::joint::JointNoise;
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmMode, ArmState};
use shared_mem::msg::joints_from;
use shared_mem::theta::Theta;

/// What the arm is told for one control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// The controller of cell.toml runs inside the robot and follows these.
    JointImpedance {
        /// Desired positions [rad].
        q_d: Joints,
        /// Desired velocities [rad/s].
        dq_d: Joints,
    },
    /// The client runs the controller. As on a Franka, the robot adds gravity, and the client whatever else it wants.
    Torque {
        /// Desired torques without gravity [N m].
        tau_J_d: Joints,
    },
}

pub(super) struct SimArm {
    model: ArmModel,
    law: ControlLaw,
    state: JointState,
    noise: JointNoise,
    q_d: Joints,
    dq_d: Joints,
    tau_J_d: Joints,
    /// Torque of the motors, gravity included, constant over a period [N m].
    motor: Joints,
    /// What the contact adds, mean over the last period [N m].
    external: Joints,
}

impl SimArm {
    pub(super) fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, SimError> {
        let model = ArmModel::from_cell(cell)?;
        let law = ControlLaw::new(cell.controller.as_ref(), theta.and_then(|t| t.arm.as_ref()), &model)?;
        let given = cell.simulation.q.len();
        if given != 0 && given != model.dof() {
            return Err(SimError::StartPose { given, dof: model.dof() });
        }
        let q = if given == 0 { *model.ready() } else { joints_from(&cell.simulation.q) };
        let motor = model.gravity(&q);
        let zero = [0.0; MAX_JOINTS];
        Ok(Self {
            model,
            law,
            state: JointState::at_rest(q),
            noise: JointNoise::new(cell),
            q_d: q,
            dq_d: zero,
            tau_J_d: zero,
            motor,
            external: zero,
        })
    }

    /// Evaluates the controller once for the coming period, from the state at its start.
    pub(super) fn begin_period(&mut self, drive: &Drive) {
        let gravity = self.model.gravity(&self.state.q);
        self.motor = match drive {
            Drive::JointImpedance { q_d, dq_d } => {
                (self.q_d, self.dq_d) = (*q_d, *dq_d);
                self.law.torque(&self.model, &self.state, q_d, dq_d)
            }
            Drive::Torque { tau_J_d } => {
                let limit = &self.law.torque_limit;
                std::array::from_fn(|i| (tau_J_d[i] + gravity[i]).clamp(-limit[i], limit[i]))
            }
        };
        self.tau_J_d = std::array::from_fn(|i| self.motor[i] - gravity[i]);
        self.external = [0.0; MAX_JOINTS];
    }

    /// Moves on by `dt` under the period's motor torque and, perhaps, a force on the tool.
    pub(super) fn advance(&mut self, dt: f64, load: Option<&PointForce>) {
        let mut tau = self.motor;
        if let Some(load) = load {
            let external = self.model.torque_of(&self.state.q, load);
            for i in 0..MAX_JOINTS {
                tau[i] += external[i];
                self.external[i] += external[i] * (dt / super::PERIOD);
            }
        }
        self.model.step(&mut self.state, &tau, dt);
    }

    pub(super) fn set(&mut self, q: &[f64], dq: &[f64]) {
        self.state = JointState { q: joints_from(q), dq: joints_from(dq) };
        (self.q_d, self.dq_d) = (self.state.q, self.state.dq);
        self.motor = self.model.gravity(&self.state.q);
        self.external = [0.0; MAX_JOINTS];
    }

    pub(super) fn state(&self) -> &JointState {
        &self.state
    }

    pub(super) fn model(&self) -> &ArmModel {
        &self.model
    }

    /// What a sensor between gear and link reads: the motor's torque less what turns the rotor.
    pub(super) fn tau_J(&self) -> Joints {
        let total = std::array::from_fn(|i| self.motor[i] + self.external[i]);
        let acceleration = self.model.accelerations(&self.state, &total);
        let rotor = self.model.rotor_inertia();
        std::array::from_fn(|i| self.motor[i] - rotor[i] * acceleration[i])
    }

    pub(super) fn read(&mut self, out: &mut ArmState) {
        let dof = self.model.dof();
        out.dof = u32::try_from(dof).unwrap_or(0);
        out.mode = ArmMode::Move;
        (out.q, out.dq) = (self.state.q, self.state.dq);
        self.noise.add(dof, &mut out.q, &mut out.dq);
        (out.q_d, out.dq_d) = (self.q_d, self.dq_d);
        out.tau_J = self.tau_J();
        out.tau_J_d = self.tau_J_d;
        out.tau_ext = self.external;
        if self.model.has_geometry() {
            out.O_T_EE = self.model.O_T_EE(&out.q);
        }
    }
}
