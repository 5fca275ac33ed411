//! Which way is up, and whether the views stand around the scene.

use super::SceneError;
use crate::scan::Frame;
use fusion::Surface;
use nalgebra::Vector3;

/// A scan whose views stand closer together than this, seen from the middle of the scene, shows one side [degrees].
const ONE_SIDE: f64 = 15.0;
/// A table is tilted by less in a robot's base frame, and in one whose up is guessed from how cameras are held [rad].
const OF_ROBOT: f64 = 0.17;
const GUESSED: f64 = 0.7;

/// Up in the scan's frame, and by how much it may be wrong [rad]: z of a robot's base; else the mean of the cameras' own up, because
/// people hold them upright.
pub(super) fn up(frames: &[Frame], of_robot: bool) -> (Vector3<f64>, f64) {
    if of_robot {
        return (Vector3::z(), OF_ROBOT);
    }
    let sum: Vector3<f64> = frames.iter().map(|frame| frame.scan_from_camera.rotation * -Vector3::y()).sum();
    (sum.try_normalize(1e-9).unwrap_or_else(Vector3::z), GUESSED)
}

/// Refuses views that all stand on one side.
pub(super) fn from_around(surface: &Surface, frames: &[Frame]) -> Result<(), SceneError> {
    let sum: Vector3<f64> = surface.points.iter().map(|point| point.coords.cast::<f64>()).sum();
    let middle = sum / surface.points.len().max(1) as f64;
    let ways: Vec<Vector3<f64>> =
        frames.iter().map(|frame| frame.scan_from_camera.translation.vector - middle).collect();
    let widest = ways.iter().flat_map(|a| ways.iter().map(|b| a.angle(b))).fold(0.0, f64::max).to_degrees();
    if widest < ONE_SIDE { Err(SceneError::OneSide { degrees: widest }) } else { Ok(()) }
}
