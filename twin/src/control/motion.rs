//! One control period of an arm: the controller is evaluated once, its torque holds, the arm moves. Whatever simulates an
//! arm (a rollout, the simulated cell, the shadow) comes through here. SI, joint arrays as in [`crate::arm`].
#![allow(non_snake_case)] // the Franka Control Interface's own symbols

use super::{ArmRollout, CommandTrack};
use crate::arm::{JointState, Joints, MAX_JOINTS, Yielding};
use crate::effects::ArmMemory;
use shared_mem::time::{TICK, TICK_NS};

/// The command of an arm for one control period.
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

/// What an arm's sensors tell, without noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reading {
    /// What the encoders read.
    pub state: JointState,
    /// Torque behind the gears, gravity included, mean over the period that ends here [N m].
    pub tau_J: Joints,
    /// Torque that the controller asked for in that period, without gravity [N m].
    pub tau_J_d: Joints,
}

/// An arm on its way: everything about it that changes over time.
#[derive(Debug)]
pub(crate) struct ArmMotion {
    /// True state of the links.
    pub(crate) state: JointState,
    /// What the effects remember; `None` for an arm without.
    pub(crate) memory: Option<ArmMemory>,
    /// Torque of the motors, gravity included, constant over a period [N m].
    pub(crate) motor: Joints,
    /// What forces on the tool add, mean over the last period [N m].
    pub(crate) external: Joints,
    /// Torque behind the gears, mean over the last period [N m].
    pub(crate) tau_J: Joints,
    /// Asked for in the last period, without gravity [N m].
    pub(crate) tau_J_d: Joints,
    /// Velocity that was desired in the last period, as it reached the controller [rad/s]; `None` before the first.
    pub(crate) dq_d: Option<Joints>,
}

impl Clone for ArmMotion {
    fn clone(&self) -> Self {
        Self { memory: self.memory.clone(), ..*self }
    }

    /// Reuses what the memory holds already: a checkpoint is taken and resumed without allocating.
    fn clone_from(&mut self, source: &Self) {
        let memory = match (self.memory.take(), &source.memory) {
            (Some(mut memory), Some(from)) => {
                memory.clone_from(from);
                Some(memory)
            }
            (_, from) => from.clone(),
        };
        *self = Self { memory, ..*source };
    }
}

impl ArmMotion {
    /// An arm that is about to be started.
    pub(crate) fn unstarted() -> Self {
        let (state, zero) = (JointState::default(), [0.0; MAX_JOINTS]);
        Self { state, memory: None, motor: zero, external: zero, tau_J: zero, tau_J_d: zero, dq_d: None }
    }

    /// Notes the torque of a controller that knows the arm exactly.
    fn command(&mut self, tau: &Joints, gravity: &Joints) {
        self.motor = *tau;
        self.tau_J_d = std::array::from_fn(|i| tau[i] - gravity[i]);
        self.external = [0.0; MAX_JOINTS];
    }
}

impl ArmRollout<'_> {
    /// Puts `motion` where the encoders read `reading`, the arm having been there with the command `q_d`, `dq_d` for long.
    pub(crate) fn put(&self, motion: &mut ArmMotion, reading: &JointState, q_d: &Joints, dq_d: &Joints) {
        motion.state = *reading;
        match (self.effects, &mut motion.memory) {
            (None, memory) => *memory = None,
            (Some(effects), Some(memory)) => motion.state = effects.restart(memory, self.arm, reading, q_d, dq_d),
            (Some(effects), memory) => {
                let (state, fresh) = effects.start(self.arm, reading, q_d, dq_d);
                (motion.state, *memory) = (state, Some(fresh));
            }
        }
        let gravity = self.nominal.gravity(&reading.q);
        (motion.motor, motion.tau_J) = (gravity, gravity);
        (motion.external, motion.tau_J_d) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        motion.dq_d = None;
    }

    /// The same at the stamp `at_ns` of a command series: commands of the time before that are still on their way count.
    pub(crate) fn start(&self, motion: &mut ArmMotion, reading: &JointState, at_ns: u64, commands: &CommandTrack) {
        self.put(motion, reading, commands.q_d(0), commands.dq_d(0));
        let (Some(effects), Some(memory)) = (self.effects, &mut motion.memory) else { return };
        let mut row = 0;
        for tick in (1..=effects.command_ticks()).rev() {
            let Some(tick_ns) = at_ns.checked_sub(tick * TICK_NS) else { continue };
            row = commands.in_force(tick_ns, row);
            let _ = effects.command(memory, commands.q_d(row), commands.dq_d(row));
        }
    }

    /// Lets one control period pass without anything touching the arm.
    pub(crate) fn period(&self, motion: &mut ArmMotion, drive: &Drive) {
        let before = motion.state.dq;
        if let Some((q_d, dq_d)) = self.exactly_known(drive).filter(|_| self.parts == 1) {
            let (tau, gravity) = self.arm.controlled_step(&mut motion.state, self.law, q_d, dq_d, TICK);
            motion.command(&tau, &gravity);
            self.sense(motion, &before);
            return;
        }
        self.begin(motion, drive);
        let (share, mut sensed) = (1.0 / f64::from(self.parts), [0.0; MAX_JOINTS]);
        for _ in 0..self.parts {
            self.advance(motion, &[0.0; MAX_JOINTS], share * TICK);
            self.sense(motion, &before);
            sensed.iter_mut().zip(&motion.tau_J).for_each(|(sum, torque)| *sum += share * torque);
        }
        // Effects tell of each part by itself; else the velocities at both ends of the period do.
        if motion.memory.is_some() {
            motion.tau_J = sensed;
        }
    }

    /// What an arm is to follow that is just what its controller believes it to be.
    pub(crate) fn exactly_known<'d>(&self, drive: &'d Drive) -> Option<(&'d Joints, &'d Joints)> {
        match drive {
            Drive::JointImpedance { q_d, dq_d } if std::ptr::eq(self.arm, self.nominal) && self.law.needs_no_mass() => {
                Some((q_d, dq_d))
            }
            _ => None,
        }
    }

    /// [`ArmRollout::begin`] and the whole period without contact for such an arm, for the price of one of them; how it
    /// yields at the start.
    pub(crate) fn yielding_period(&self, motion: &mut ArmMotion, desired: (&Joints, &Joints)) -> Yielding {
        let (tau, gravity, yielding) = self.arm.yielding_step(&mut motion.state, self.law, desired, TICK);
        motion.command(&tau, &gravity);
        yielding
    }

    /// Evaluates the controller for the coming period, from what the encoders read at its start.
    pub(crate) fn begin(&self, motion: &mut ArmMotion, drive: &Drive) {
        let reading = self.encoders(motion);
        let gravity = self.nominal.gravity(&reading.q);
        let asked = match drive {
            Drive::JointImpedance { q_d, dq_d } => {
                let (q_d, dq_d) = match (self.effects, &mut motion.memory) {
                    (Some(effects), Some(memory)) => effects.command(memory, q_d, dq_d),
                    _ => (*q_d, *dq_d),
                };
                let before = motion.dq_d.replace(dq_d).unwrap_or(dq_d);
                let tau = self.law.torque_after(self.nominal, &reading, (&q_d, &dq_d), &before);
                match (self.effects, &mut motion.memory) {
                    (Some(effects), Some(memory)) => {
                        effects.asked(memory, (self.arm, self.law), (&reading, &q_d), &tau)
                    }
                    _ => tau,
                }
            }
            Drive::Torque { tau_J_d } => {
                let limit = &self.law.torque_limit;
                std::array::from_fn(|i| (tau_J_d[i] + gravity[i]).clamp(-limit[i], limit[i]))
            }
        };
        motion.tau_J_d = std::array::from_fn(|i| asked[i] - gravity[i]);
        motion.motor = match (self.effects, &mut motion.memory) {
            (Some(effects), Some(memory)) => effects.motor_torque(memory, &asked, &self.damped(drive, &reading)),
            _ => asked,
        };
        motion.external = [0.0; MAX_JOINTS];
    }

    /// What the controller's damping takes at the joints' own velocities [N m]; nothing where no gains are known.
    fn damped(&self, drive: &Drive, reading: &JointState) -> Joints {
        match drive {
            Drive::JointImpedance { .. } if self.law.damps() => {
                std::array::from_fn(|i| self.law.damping[i] * reading.dq[i])
            }
            Drive::JointImpedance { .. } | Drive::Torque { .. } => [0.0; MAX_JOINTS],
        }
    }

    /// Moves on by `dt` under the period's motor torque and torques from outside [N m].
    pub(crate) fn advance(&self, motion: &mut ArmMotion, external: &Joints, dt: f64) {
        for (sum, torque) in motion.external.iter_mut().zip(external) {
            *sum += torque * (dt / TICK);
        }
        match (self.effects, &mut motion.memory) {
            (Some(effects), Some(memory)) => {
                effects.advance(memory, self.arm, &mut motion.state, (&motion.motor, external), dt);
            }
            _ => {
                let total = std::array::from_fn(|i| motion.motor[i] + external[i]);
                self.arm.step(&mut motion.state, &total, dt);
            }
        }
    }

    /// Notes what the sensors behind the gears tell about the period that began with velocities `before`.
    pub(crate) fn sense(&self, motion: &mut ArmMotion, before: &Joints) {
        motion.tau_J = match (self.effects, &motion.memory) {
            (Some(effects), Some(memory)) => effects.tau_J(memory),
            _ => {
                let rotor = self.arm.rotor_inertia();
                std::array::from_fn(|i| motion.motor[i] - rotor[i] * (motion.state.dq[i] - before[i]) / TICK)
            }
        };
    }

    /// What encoders without noise read.
    pub(crate) fn encoders(&self, motion: &ArmMotion) -> JointState {
        match (self.effects, &motion.memory) {
            (Some(effects), Some(memory)) => effects.measured(memory, &motion.state),
            _ => motion.state,
        }
    }

    /// What all sensors without noise read.
    pub(crate) fn reading(&self, motion: &ArmMotion) -> Reading {
        Reading { state: self.encoders(motion), tau_J: motion.tau_J, tau_J_d: motion.tau_J_d }
    }
}
