//! Effects on the arm: on the way of the command, on the way of the torque, in the joints, in the bodies, in what is
//! reported. One set of calls serves every place that simulates an arm, in the order of a control period:
//! [`ArmEffects::command`], [`ArmEffects::measured`] for the controller, [`ArmEffects::motor_torque`],
//! [`ArmEffects::advance`]. What an effect remembers lies in an [`ArmMemory`]; nothing allocates once that is made.
//! Units SI; joint arrays as everywhere in [`crate::arm`].
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

mod delay_line;
mod effect;
mod memory;
#[cfg(test)]
mod test_arm;
mod transmission;

pub use memory::ArmMemory;
pub(crate) use memory::JointMemory;

use super::hit::tool_offset::ToolOffset;
use super::info::EffectInfo;
use crate::arm::{ArmModel, ControlLaw, JointState, Joints, Slip, Transmission};
use effect::ArmEffect;
use shared_mem::cell::ControllerKind;
use shared_mem::time::TICK;

/// The list of all effects on the arm: a file and its line here are an effect. What effects do side by side is added up in
/// this order; what one does to another's result, or remembers, is called by name below.
macro_rules! effects_on_the_arm {
    ($($name:ident: $Effect:ident),* $(,)?) => {
        $(pub(super) mod $name;)*

        /// What each of them says of itself.
        pub(super) const EFFECTS: &[EffectInfo] = &[$($name::EFFECT),*];

        /// The effects on an arm that are installed. Constant over time: one set may serve many rollouts at once.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct ArmEffects {
            $(pub(super) $name: Option<$name::$Effect>,)*
            pub(super) tool_offset: Option<ToolOffset>,
        }

        impl ArmEffects {
            /// Whether friction or a gear that yields lies between motors and links.
            pub(crate) fn acts_in_joints(&self) -> bool {
                $((<$name::$Effect as ArmEffect>::IN_JOINTS && self.$name.is_some()))||*
            }

            /// Changes the bodies of the arm that moves.
            fn change(&self, arm: &mut ArmModel) {
                $(if let Some(effect) = &self.$name {
                    effect.change(arm);
                })*
            }

            fn all_dry_friction(&self, joint: usize, slip: Slip) -> f64 {
                let mut all = 0.0;
                $(if <$name::$Effect as ArmEffect>::IN_JOINTS && let Some(effect) = &self.$name {
                    all += effect.dry_friction(joint, slip);
                })*
                all
            }

            fn largest_creep(&self, joint: usize) -> f64 {
                let mut largest: f64 = 0.0;
                $(if <$name::$Effect as ArmEffect>::IN_JOINTS && let Some(effect) = &self.$name {
                    largest = largest.max(effect.creep(joint));
                })*
                largest
            }

            fn falls_over(&self, joint: usize) -> f64 {
                let mut largest: f64 = 0.0;
                $(if <$name::$Effect as ArmEffect>::IN_JOINTS && let Some(effect) = &self.$name {
                    largest = largest.max(effect.falls_over(joint));
                })*
                largest
            }

            fn all_drag(&self, joint: usize, q: f64, dq: f64) -> f64 {
                let mut all = 0.0;
                $(if <$name::$Effect as ArmEffect>::IN_JOINTS && let Some(effect) = &self.$name {
                    all += effect.drag(joint, q, dq);
                })*
                all
            }
        }
    };
}

effects_on_the_arm! {
    joint_coulomb_friction: JointCoulombFriction,
    joint_viscous_friction: JointViscousFriction,
    joint_stribeck_friction: JointStribeckFriction,
    joint_friction_asymmetry: JointFrictionAsymmetry,
    joint_load_friction: JointLoadFriction,
    joint_presliding_friction: JointPreslidingFriction,
    joint_position_dependent_friction: JointPositionDependentFriction,
    command_delay: CommandDelay,
    command_lag: CommandLag,
    integral_action: IntegralAction,
    torque_delay: TorqueDelay,
    rotor_inertia: RotorInertia,
    payload: Payload,
    torque_gain: TorqueGain,
    joint_elasticity: JointElasticity,
    joint_backlash: JointBacklash,
    joint_encoder_offset: JointEncoderOffset,
    torque_saturation: TorqueSaturation,
    voltage_saturation: VoltageSaturation,
    torque_ripple: TorqueRipple,
    torque_sensor_bias: TorqueSensorBias,
    base_tilt: BaseTilt,
    joint_weight: JointWeight,
}

impl ArmEffects {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The arm that moves, made from the one that the controller knows.
    pub fn real_arm(&self, nominal: &ArmModel) -> ArmModel {
        let mut arm = nominal.clone();
        self.change(&mut arm);
        if let Some(effect) = &self.tool_offset {
            effect.apply(&mut arm);
        }
        arm
    }

    /// The true state behind a reading, and a memory in which the arm has been there with this command for long.
    ///
    /// A gear that yields carries the arm's weight from the start.
    pub fn start(&self, arm: &ArmModel, reading: &JointState, q_d: &Joints, dq_d: &Joints) -> (JointState, ArmMemory) {
        let mut memory = ArmMemory::new(self, q_d, dq_d);
        let state = self.restart(&mut memory, arm, reading, q_d, dq_d);
        (state, memory)
    }

    /// [`ArmEffects::start`] in a memory that was made by these effects, without allocating.
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
    pub fn command_ticks(&self) -> u64 {
        let delay = self.command_delay.map_or(0.0, |effect| effect.delay);
        let lag = self.command_lag.map_or(0.0, |effect| effect.settling_time());
        ((delay + lag) / TICK).ceil() as u64
    }

    /// What the encoders tell about `state`; they sit on the motors.
    pub fn measured(&self, memory: &ArmMemory, state: &JointState) -> JointState {
        let mut reading = if self.yields() { memory.motor } else { *state };
        if let Some(effect) = &self.joint_encoder_offset {
            reading.q = std::array::from_fn(|i| reading.q[i] + effect.offset[i]);
        }
        reading
    }

    /// What the controller asks for where it does more than its law, one tick after the other [N m]. `tau`: what the law asks for at
    /// `reading` under the command `q_d` that reaches it, gravity included.
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
    pub fn taken(&self, joint: usize, state: &JointState, motor_torque: f64) -> f64 {
        let dq = state.dq[joint];
        let dry = if dq == 0.0 {
            0.0
        } else {
            dq.signum() * self.dry_friction(joint, Slip { q: state.q[joint], speed: dq.abs(), motor_torque })
        };
        let weight = self.joint_weight.map_or(0.0, |effect| effect.held_at(&state.q)[joint]);
        dry + self.drag(joint, state.q[joint], dq) + weight
    }

    /// What the torque sensors behind the gears tell: mean over the last step [N m].
    pub fn tau_J(&self, memory: &ArmMemory) -> Joints {
        match &self.torque_sensor_bias {
            None => memory.tau_J,
            Some(effect) => std::array::from_fn(|i| memory.tau_J[i] + effect.bias[i]),
        }
    }
}
