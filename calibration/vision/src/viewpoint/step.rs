//! How far two poses of a camera are apart.

use nalgebra::Isometry3;

/// Distance and angle between two camera poses [m, rad], of the cameras in the base frame.
pub fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let (a, b) = (a.inverse(), b.inverse());
    ((a.translation.vector - b.translation.vector).norm(), a.rotation.angle_to(&b.rotation))
}
