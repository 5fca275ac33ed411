//! Six numbers that move a camera: about a point and not about the camera itself, because turning a camera and shifting
//! it look nearly the same to a robot far away.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

/// The camera's pose after a move: the scene turns about `pivot` (camera frame [m]) by the first three numbers
/// [rad] and shifts by the last three [m], both along the camera's axes.
pub fn moved(camera_from_base: &Isometry3<f64>, pivot: &Point3<f64>, by: &Vector6<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], by[2]));
    let about = Translation3::from(pivot.coords) * turn * Translation3::from(-pivot.coords);
    Translation3::new(by[3], by[4], by[5]) * about * camera_from_base
}

/// Distance and angle between two camera poses [m, rad], of the cameras in the base frame.
pub fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let (a, b) = (a.inverse(), b.inverse());
    ((a.translation.vector - b.translation.vector).norm(), a.rotation.angle_to(&b.rotation))
}
