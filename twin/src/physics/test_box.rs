//! The box of tests: homogeneous, on its four corners.

use super::{Material, TableObject};
use crate::scene::{ObjectModel, ObjectShape};
use crate::sliding::Coulomb;
use nalgebra::Vector3;
use shared_mem::cell::Support;

pub(crate) fn box_model() -> ObjectModel {
    ObjectModel {
        shape: ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) },
        mass: 0.3,
        centre_of_mass: Vector3::zeros(),
        friction: 0.3,
        tip_friction: 0.2,
        restitution: 0.0,
        support: Support::Corners,
    }
}

/// A model at the origin over a table at this height [m], if there is one.
pub(crate) fn nominal(model: &ObjectModel, table_height: Option<f64>) -> TableObject<Coulomb> {
    TableObject::new(model, Material::nominal(model.parameters()), table_height).expect("a body")
}
