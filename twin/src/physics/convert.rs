//! nalgebra (the project's vectors) to and from glam (rapier's). Nothing else converts.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::math::{Pose, Rotation, Vector};

pub(super) fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn point(p: &Point3<f64>) -> Vector {
    vector(&p.coords)
}

pub(super) fn pose(p: &Isometry3<f64>) -> Pose {
    let q = p.rotation.quaternion();
    Pose::from_parts(vector(&p.translation.vector), Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}

pub(super) fn to_vector(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(super) fn to_isometry(p: &Pose) -> Isometry3<f64> {
    let q = Quaternion::new(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z);
    Isometry3::from_parts(
        Translation3::from(to_vector(p.translation)),
        // rapier keeps its rotations normalised; doing it again would cost the bit equality of a set and a get.
        UnitQuaternion::new_unchecked(q),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_survives_the_way_to_rapier_and_back() {
        let there = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.4, 0.5, -0.6));
        let back = to_isometry(&pose(&there));
        assert!((there.inverse() * back).translation.vector.norm() < 1e-15);
        let p = Point3::new(1.0, 2.0, 3.0);
        let through_rapier = to_vector(pose(&there).transform_point(point(&p)));
        assert!((through_rapier - (there * p).coords).norm() < 1e-14);
    }
}
