//! Where the camera of benchmarks and tests stands.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// The camera in front of the robot: from the base's frame to its own.
pub(crate) fn camera_from_base(eye: [f64; 3], at: [f64; 3]) -> Isometry3<f64> {
    let flip = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
    flip * Isometry3::look_at_rh(&Point3::from(eye), &Point3::from(at), &-Vector3::z())
}
