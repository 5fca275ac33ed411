//! The arm of the simulated cell: its model, the controller inside the robot, and what it reports.
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::SimError;
use crate::arm::{ArmModel, ControlLaw, JointState, Joints, MAX_JOINTS, PointForce};
use crate::effects::{ArmEffects, ArmMemory};
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

/// What the arm has that its controller does not know.
struct Hidden {
    effects: ArmEffects,
    memory: ArmMemory,
    /// The model inside the controller.
    nominal: ArmModel,
}

pub(super) struct SimArm {
    model: ArmModel,
    /// `None` for an arm that is as cell.toml says.
    hidden: Option<Hidden>,
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
    pub(super) fn new(
        cell: &Cell,
        nominal: ArmModel,
        theta: Option<&Theta>,
        effects: &ArmEffects,
    ) -> Result<Self, SimError> {
        let law = ControlLaw::new(cell.controller.as_ref(), theta.and_then(|t| t.arm.as_ref()), &nominal)?;
        let given = cell.simulation.q.len();
        if given != 0 && given != nominal.dof() {
            return Err(SimError::StartPose { given, dof: nominal.dof() });
        }
        let q = if given == 0 { *nominal.ready() } else { joints_from(&cell.simulation.q) };
        let zero = [0.0; MAX_JOINTS];
        let mut state = JointState::at_rest(q);
        let motor = nominal.gravity(&q);
        let (model, hidden) = if effects.is_none() {
            (nominal, None)
        } else {
            let real = effects.real_arm(&nominal);
            let (started, memory) = effects.start(&real, &state, &q, &zero);
            state = started;
            (real, Some(Hidden { effects: effects.clone(), memory, nominal }))
        };
        Ok(Self {
            model,
            hidden,
            law,
            state,
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
        let reading = self.reading();
        let gravity = self.nominal().gravity(&reading.q);
        let asked = match drive {
            Drive::JointImpedance { q_d, dq_d } => {
                (self.q_d, self.dq_d) = (*q_d, *dq_d);
                let (q_d, dq_d) = match &mut self.hidden {
                    Some(hidden) => hidden.effects.command(&mut hidden.memory, q_d, dq_d),
                    None => (*q_d, *dq_d),
                };
                self.law.torque(self.nominal(), &reading, &q_d, &dq_d)
            }
            Drive::Torque { tau_J_d } => {
                let limit = &self.law.torque_limit;
                std::array::from_fn(|i| (tau_J_d[i] + gravity[i]).clamp(-limit[i], limit[i]))
            }
        };
        self.tau_J_d = std::array::from_fn(|i| asked[i] - gravity[i]);
        self.motor = match &mut self.hidden {
            Some(hidden) => hidden.effects.motor_torque(&mut hidden.memory, &asked),
            None => asked,
        };
        self.external = [0.0; MAX_JOINTS];
    }

    /// Moves on by `dt` under the period's motor torque and, perhaps, forces on the tool.
    pub(super) fn advance(&mut self, dt: f64, loads: &[PointForce]) {
        let mut external = [0.0; MAX_JOINTS];
        for load in loads {
            let torque = self.model.torque_of(&self.state.q, load);
            external.iter_mut().zip(torque).for_each(|(sum, torque)| *sum += torque);
        }
        let mut tau = self.motor;
        for i in 0..MAX_JOINTS {
            tau[i] += external[i];
            self.external[i] += external[i] * (dt / super::PERIOD);
        }
        match &mut self.hidden {
            None => self.model.step(&mut self.state, &tau, dt),
            Some(Hidden { effects, memory, .. }) => {
                effects.advance(memory, &self.model, &mut self.state, (&self.motor, &external), dt);
            }
        }
    }

    pub(super) fn set(&mut self, q: &[f64], dq: &[f64]) {
        self.state = JointState { q: joints_from(q), dq: joints_from(dq) };
        (self.q_d, self.dq_d) = (self.state.q, self.state.dq);
        self.motor = self.nominal().gravity(&self.state.q);
        self.external = [0.0; MAX_JOINTS];
        if let Some(Hidden { effects, memory, .. }) = &mut self.hidden {
            (self.state, *memory) = effects.start(&self.model, &self.state, &self.q_d, &self.dq_d);
        }
    }

    /// What encoders without noise read.
    pub(super) fn reading(&self) -> JointState {
        self.hidden.as_ref().map_or(self.state, |hidden| hidden.effects.measured(&hidden.memory, &self.state))
    }

    /// The model inside the controller.
    fn nominal(&self) -> &ArmModel {
        self.hidden.as_ref().map_or(&self.model, |hidden| &hidden.nominal)
    }

    pub(super) fn state(&self) -> &JointState {
        &self.state
    }

    pub(super) fn model(&self) -> &ArmModel {
        &self.model
    }

    /// What a sensor between gear and link reads: the motor's torque less what turns the rotor.
    pub(super) fn tau_J(&self) -> Joints {
        if let Some(hidden) = &self.hidden {
            return hidden.effects.tau_J(&hidden.memory);
        }
        let total = std::array::from_fn(|i| self.motor[i] + self.external[i]);
        let acceleration = self.model.accelerations(&self.state, &total);
        let rotor = self.model.rotor_inertia();
        std::array::from_fn(|i| self.motor[i] - rotor[i] * acceleration[i])
    }

    pub(super) fn read(&mut self, out: &mut ArmState) {
        let dof = self.model.dof();
        out.dof = u32::try_from(dof).unwrap_or(0);
        out.mode = ArmMode::Move;
        let reading = self.reading();
        (out.q, out.dq) = (reading.q, reading.dq);
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
