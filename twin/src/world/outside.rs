//! What is put into a world from outside and read back in every step: for a simulation that has an arm or single objects of its
//! own, and asks the world for what happens where they meet. World frame, SI.

use super::plan::JointKind;
use super::touch::Search;
use super::tree::Link;
use super::{STEP, World};
use crate::arm::JointState;
use nalgebra::{Isometry3, Vector3};
use std::ops::Range;

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyMotion {
    /// Pose of its origin.
    pub pose: Isometry3<f64>,
    /// Velocity of its origin [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub spin: Vector3<f64>,
}

/// What contacts did to a body within the last step, mean over it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Force [N].
    pub force: Vector3<f64>,
    /// Moment about the world's origin [N m].
    pub moment: Vector3<f64>,
    /// Sum of what presses on it, whatever the directions [N].
    pub pressing: f64,
}

impl World {
    /// Puts a body that is free into this motion. [`World::refresh`] when all are put.
    pub fn set_motion(&mut self, body: usize, motion: &BodyMotion) {
        let lever = motion.pose.rotation * self.trees.nodes[body].centre.coords;
        self.trees.set_pose(body, motion.pose);
        self.trees.set_twist(body, &(motion.velocity + motion.spin.cross(&lever)), &motion.spin);
    }

    /// Puts the arm that carries a body into this state, which its controller is to keep; nothing happens to a body that no arm
    /// carries. [`World::refresh`] when all are put.
    pub fn set_arm(&mut self, body: usize, state: &JointState) {
        let Some(arm) = self.trees.arm_mut(body) else { return };
        arm.aim(state.q, state.dq);
        let (first, dof) = (arm.first, arm.dof());
        self.trees.positions[first..first + dof].copy_from_slice(&state.q[..dof]);
        self.trees.velocities[first..first + dof].copy_from_slice(&state.dq[..dof]);
    }

    /// Puts a body somewhere, at rest; one on a joint where the joint comes nearest to that, within its limits. One that is held fast
    /// stays.
    pub fn put_link(&mut self, body: usize, pose: &Isometry3<f64>) {
        let position = match &self.trees.nodes[body].link {
            Link::Joint { kind, axis, at, parent, ratio, freedom } => {
                let carrier = parent.map_or_else(Isometry3::identity, |parent| *self.trees.pose(parent));
                let moved = (carrier * at).inv_mul(pose);
                let along = match kind {
                    JointKind::Revolute => moved.rotation.scaled_axis().dot(&axis.into_inner()),
                    JointKind::Prismatic => moved.translation.vector.dot(&axis.into_inner()),
                };
                Some((*freedom, along / ratio))
            }
            Link::Free { .. } => None,
            Link::Held | Link::Arm(_) => return,
        };
        match position {
            Some((freedom, position)) => {
                let limits = self.rails.iter().find(|rail| rail.body == body).map(|rail| rail.limits);
                let [low, high] = limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                self.trees.positions[freedom] = position.clamp(low, high);
                self.trees.velocities[freedom] = 0.0;
                self.refresh();
            }
            None => self.put(body, *pose),
        }
    }

    /// Takes up where bodies were put.
    pub fn refresh(&mut self) {
        self.trees.place();
        self.locate();
    }

    /// How a body moves.
    pub fn motion(&self, body: usize) -> BodyMotion {
        let (pose, [of_centre, spin]) = (*self.trees.pose(body), self.trees.twist(body));
        let lever = pose.rotation * self.trees.nodes[body].centre.coords;
        BodyMotion { pose, velocity: of_centre - spin.cross(&lever), spin }
    }

    /// Whether any two of these bodies that may touch are nearer to each other than `within` [m].
    pub fn any_near(&self, bodies: &Range<usize>, within: f64) -> bool {
        self.pairs.iter().any(|pair| {
            pair.pieces.iter().all(|piece| bodies.contains(&self.pieces[*piece].body))
                && self.touching(pair.pieces, within, &mut Search::NONE.clone()).is_some()
        })
    }

    /// Lets two bodies pass through each other.
    pub fn let_pass(&mut self, bodies: [usize; 2]) {
        let pieces = &self.pieces;
        self.pairs.retain(|pair| {
            let between = pair.pieces.map(|piece| pieces[piece].body);
            between != bodies && between != [bodies[1], bodies[0]]
        });
    }

    /// What touched a body within the last step did to it.
    pub fn load_on(&self, body: usize) -> Load {
        let mut load = Load::default();
        for (pair, patch) in &self.patches {
            let [first, second] = self.pairs[*pair].pieces.map(|piece| self.pieces[piece].body);
            let sign = match body {
                _ if body == second => 1.0 / STEP,
                _ if body == first => -1.0 / STEP,
                _ => continue,
            };
            let sum = patch.impulse();
            let world = |x, y, z| patch.axes.tr_mul(&Vector3::new(x, y, z));
            let (force, moment) = (world(sum[0], sum[1], sum[3]), world(sum[4], sum[5], sum[2]));
            load.force += force * sign;
            load.moment += (moment + patch.origin.coords.cross(&force)) * sign;
            load.pressing += self.pairs[*pair].memory.load() / STEP;
        }
        load
    }
}
