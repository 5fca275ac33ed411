//! The simulated cell: arm, tool, table and object, moved on by one control period at a time. The bridge's simulated
//! robot, `twin shadow` and `twin replay` are all this one; called from their threads, never from a control thread
//! (a contact takes too long for one).
//!
//! [`SimCell`] has one object, [`SimScene`] all of them. The arm meets objects, with its tool alone, and the table where that
//! is asked for ([`SimCell::make_table_solid`]). It passes through itself.
//! Units SI, everything in the base frame. Deterministic: the same cell, parameters and drives give the same numbers.
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

mod arm;
mod contact;
mod error;
mod generator;
mod joint_noise;
mod several;
mod state;
mod table;
#[cfg(test)]
mod tests;
mod tool_path;

pub use error::SimError;
pub(crate) use generator::generator;
pub use several::{SceneState, SimScene};
pub use state::SimState;

use crate::arm::{ArmModel, GainError, JointState, Joints, MassProperties};
use crate::control::{CommandTrack, Drive, Plant, Reading};
use crate::effects::{CameraEffects, Effects, TableFriction};
use crate::physics::{ObjectMotion, TableObject};
use crate::scene::{NamedPoses, ObjectModel, ObjectParameters, SceneSnapshot, nominal_centre_of_mass};
use arm::SimArm;
use contact::{ContactRecord, ToolContact};
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Cell, Controller, Tool};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::arm::ArmState;
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
use table::SolidTable;

/// An object on a table with whatever friction effects give it.
type SimObject = TableObject<TableFriction>;
type SimObjectMotion = ObjectMotion<TableFriction>;

/// The simulated cell.
#[derive(Clone)]
pub struct SimCell {
    description: Description,
    arm: Option<SimArm>,
    object: Option<SimObject>,
    contact: ToolContact,
    table: Option<SolidTable>,
    camera: CameraEffects,
    takes_part: TakesPart,
    time_ns: u64,
}

/// Who is there at all: an arm or object that is taken out neither moves nor touches anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TakesPart {
    arm: bool,
    object: bool,
}

/// What is left to know about a cell when other parameters come.
#[derive(Clone)]
struct Description {
    controller: Option<Controller>,
    tool: Option<Tool>,
    object: Option<shared_mem::cell::Object>,
    /// Nominal one of the object [m].
    centre_of_mass: Vector3<f64>,
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
        let effects = Effects::of(cell.controller.as_ref(), blocks, model.as_ref().map_or(0, ArmModel::dof))?;
        let arm = model.map(|model| SimArm::new(cell, model, theta, &effects.arm)).transpose()?;
        let mut centre_of_mass = Vector3::zeros();
        let (object, contact) = match ObjectModel::new(cell, theta)? {
            None => (None, ToolContact::without_object()),
            Some(model) => {
                model.check()?;
                centre_of_mass =
                    cell.object().map_or(centre_of_mass, |object| nominal_centre_of_mass(object, &model.shape));
                let table = cell.table.ok_or(SimError::NoTable)?.height;
                let mut object = SimObject::new(&model, effects.material(model.parameters()), Some(table))?;
                let ([x, y], yaw) = cell.object_start();
                let place = Vector3::new(x, y, table + model.shape.half_extents().z);
                let start = Isometry3::new(place, Vector3::z() * yaw);
                object.set(&Pose::from_isometry(start), Vector3::zeros(), Vector3::zeros());
                (Some(object), ToolContact::new(cell.tool.as_ref(), &model.parameters(), &effects.hit))
            }
        };
        let (object_described, Cell { controller, tool, .. }) = (cell.object().cloned(), cell.clone());
        let description = Description { controller, tool, object: object_described, centre_of_mass };
        Ok(Self {
            description,
            arm,
            object,
            contact,
            table: None,
            camera: effects.camera,
            takes_part: TakesPart { arm: true, object: true },
            time_ns: 0,
        })
    }

    /// Gives the same cell other gains, object parameters and effects: what `theta` does not know returns to cell.toml's
    /// nominal values. Meshes and hulls stay. Put the arm somewhere afterwards, or resume a state: an arm with other
    /// effects has nothing to remember yet.
    ///
    /// # Errors
    /// [`SimError`] naming the key and the remedy.
    pub fn set_parameters(&mut self, theta: &Theta) -> Result<(), SimError> {
        let dof = self.arm.as_ref().map_or(0, |arm| arm.model().dof());
        let effects = Effects::of(self.description.controller.as_ref(), &theta.effects, dof)?;
        let Description { controller, tool, object: described, .. } = &self.description;
        let nominal = self.description.centre_of_mass;
        let parameters = described.as_ref().map(|object| ObjectParameters::new(object, nominal, Some(theta)));
        parameters.map_or(Ok(()), |parameters| parameters.check())?;
        if let Some(arm) = &mut self.arm {
            arm.set_parameters(controller.as_ref(), theta, &effects.arm)?;
        }
        if let (Some(object), Some(parameters)) = (&mut self.object, parameters) {
            object.set_material(effects.material(parameters));
            self.contact.set_parameters(tool.as_ref(), &parameters, &effects.hit);
        }
        self.camera = effects.camera;
        Ok(())
    }

    /// Lets one control period of 1 ms pass. Where the cell has no arm, `drive` moves nothing.
    pub fn step(&mut self, drive: &Drive) {
        self.lean_on_table();
        let Self { arm, object, contact, takes_part, .. } = self;
        let (arm, object) = (arm.as_mut().filter(|_| takes_part.arm), object.as_mut().filter(|_| takes_part.object));
        match (arm, object) {
            (Some(arm), Some(object)) => contact.advance(arm, object, drive, self.time_ns),
            (Some(arm), None) => arm.period(drive),
            (None, Some(object)) => contact.pass(object),
            (None, None) => {}
        }
        self.time_ns += TICK_NS;
    }

    /// Has the table push the arm in the coming period, where it is solid; with these torques [N m].
    fn lean_on_table(&mut self) -> Joints {
        let (Some(arm), Some(table)) = (self.arm.as_mut(), &self.table) else { return Joints::default() };
        let push = table.push(arm.model(), arm.state());
        arm.push(push);
        push
    }

    /// Lets the arm collide with the table, where the cell has an arm of known shape and a table. Off by default: a
    /// recorded arm never did, and looking for it costs time.
    pub fn make_table_solid(&mut self, cell: &Cell) {
        self.table = cell.table.as_ref().map(|table| SolidTable::new(table, cell.tool.as_ref()));
    }

    /// Integrates every period from now on in `parts` as many steps as it would take, of the arm, of the contact and of the
    /// object: the same cell by another rule, as another engine would have it. 1 is how the twin itself does it.
    pub fn refine(&mut self, parts: u32) {
        if let Some(arm) = &mut self.arm {
            arm.refine(parts);
        }
        self.contact.refine(parts);
    }

    /// Tells the arm's controller that the flange carries `load` (flange frame) beside the tool, so that it compensates
    /// it. What the flange really carries stays.
    pub fn declare_load(&mut self, load: &MassProperties) {
        if let Some(arm) = &mut self.arm {
            arm.plant_mut().declare_load(load);
        }
    }

    /// Asks the arm's own controller for another stiffness than cell.toml's [N m/rad]. Gains that differ from cell.toml's
    /// differ from what is asked in the same proportion; the damping ratio stays.
    ///
    /// # Errors
    /// [`GainError`] when cell.toml describes no controller.
    pub fn ask_stiffness(&mut self, stiffness: &Joints) -> Result<(), GainError> {
        let Self { arm, description, .. } = self;
        arm.as_mut().map_or(Ok(()), |arm| arm.plant_mut().ask_stiffness(stiffness, description.controller.as_ref()))
    }

    /// Fills what a robot reports about itself: `device_ns` (simulated clock), `dof`, `mode`, `q`, `dq` (with the
    /// encoder noise of `[simulation]`), `q_d`, `dq_d`, `tau_J`, `tau_J_d`, `tau_ext`, `O_T_EE`. Leaves the rest alone.
    pub fn read(&mut self, state: &mut ArmState) {
        state.device_ns = self.time_ns;
        if let Some(arm) = &mut self.arm {
            arm.read(state);
        }
    }

    /// Simulated time [ns], from 0 when the cell was made.
    pub fn time_ns(&self) -> u64 {
        self.time_ns
    }

    /// True joint positions [rad]; zeros without an arm.
    pub fn q(&self) -> Joints {
        self.arm.as_ref().map_or([0.0; 8], |arm| arm.state().q)
    }

    /// True joint velocities [rad/s]; zeros without an arm.
    pub fn dq(&self) -> Joints {
        self.arm.as_ref().map_or([0.0; 8], |arm| arm.state().dq)
    }

    /// What the arm's encoders would read without noise: not the true positions where an effect parts the two.
    pub fn joint_reading(&self) -> JointState {
        self.reading().state
    }

    /// What all of the arm's sensors would read without noise; zeros without an arm.
    pub fn reading(&self) -> Reading {
        self.arm.as_ref().map(SimArm::reading).unwrap_or_default()
    }

    /// Torque behind the gear, gravity included, mean over the last period [N m]; zeros without an arm.
    pub fn tau_J(&self) -> Joints {
        self.reading().tau_J
    }

    /// The command in force: what an arm goes on with without a new one. No torque without an arm.
    pub fn command(&self) -> Drive {
        self.arm.as_ref().map_or(Drive::Torque { tau_J_d: [0.0; 8] }, SimArm::command)
    }

    /// The arm with its controller and effects, where there is an arm.
    pub fn plant(&self) -> Option<&Plant> {
        self.arm.as_ref().map(SimArm::plant)
    }

    /// The arm's model, where there is an arm.
    pub fn arm_model(&self) -> Option<&ArmModel> {
        self.arm.as_ref().map(SimArm::model)
    }

    /// The object's geometric centre, where there is an object.
    pub fn object(&self) -> Option<Pose<Base, Object>> {
        self.object.as_ref().filter(|_| self.takes_part.object).map(SimObject::pose)
    }

    /// The object's velocity at its geometric centre [m/s] and its angular velocity [rad/s].
    pub fn object_velocity(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let object = self.object.as_ref().filter(|_| self.takes_part.object)?;
        Some((object.centre_velocity(), object.angular_velocity()))
    }

    /// Effects on what a tracker reports about the object: for the [`crate::sensors::tracker::SimTracker`] of this cell.
    pub fn camera_effects(&self) -> CameraEffects {
        self.camera
    }

    /// Whether tool and object may touch within the next period.
    pub fn may_touch(&self) -> bool {
        match (&self.arm, &self.object) {
            (Some(arm), Some(object)) if self.takes_part.arm && self.takes_part.object => {
                self.contact.may_touch(arm, object)
            }
            _ => false,
        }
    }

    /// Whether the object stands still and does so until something touches it. True where there is none.
    pub fn object_rests(&self) -> bool {
        self.object.as_ref().filter(|_| self.takes_part.object).is_none_or(SimObject::rests)
    }

    /// Gap between tool and object if the arm were at `q` [m]; without bound where one of them takes no part.
    pub fn gap_at(&self, q: &Joints) -> f64 {
        match (&self.arm, &self.object) {
            (Some(arm), Some(object)) if self.takes_part.arm && self.takes_part.object => {
                self.contact.gap_at(arm, q, object)
            }
            _ => f64::INFINITY,
        }
    }

    /// Normal force between tool and object, mean over the last period [N].
    pub fn contact_force(&self) -> f64 {
        self.contact.record.mean_force
    }

    /// Force of the object on the tool [N] and its moment about the base's origin [N m], base frame, mean over the last
    /// period.
    pub fn contact_wrench(&self) -> [Vector3<f64>; 2] {
        self.contact.record.on_tool
    }

    /// When tool and object touched first since the cell was made or the object was last set [ns of simulated time].
    pub fn first_contact_ns(&self) -> Option<u64> {
        self.contact.record.span.map(|(first, _)| first)
    }

    /// When the last touch of tool and object ended, or the end of the last period if they touch still [ns of simulated time].
    pub fn last_contact_ns(&self) -> Option<u64> {
        self.contact.record.span.map(|(_, last)| last)
    }

    /// Puts the arm somewhere: positions [rad], velocities [rad/s], one a joint; what is missing is 0.
    pub fn set_arm(&mut self, q: &[f64], dq: &[f64]) {
        if let Some(arm) = &mut self.arm {
            arm.set(q, dq);
        }
        self.contact.look_again();
        self.takes_part.arm = true;
    }

    /// Takes the arm out until it is set or started again.
    pub fn remove_arm(&mut self) {
        self.takes_part.arm = false;
    }

    /// Takes the object out until it is set again.
    pub fn remove_object(&mut self) {
        self.contact.record = ContactRecord::default();
        self.takes_part.object = false;
    }

    /// Sets the simulated clock [ns].
    pub fn set_time_ns(&mut self, time_ns: u64) {
        self.time_ns = time_ns;
    }

    /// Puts the arm where its encoders read `reading` at the stamp `at_ns` of a command series; commands of the time
    /// before that are still on their way count.
    pub fn start_arm(&mut self, reading: &JointState, at_ns: u64, commands: &CommandTrack) {
        if let Some(arm) = &mut self.arm {
            arm.start(reading, at_ns, commands);
        }
        self.contact.look_again();
        self.takes_part.arm = true;
    }

    /// Puts the object somewhere: pose and velocity [m/s] of its geometric centre, angular velocity [rad/s].
    pub fn set_object(&mut self, pose: &Pose<Base, Object>, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        self.contact.record = ContactRecord::default();
        self.takes_part.object = true;
        self.move_object(pose, velocity, angular_velocity);
    }

    /// The same for an object that has been touched: when that was stays on record.
    pub fn move_object(&mut self, pose: &Pose<Base, Object>, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        if let Some(object) = &mut self.object {
            object.set(pose, velocity, angular_velocity);
        }
        self.contact.look_again();
    }

    /// The cell as a camera sees it now.
    pub fn snapshot(&self) -> SceneSnapshot {
        SceneSnapshot {
            time_ns: self.time_ns,
            dof: self.arm_model().map_or(0, ArmModel::dof),
            q: self.q(),
            object: self.object(),
            named: NamedPoses::default(),
        }
    }
}
