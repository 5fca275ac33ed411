//! A task carried out in a cell: its arm moves as the cell's does under its controller, its object has the physics that was
//! identified, and its pictures are as late. Without one the arm is where it is commanded to be, and bodies are as the task file has them.
//!
//! The arm feels nothing of what it touches: what is in its way stands against the bodies it carries, which go where the
//! joints have them.

use super::Task;
use super::read::held;
use crate::arm::{JointState, Joints};
use crate::control::Drive;
use crate::effects::{Stage, find};
use crate::sim::{SimCell, SimError};
use crate::world::{BodyPlan, Hold, PlanError, World};
use nalgebra::Vector3;
use shared_mem::cell::Cell;
use shared_mem::theta::{ObjectTheta, Theta};

/// Effects at the camera of which pictures know.
const LATENCY: &str = "camera_latency";

/// What a task takes over from a cell.
#[derive(Clone)]
pub(super) struct TaskCell {
    /// Its arm, before it is put anywhere; `None` for a task without one.
    arm: Option<SimCell>,
    /// How late a picture shows what is [s].
    pub(super) latency: f64,
}

impl std::fmt::Debug for TaskCell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TaskCell").field("latency", &self.latency).finish_non_exhaustive()
    }
}

/// A task cannot be carried out in a cell.
#[derive(Debug, thiserror::Error)]
pub enum InCellError {
    /// The cell cannot be simulated.
    #[error(transparent)]
    Cell(#[from] SimError),
    /// It has another arm than the task.
    #[error(
        "the task is one of an arm with {wanted} joints, cell.toml describes {described}; give the cell.toml of that arm"
    )]
    OtherArm {
        /// Joints of the task's arm.
        wanted: usize,
        /// Joints of the cell's.
        described: usize,
    },
    /// What was identified can be no body.
    #[error("[object] of theta.toml: `{body}`: {what}")]
    Object {
        /// The body of the task that it is about.
        body: String,
        /// What is wrong with it.
        what: String,
    },
}

impl Task {
    /// The same task in a cell: `theta`, what was identified of it, replaces cell.toml's nominal values; its `[object]` is
    /// the task's first free body. Also the effects of `theta` of which a task's scene knows nothing.
    ///
    /// # Errors
    /// [`InCellError`] with the remedy.
    pub fn in_cell(&self, cell: &Cell, theta: Option<&Theta>) -> Result<(Self, Vec<&'static str>), InCellError> {
        let mut task = self.clone();
        let effects = theta.map_or(&[][..], |theta| &theta.effects);
        let known = effects.iter().filter_map(|effect| find(&effect.name));
        let left_out = known.filter(|effect| effect.stage != Stage::Control && effect.name != LATENCY);
        let left_out = left_out.map(|effect| effect.name).collect();
        // The task has bodies of its own.
        let cell = Cell { objects: Vec::new(), ..cell.clone() };
        let sim = SimCell::new(&cell, theta)?;
        let latency = cell.camera.as_ref().map_or(0.0, |camera| camera.latency);
        let latency = latency + sim.camera_effects().latency_ns() as f64 * 1e-9;
        let arm = match &self.carrier {
            Some(carrier) => {
                let (wanted, described) = (carrier.joint_names().len(), sim.arm_model().map_or(0, |arm| arm.dof()));
                if wanted != described {
                    return Err(InCellError::OtherArm { wanted, described });
                }
                Some(sim)
            }
            None => None,
        };
        task.cell = Some(TaskCell { arm, latency });
        if let Some(object) = theta.and_then(|theta| theta.object.as_ref()) {
            task.take_object(object)?;
        }
        Ok((task, left_out))
    }

    /// Gives the first free body what was identified of it.
    fn take_object(&mut self, object: &ObjectTheta) -> Result<(), InCellError> {
        let Some(body) = self.bodies.iter().position(|body| matches!(body.hold, Hold::Free(_))) else { return Ok(()) };
        let plan = &mut self.bodies[body];
        if let Some(mass) = object.mass {
            plan.inertia *= mass / plan.mass;
            plan.mass = mass;
        }
        if let Some(centre) = object.centre_of_mass {
            plan.centre_of_mass = Vector3::from(centre);
        }
        let name = plan.name.clone();
        self.world = World::new(&held(&self.bodies, self.carrier.as_ref()))
            .map_err(|PlanError { what, .. }| InCellError::Object { body: name, what })?;
        let of_tool = |plan: &BodyPlan| matches!(plan.hold, Hold::Moved(_) | Hold::Arm(_) | Hold::Joint(_));
        for (other, plan) in self.bodies.iter().enumerate() {
            let friction = match plan.hold {
                Hold::Fixed(_) => object.friction,
                _ if of_tool(plan) => object.tip_friction,
                _ => None,
            };
            if let Some(friction) = friction {
                self.world.set_friction([body, other], friction);
            }
        }
        Ok(())
    }
}

/// The arm between its command and where it is.
pub(super) struct Servo {
    arm: SimCell,
}

impl Servo {
    /// At rest at joints that it has been commanded to for long; `None` where the arm is where it is commanded to be.
    pub(super) fn begin(task: &Task, q: &Joints) -> Option<Self> {
        let mut arm = task.cell.as_ref()?.arm.clone()?;
        let dof = arm.arm_model().map_or(0, |model| model.dof());
        arm.set_arm(&q[..dof], &[]);
        Some(Self { arm })
    }

    /// Lets a step pass under desired positions [rad] and velocities [rad/s]; where the joints are then.
    pub(super) fn step(&mut self, q_d: &Joints, dq_d: &Joints) -> Joints {
        self.arm.step(&Drive::JointImpedance { q_d: *q_d, dq_d: *dq_d });
        self.arm.q()
    }

    /// What the encoders read.
    pub(super) fn reading(&self) -> JointState {
        self.arm.joint_reading()
    }
}

impl std::fmt::Debug for Servo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Servo").finish_non_exhaustive()
    }
}
