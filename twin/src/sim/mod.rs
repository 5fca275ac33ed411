//! The simulated cell: arm, tool, table and object, moved on by one control period at a time. The bridge's simulated
//! robot, `twin shadow` and `twin replay` are all this one; called from their threads, never from a control thread
//! (a contact takes too long for one).
//!
//! The arm meets nothing but the object, and that with its tool alone: it passes through the table and through itself.
//! Units SI, everything in the base frame. Deterministic: the same cell, parameters and drives give the same numbers.
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

mod arm;
mod contact;
#[cfg(test)]
mod tests;

pub use arm::Drive;

use crate::arm::{ArmModel, GainError, JointState, Joints, ModelError};
use crate::effects::{CameraEffects, EffectError, Effects};
use crate::physics::{FlatMesh, TableObject};
use crate::scene::{MeshFileError, ObjectModel, SceneSnapshot};
use arm::SimArm;
use contact::ToolContact;
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::arm::ArmState;
use shared_mem::theta::Theta;

/// One control period [ns].
pub const PERIOD_NS: u64 = 1_000_000;
/// One control period [s].
pub const PERIOD: f64 = 1e-3;

/// The simulated cell.
pub struct SimCell {
    arm: Option<SimArm>,
    object: Option<TableObject>,
    contact: ToolContact,
    camera: CameraEffects,
    time_ns: u64,
}

/// No cell can be simulated from what was given.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// The arm.
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// Its controller.
    #[error(transparent)]
    Gains(#[from] GainError),
    /// The object's mesh file.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// The object's mesh encloses nothing.
    #[error(transparent)]
    FlatMesh(#[from] FlatMesh),
    /// An object, and nothing to put it on.
    #[error("cell.toml has an [object] but no [table]; add `[table]` with `height = ` in metres over the base frame")]
    NoTable,
    /// The start pose does not fit the arm.
    #[error("`simulation.q` holds {given} numbers; this arm has {dof} joints: give one for each, or leave it out")]
    StartPose {
        /// Numbers given.
        given: usize,
        /// Joints of the arm.
        dof: usize,
    },
    /// An effect is not known or its parameters do not fit.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

impl SimCell {
    /// The cell as cell.toml describes it, arm and object at rest where `[simulation]` puts them; what `theta` knows
    /// replaces cell.toml's nominal values.
    ///
    /// # Errors
    /// [`SimError`] naming the key or file and the remedy.
    pub fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Self, SimError> {
        let model = cell.robot.as_ref().map(|_| ArmModel::from_cell(cell)).transpose()?;
        let blocks = theta.map_or(&[][..], |t| &t.effects);
        let effects = Effects::from_theta(blocks, model.as_ref().map_or(0, ArmModel::dof))?;
        let arm = model.map(|model| SimArm::new(cell, model, theta, &effects.arm)).transpose()?;
        let (object, contact) = match ObjectModel::new(cell, theta)? {
            None => (None, ToolContact::without_object()),
            Some(model) => {
                let table = cell.table.ok_or(SimError::NoTable)?.height;
                let mut object = TableObject::new(&model, Some(table), &effects)?;
                let [x, y] = cell.simulation.object_position;
                let place = Vector3::new(x, y, table + model.shape.half_extents().z);
                let start = Isometry3::new(place, Vector3::z() * cell.simulation.object_yaw);
                object.set(&Pose::from_isometry(start), Vector3::zeros(), Vector3::zeros());
                (Some(object), ToolContact::new(cell, &model, &effects.hit))
            }
        };
        Ok(Self { arm, object, contact, camera: effects.camera, time_ns: 0 })
    }

    /// Lets one control period of 1 ms pass. Where the cell has no arm, `drive` moves nothing.
    pub fn step(&mut self, drive: &Drive) {
        let Self { arm, object, contact, .. } = self;
        if let Some(arm) = arm {
            arm.begin_period(drive);
        }
        match (arm, object) {
            (Some(arm), Some(object)) => contact.advance(arm, object),
            (Some(arm), None) => arm.advance(PERIOD, &[]),
            (None, Some(object)) => contact::settle(object),
            (None, None) => {}
        }
        self.time_ns += PERIOD_NS;
    }

    /// Fills what a robot reports about itself: `device_ns` (simulated clock), `dof`, `mode`, `q`, `dq` (with the
    /// encoder noise of `[simulation]`), `q_d`, `dq_d`, `tau_J`, `tau_J_d`, `tau_ext`, `O_T_EE`. Leaves the rest alone.
    pub fn read(&mut self, state: &mut ArmState) {
        state.device_ns = self.time_ns;
        if let Some(arm) = &mut self.arm {
            arm.read(state);
        }
    }

    /// Simulated time since the cell was made [ns].
    #[must_use]
    pub fn time_ns(&self) -> u64 {
        self.time_ns
    }

    /// True joint positions [rad]; zeros without an arm.
    #[must_use]
    pub fn q(&self) -> Joints {
        self.arm.as_ref().map_or([0.0; 8], |arm| arm.state().q)
    }

    /// True joint velocities [rad/s]; zeros without an arm.
    #[must_use]
    pub fn dq(&self) -> Joints {
        self.arm.as_ref().map_or([0.0; 8], |arm| arm.state().dq)
    }

    /// What the arm's encoders would read without noise: not the true positions where an effect parts the two.
    #[must_use]
    pub fn joint_reading(&self) -> JointState {
        self.arm.as_ref().map(SimArm::reading).unwrap_or_default()
    }

    /// Torque behind the gear, with gravity [N m]; zeros without an arm.
    #[must_use]
    pub fn tau_J(&self) -> Joints {
        self.arm.as_ref().map_or([0.0; 8], SimArm::tau_J)
    }

    /// The arm's model, where there is an arm.
    #[must_use]
    pub fn arm_model(&self) -> Option<&ArmModel> {
        self.arm.as_ref().map(SimArm::model)
    }

    /// The object's geometric centre, where there is an object.
    #[must_use]
    pub fn object(&self) -> Option<Pose<Base, Object>> {
        self.object.as_ref().map(TableObject::pose)
    }

    /// The object's velocity at its geometric centre [m/s] and its angular velocity [rad/s].
    #[must_use]
    pub fn object_velocity(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let object = self.object.as_ref()?;
        let centre = object.pose().isometry().translation.vector.into();
        Some((object.velocity_at(&centre), object.angular_velocity()))
    }

    /// Effects on what a tracker reports about the object: for the [`crate::sensors::tracker::SimTracker`] of this cell.
    #[must_use]
    pub fn camera_effects(&self) -> CameraEffects {
        self.camera
    }

    /// Normal force between tool and object, mean over the last period [N].
    #[must_use]
    pub fn contact_force(&self) -> f64 {
        self.contact.mean_force()
    }

    /// When tool and object touched first since the cell was made or the object was last set [ns of simulated time].
    #[must_use]
    pub fn first_contact_ns(&self) -> Option<u64> {
        self.contact.first_period().map(|periods| periods * PERIOD_NS)
    }

    /// Puts the arm somewhere: positions [rad], velocities [rad/s], one a joint; what is missing is 0.
    pub fn set_arm(&mut self, q: &[f64], dq: &[f64]) {
        if let Some(arm) = &mut self.arm {
            arm.set(q, dq);
        }
    }

    /// Puts the object somewhere: pose and velocity [m/s] of its geometric centre, angular velocity [rad/s].
    pub fn set_object(&mut self, pose: &Pose<Base, Object>, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        if let Some(object) = &mut self.object {
            object.set(pose, velocity, angular_velocity);
            self.contact.forget();
        }
    }

    /// The cell as a camera sees it now.
    #[must_use]
    pub fn snapshot(&self) -> SceneSnapshot {
        SceneSnapshot {
            time_ns: self.time_ns,
            dof: self.arm_model().map_or(0, ArmModel::dof),
            q: self.q(),
            object: self.object(),
        }
    }
}
