//! Why no cell can be simulated.

use crate::arm::{GainError, ModelError};
use crate::effects::EffectError;
use crate::physics::FlatMesh;
use crate::scene::{MeshFileError, ParameterError};
use crate::world::PlanError;

/// No cell can be simulated from what was given.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    #[error(transparent)]
    Arm(#[from] ModelError),
    #[error(transparent)]
    Gains(#[from] GainError),
    /// The object's mesh file.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// The object's mesh encloses nothing.
    #[error(transparent)]
    FlatMesh(#[from] FlatMesh),
    /// A number of the object that no body can have.
    #[error(transparent)]
    Object(#[from] ParameterError),
    /// An object, and nothing to put it on.
    #[error("cell.toml has an [object] but no [table]; add `[table]` with `height = ` in metres over the base frame")]
    NoTable,
    /// The start pose does not fit the arm.
    #[error("`simulation.q` holds {given} numbers; this arm has {dof} joints: give one for each, or leave it out")]
    StartPose {
        given: usize,
        /// Joints of the arm.
        dof: usize,
    },
    /// One of several objects.
    #[error("object `{name}`: {source}")]
    Of {
        name: String,
        /// What is wrong with it.
        source: Box<Self>,
    },
    /// An object that cannot be one of many bodies.
    #[error("object `{name}`: {what}")]
    Body {
        name: String,
        /// What is wrong with it.
        what: String,
    },
    /// Two objects in one place.
    #[error(
        "objects `{first}` and `{second}` overlap where they start; give one of their [[object]] blocks another `start = [x, y]`"
    )]
    Overlap {
        /// One of them.
        first: String,
        second: String,
    },
    /// The world of many bodies.
    #[error(transparent)]
    Bodies(#[from] PlanError),
    /// An effect is not known or its parameters do not fit.
    #[error("{0} (an `[[effect]]` of theta.toml, or of the file given with --effects)")]
    Effect(#[from] EffectError),
}

impl SimError {
    /// The same of one of several objects.
    pub(super) fn of(self, object: Option<&str>) -> Self {
        match object {
            Some(name) => Self::Of { name: name.to_owned(), source: Box::new(self) },
            None => self,
        }
    }
}
