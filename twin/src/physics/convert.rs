//! nalgebra (the project's vectors) to and from glam (parry's). Nothing else converts.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;

pub(super) fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn point(p: &Point3<f64>) -> Vector {
    vector(&p.coords)
}

pub(super) fn to_vector(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}
