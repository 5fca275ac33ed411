//! Effects on the arm: on the way of the command, on the way of the torque, in the joints, in the bodies, in what is
//! reported. One set of calls serves every place that simulates an arm, in the order of a control period:
//! [`ArmEffects::command`], [`ArmEffects::measured`] for the controller, [`ArmEffects::motor_torque`],
//! [`ArmEffects::advance`]. What an effect remembers lies in an [`ArmMemory`]; nothing allocates once that is made.
//! Units SI; joint arrays as everywhere in [`crate::arm`].
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

pub(super) mod base_tilt;
pub(super) mod command_delay;
pub(super) mod command_lag;
mod delay_line;
pub(super) mod integral_action;
pub(super) mod joint_backlash;
pub(super) mod joint_coulomb_friction;
pub(super) mod joint_elasticity;
pub(super) mod joint_encoder_offset;
pub(super) mod joint_friction_asymmetry;
pub(super) mod joint_load_friction;
pub(super) mod joint_presliding_friction;
pub(super) mod joint_stribeck_friction;
pub(super) mod joint_viscous_friction;
pub(super) mod joint_weight;
mod memory;
pub(super) mod payload;
pub(super) mod rotor_inertia;
#[cfg(test)]
mod test_arm;
pub(super) mod torque_delay;
pub(super) mod torque_gain;
pub(super) mod torque_ripple;
pub(super) mod torque_saturation;
pub(super) mod torque_sensor_bias;
mod transmission;
pub(super) mod voltage_saturation;

pub use memory::ArmMemory;
pub(crate) use memory::JointMemory;

use super::hit::tool_offset::ToolOffset;
use crate::arm::{ArmModel, ControlLaw, JointState, Joints, Transmission};
use shared_mem::cell::ControllerKind;
use shared_mem::time::TICK;

/// The effects on an arm that are installed. Constant over time: one set may serve many rollouts at once.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ArmEffects {
    pub(super) joint_coulomb_friction: Option<joint_coulomb_friction::JointCoulombFriction>,
    pub(super) joint_viscous_friction: Option<joint_viscous_friction::JointViscousFriction>,
    pub(super) joint_stribeck_friction: Option<joint_stribeck_friction::JointStribeckFriction>,
    pub(super) joint_friction_asymmetry: Option<joint_friction_asymmetry::JointFrictionAsymmetry>,
    pub(super) joint_load_friction: Option<joint_load_friction::JointLoadFriction>,
    pub(super) joint_presliding_friction: Option<joint_presliding_friction::JointPreslidingFriction>,
    pub(super) command_delay: Option<command_delay::CommandDelay>,
    pub(super) command_lag: Option<command_lag::CommandLag>,
    pub(super) integral_action: Option<integral_action::IntegralAction>,
    pub(super) torque_delay: Option<torque_delay::TorqueDelay>,
    pub(super) rotor_inertia: Option<rotor_inertia::RotorInertia>,
    pub(super) payload: Option<payload::Payload>,
    pub(super) tool_offset: Option<ToolOffset>,
    pub(super) torque_gain: Option<torque_gain::TorqueGain>,
    pub(super) joint_elasticity: Option<joint_elasticity::JointElasticity>,
    pub(super) joint_backlash: Option<joint_backlash::JointBacklash>,
    pub(super) joint_encoder_offset: Option<joint_encoder_offset::JointEncoderOffset>,
    pub(super) torque_saturation: Option<torque_saturation::TorqueSaturation>,
    pub(super) voltage_saturation: Option<voltage_saturation::VoltageSaturation>,
    pub(super) torque_ripple: Option<torque_ripple::TorqueRipple>,
    pub(super) torque_sensor_bias: Option<torque_sensor_bias::TorqueSensorBias>,
    pub(super) base_tilt: Option<base_tilt::BaseTilt>,
    pub(super) joint_weight: Option<joint_weight::JointWeight>,
}

impl ArmEffects {
    /// Whether there is none.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The arm that moves, made from the one that the controller knows.
    #[must_use]
    pub fn real_arm(&self, nominal: &ArmModel) -> ArmModel {
        let mut arm = nominal.clone();
        if let Some(effect) = &self.rotor_inertia {
            effect.apply(&mut arm);
        }
        if let Some(effect) = &self.payload {
            effect.apply(&mut arm);
        }
        if let Some(effect) = &self.tool_offset {
            effect.apply(&mut arm);
        }
        if let Some(effect) = &self.base_tilt {
            effect.apply(&mut arm);
        }
        arm
    }

    /// The true state behind a reading, and a memory in which the arm has been there with this command for long.
    ///
    /// A gear that yields carries the arm's weight from the start.
    #[must_use]
    pub fn start(&self, arm: &ArmModel, reading: &JointState, q_d: &Joints, dq_d: &Joints) -> (JointState, ArmMemory) {
        let mut memory = ArmMemory::new(self, q_d, dq_d);
        let state = self.restart(&mut memory, arm, reading, q_d, dq_d);
        (state, memory)
    }

    /// [`ArmEffects::start`] in a memory that was made by these effects, without allocating.
    #[must_use]
    pub fn restart(
        &self,
        memory: &mut ArmMemory,
        arm: &ArmModel,
        reading: &JointState,
        q_d: &Joints,
        dq_d: &Joints,
    ) -> JointState {
        memory.restart(q_d, dq_d);
        let mut state = *reading;
        if let Some(effect) = &self.joint_encoder_offset {
            state.q = std::array::from_fn(|i| state.q[i] - effect.offset[i]);
        }
        memory.motor = state;
        memory.tau_J = arm.gravity(&state.q);
        if let Some(effect) = &self.joint_weight {
            let held = effect.held_at(&state.q);
            memory.tau_J.iter_mut().zip(held).for_each(|(tau, held)| *tau += held);
        }
        for i in 0..arm.dof() {
            state.q[i] -= self.twist_under(i, memory.tau_J[i]);
        }
        state
    }

    /// The command as it reaches the controller, one tick after the other.
    #[must_use]
    pub fn command(&self, memory: &mut ArmMemory, q_d: &Joints, dq_d: &Joints) -> (Joints, Joints) {
        let (mut q_d, mut dq_d) = (*q_d, *dq_d);
        if self.command_delay.is_some() {
            (q_d, dq_d) = (memory.q_d.after(&q_d), memory.dq_d.after(&dq_d));
        }
        if let Some(lag) = &self.command_lag {
            (q_d, dq_d) = (lag.follow(&mut memory.lagging.q, &q_d), lag.follow(&mut memory.lagging.dq, &dq_d));
        }
        (q_d, dq_d)
    }

    /// Ticks after which nothing is left of a command; 0 where commands arrive at once.
    #[must_use]
    pub fn command_ticks(&self) -> u64 {
        let delay = self.command_delay.map_or(0.0, |effect| effect.delay);
        let lag = self.command_lag.map_or(0.0, |effect| effect.settling_time());
        ((delay + lag) / TICK).ceil() as u64
    }

    /// What the encoders tell about `state`; they sit on the motors.
    #[must_use]
    pub fn measured(&self, memory: &ArmMemory, state: &JointState) -> JointState {
        let mut reading = if self.yields() { memory.motor } else { *state };
        if let Some(effect) = &self.joint_encoder_offset {
            reading.q = std::array::from_fn(|i| reading.q[i] + effect.offset[i]);
        }
        reading
    }

    /// What the controller asks for where it does more than its law, one tick after the other [N m]. `tau`: what the law asks for at
    /// `reading` under the command `q_d` that reaches it, gravity included.
    #[must_use]
    pub fn asked(
        &self,
        memory: &mut ArmMemory,
        (arm, law): (&ArmModel, &ControlLaw),
        (reading, q_d): (&JointState, &Joints),
        tau: &Joints,
    ) -> Joints {
        let Some(effect) = self.integral_action.as_ref().filter(|_| law.kind != ControllerKind::Tracking) else {
            return *tau;
        };
        let summed = memory.summed.get_or_insert_with(|| effect.settled(arm, reading, tau));
        effect.asked(summed, law, (reading, q_d), tau)
    }

    /// The motors' torque for the torque that the controller asks for, one tick after the other [N m]. `damped`: what of that the
    /// controller's damping takes at the joints' own velocities [N m].
    #[must_use]
    pub fn motor_torque(&self, memory: &mut ArmMemory, tau: &Joints, damped: &Joints) -> Joints {
        let mut tau = *tau;
        if self.torque_delay.is_some() {
            tau = memory.torque.after(&tau);
        }
        if let Some(effect) = &self.torque_gain {
            tau = effect.apply(&tau);
        }
        if let Some(effect) = &self.voltage_saturation {
            tau = effect.apply(&tau, damped);
        }
        if let Some(effect) = &self.torque_saturation {
            tau = effect.apply(&tau);
        }
        tau
    }

    /// Moves `state` on by `dt` seconds under constant torques of the motors and from outside [N m].
    pub fn advance(
        &self,
        memory: &mut ArmMemory,
        arm: &ArmModel,
        state: &mut JointState,
        (motor_torque, external): (&Joints, &Joints),
        dt: f64,
    ) {
        let external = &self.joint_weight.as_ref().map_or(*external, |effect| effect.beside(external, state, dt));
        if self.acts_in_joints() {
            let passed = self.advance_through(memory, arm, state, (motor_torque, external), dt);
            (memory.tau_J, memory.grip) = (passed.tau_J, passed.grip);
            return;
        }
        let before = state.dq;
        let total = std::array::from_fn(|i| motor_torque[i] + external[i]);
        arm.step(state, &total, dt);
        let rotor = arm.rotor_inertia();
        memory.motor = *state;
        memory.tau_J = std::array::from_fn(|i| motor_torque[i] - rotor[i] * (state.dq[i] - before[i]) / dt);
    }

    /// What friction, ripple and weight that the model lacks take of the motor's torque of a joint that moves so [N m].
    #[must_use]
    pub fn taken(&self, joint: usize, state: &JointState, motor_torque: f64) -> f64 {
        let dq = state.dq[joint];
        let dry = if dq == 0.0 { 0.0 } else { dq.signum() * self.dry_friction(joint, dq.abs(), motor_torque) };
        let weight = self.joint_weight.map_or(0.0, |effect| effect.held_at(&state.q)[joint]);
        dry + self.drag(joint, state.q[joint], dq) + weight
    }

    /// What the torque sensors behind the gears tell: mean over the last step [N m].
    #[must_use]
    pub fn tau_J(&self, memory: &ArmMemory) -> Joints {
        match &self.torque_sensor_bias {
            None => memory.tau_J,
            Some(effect) => std::array::from_fn(|i| memory.tau_J[i] + effect.bias[i]),
        }
    }
}
