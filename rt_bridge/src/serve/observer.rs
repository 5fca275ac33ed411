//! What the robot concludes about forces from outside: its torque sensors against what its own model expects.
//!
//! Glossary: `tau_J` is measured behind the gear, so that rotors are no part of the balance; the model is the robot's own,
//! with the end effector and load set by the client. `tau_ext_hat = tau_J - (M ddq + coriolis + gravity)`, so a torque that
//! the arm exerts on its surroundings is positive, as in libfranka's documentation. Whatever the model does not know shows
//! up here: a payload nobody declared as well as a push. Joints in N m, wrenches in N and N m.
#![allow(non_snake_case)] // the field's own symbols

use super::kinematics::{Frame, least_stretch, seven, turned};
use super::wire::Thresholds;
use nalgebra::Vector6;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::time::TICK;
use twin::arm::{ArmModel, JointState, Joints};

/// Time constant of the estimate [s]. The robot's own is not published; this one passes 10 Hz and leaves 0.05 N m of what
/// the encoders' noise makes of an acceleration.
const LAG: f64 = 0.016;
/// Where the Jacobian stretches less than this, a wrench cannot be derived from joint torques and is reported as none.
const NEAR_SINGULAR: f64 = 0.03;

#[derive(Debug, Clone)]
pub(super) struct Observer {
    last: JointState,
    tau_ext: Joints,
}

impl Observer {
    /// One that begins with an arm in the state `now`, untouched.
    pub(super) fn new(now: &JointState) -> Self {
        Self { last: *now, tau_ext: [0.0; MAX_JOINTS] }
    }

    /// Takes in what the sensors say at the end of a period; `tau_J` is the mean over it.
    pub(super) fn update(&mut self, model: &ArmModel, now: &JointState, tau_J: &Joints) {
        let middle = JointState {
            q: std::array::from_fn(|i| 0.5 * (self.last.q[i] + now.q[i])),
            dq: std::array::from_fn(|i| 0.5 * (self.last.dq[i] + now.dq[i])),
        };
        let (mass, bias, rotor) = (model.mass_matrix(&middle.q), model.bias(&middle), model.rotor_inertia());
        let ddq: Joints = std::array::from_fn(|i| (now.dq[i] - self.last.dq[i]) / TICK);
        for i in 0..model.dof() {
            let with_rotor: f64 = mass[i].iter().zip(&ddq).map(|(m, ddq)| m * ddq).sum();
            let expected = with_rotor - rotor[i] * ddq[i] + bias[i];
            self.tau_ext[i] += (tau_J[i] - expected - self.tau_ext[i]) * TICK / (TICK + LAG);
        }
        self.last = *now;
    }

    /// `tau_ext_hat_filtered` [N m].
    pub(super) fn tau_ext(&self) -> &Joints {
        &self.tau_ext
    }

    /// The wrench at `stiffness_frame` that explains the joint torques best: in base axes, then in its own [N, N m].
    /// Zeros near a singular pose.
    pub(super) fn wrench(&self, stiffness_frame: &Frame, q: &Joints) -> [Vector6<f64>; 2] {
        let jacobian = stiffness_frame.jacobian(q);
        if least_stretch(&jacobian) < NEAR_SINGULAR {
            return [Vector6::zeros(); 2];
        }
        let square = jacobian * jacobian.transpose();
        let in_base = square.cholesky().map_or_else(Vector6::zeros, |c| c.solve(&(jacobian * seven(&self.tau_ext))));
        [in_base, turned(&stiffness_frame.pose(q).rotation.inverse(), &in_base)]
    }
}

/// Where something touches the arm, by joint and by direction of the stiffness frame. Contact goes when the touch does;
/// a collision stays until error recovery.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Touched {
    pub(super) joint_contact: [bool; 7],
    pub(super) cartesian_contact: [bool; 6],
    pub(super) joint_collision: [bool; 7],
    pub(super) cartesian_collision: [bool; 6],
}

impl Touched {
    /// Takes in the newest estimate; `true` where it is a collision. While nothing moves on command, none is looked for.
    pub(super) fn update(
        &mut self,
        tau_ext: &Joints,
        wrench: &Vector6<f64>,
        at: &Thresholds,
        commanded: bool,
    ) -> [bool; 2] {
        for (i, torque) in tau_ext.iter().take(7).map(|torque| torque.abs()).enumerate() {
            self.joint_contact[i] = torque > at.contact_torque[i];
            self.joint_collision[i] |= commanded && torque > at.collision_torque[i];
        }
        for (i, force) in wrench.iter().map(|force| force.abs()).enumerate() {
            self.cartesian_contact[i] = force > at.contact_force[i];
            self.cartesian_collision[i] |= commanded && force > at.collision_force[i];
        }
        [self.joint_collision.contains(&true), self.cartesian_collision.contains(&true)]
    }

    pub(super) fn forget_collisions(&mut self) {
        (self.joint_collision, self.cartesian_collision) = ([false; 7], [false; 6]);
    }
}
