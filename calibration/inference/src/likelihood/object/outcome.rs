//! What came of a simulated clip: where the object went, what the encoders read. Base frame, stamps of the recording.

use nalgebra::Isometry3;
use shared_mem::time::TICK_NS;
use twin::arm::Joints;
use twin::effects::CameraEffects;

/// What the twin did in a clip.
#[derive(Debug, Clone)]
pub(super) struct Outcome {
    /// The object from the first touch on, one pose a period.
    pub(super) object: Path,
    /// What the encoders read at the clip's arm stamps [rad].
    pub(super) joints: Vec<Joints>,
    /// Stamp of the first touch.
    pub(super) contact_ns: Option<u64>,
    pub(super) camera: CameraEffects,
}

/// Poses a period apart; before the first and after the last the object rests.
#[derive(Debug, Clone, Default)]
pub(super) struct Path {
    pub(super) start_ns: u64,
    pub(super) poses: Vec<Isometry3<f64>>,
}

impl Path {
    /// The pose at a time, between periods on the straight way.
    pub(super) fn at(&self, stamp_ns: f64) -> Isometry3<f64> {
        let along = (stamp_ns - self.start_ns as f64) / TICK_NS as f64;
        let last = self.poses.len() - 1;
        if along <= 0.0 {
            return self.poses[0];
        }
        if along >= last as f64 {
            return self.poses[last];
        }
        let (row, share) = (along.floor() as usize, along.fract());
        self.poses[row].lerp_slerp(&self.poses[row + 1], share)
    }
}
