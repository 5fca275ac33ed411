//! One recorded clip with an object, prepared for being held against the twin: what the tracker said wrongly taken out,
//! when the object last moved. Base frame, SI, stamps of the recording.

use nalgebra::Vector3;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::{Clip, ObjectSeries};
use twin::effects::CameraEffects;

/// Poses this far from the last one still move, in sigmas of the noise: 1 of 100 000 resting poses is.
const MOVING_SIGMAS: f64 = 8.0;

/// A clip with an object.
#[derive(Debug, Clone)]
pub(super) struct ObjectClip {
    pub(super) recorded: Clip,
    /// When the last pose was taken that is not where the object came to rest.
    pub(super) rest_ns: u64,
    /// Stamp of the last pose.
    pub(super) end_ns: u64,
}

impl ObjectClip {
    /// `None` when no pose was recorded. `noise`: one sigma of a coordinate [m].
    pub(super) fn new(recorded: Clip, noise: f64) -> Option<Self> {
        let ObjectSeries { stamps_ns, poses } = &recorded.object;
        let (end_ns, last) = (*stamps_ns.last()?, place(poses.last()?));
        let away = |pose: &Pose<Base, Object>| (place(pose) - last).norm() > MOVING_SIGMAS * noise;
        let rest_ns = poses.iter().rposition(away).map_or(stamps_ns[0], |row| stamps_ns[row]);
        Some(Self { recorded, rest_ns, end_ns })
    }

    /// The poses as they were, under effects that report them elsewhere.
    pub(super) fn undistorted(&self, camera: &CameraEffects) -> ObjectSeries {
        let mut series = self.recorded.object.clone();
        if !camera.is_none() {
            for pose in &mut series.poses {
                *pose = Pose::from_isometry(camera.undistorted(&pose.isometry()));
            }
        }
        series
    }
}

pub(super) fn place(pose: &Pose<Base, Object>) -> Vector3<f64> {
    Vector3::from(pose.position())
}
