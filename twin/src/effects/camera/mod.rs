//! Effects on the report of the object's pose: when it was, where it was, how it was smoothed. The same for the simulated
//! tracker and for a prediction that is held against a recording.

pub(super) mod camera_extrinsic_rotation;
pub(super) mod camera_extrinsic_translation;
pub(super) mod camera_latency;
pub(super) mod camera_scale;
pub(super) mod tracker_smoothing;

use nalgebra::Isometry3;
use shared_mem::frames::{Base, Object, Pose};

/// The effects on the report of the object's pose that are installed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CameraEffects {
    pub(super) camera_latency: Option<camera_latency::CameraLatency>,
    pub(super) camera_extrinsic_rotation: Option<camera_extrinsic_rotation::CameraExtrinsicRotation>,
    pub(super) camera_extrinsic_translation: Option<camera_extrinsic_translation::CameraExtrinsicTranslation>,
    pub(super) camera_scale: Option<camera_scale::CameraScale>,
    pub(super) tracker_smoothing: Option<tracker_smoothing::TrackerSmoothing>,
}

/// What the tracker said last: stamp [ns] and pose.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CameraMemory {
    last: Option<(u64, Isometry3<f64>)>,
}

impl CameraEffects {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// How much older a pose is than its stamp says [ns].
    pub fn latency_ns(&self) -> u64 {
        self.camera_latency.map_or(0, |effect| effect.nanoseconds())
    }

    /// [`CameraEffects::report`] of a pose in the base frame; the pose itself, bit by bit, where there is no effect.
    pub fn seen(&self, memory: &mut CameraMemory, stamp_ns: u64, pose: Pose<Base, Object>) -> Pose<Base, Object> {
        if self.is_none() { pose } else { Pose::from_isometry(self.report(memory, stamp_ns, &pose.isometry())) }
    }

    /// How far from where it is everything seems to be that a picture shows (base frame), because the camera stands
    /// elsewhere than its calibration says.
    pub fn misplaced(&self) -> Isometry3<f64> {
        let mut moved = Isometry3::identity();
        if let Some(effect) = &self.camera_extrinsic_rotation {
            effect.apply(&mut moved);
        }
        if let Some(effect) = &self.camera_extrinsic_translation {
            effect.apply(&mut moved);
        }
        moved
    }

    /// The effects a picture cannot show, because they are the tracker's own, by name.
    pub fn of_the_tracker(&self) -> Vec<&'static str> {
        let scale = self.camera_scale.map(|_| camera_scale::EFFECT.name);
        scale.into_iter().chain(self.tracker_smoothing.map(|_| tracker_smoothing::EFFECT.name)).collect()
    }

    /// Where an object was that is reported at `pose`, but for latency and smoothing.
    pub fn undistorted(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let mut pose = *pose;
        if let Some(effect) = &self.camera_extrinsic_translation {
            effect.undo(&mut pose);
        }
        if let Some(effect) = &self.camera_extrinsic_rotation {
            effect.undo(&mut pose);
        }
        if let Some(effect) = &self.camera_scale {
            effect.undo(&mut pose);
        }
        pose
    }

    /// What the tracker reports about an object that was at `pose` (base frame) one latency before the stamp `stamp_ns`.
    /// Stamps must ascend; a fresh `memory` begins without smoothing.
    pub fn report(&self, memory: &mut CameraMemory, stamp_ns: u64, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let mut pose = *pose;
        if let Some(effect) = &self.camera_scale {
            effect.apply(&mut pose);
        }
        if let Some(effect) = &self.camera_extrinsic_rotation {
            effect.apply(&mut pose);
        }
        if let Some(effect) = &self.camera_extrinsic_translation {
            effect.apply(&mut pose);
        }
        if let (Some(effect), Some((stamp, last))) = (&self.tracker_smoothing, &memory.last) {
            pose = effect.follow(last, &pose, stamp_ns.saturating_sub(*stamp) as f64 * 1e-9);
        }
        memory.last = Some((stamp_ns, pose));
        pose
    }
}

#[cfg(test)]
mod test_camera {
    //! Effects to look through.

    use super::CameraEffects;
    use crate::effects::Effects;
    use shared_mem::theta::Theta;
    use std::path::Path;

    /// The effects of `[[effect]]` blocks.
    pub(super) fn effects(blocks: &str) -> CameraEffects {
        let theta: Theta = shared_mem::toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml");
        Effects::from_theta(&theta.effects, 7).expect("known effects").camera
    }
}

#[cfg(test)]
mod tests {
    use super::test_camera::effects;
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_picture_is_misplaced_as_reported_poses_are_and_shows_nothing_of_the_tracker() {
        let effects = effects(
            "[[effect]]\nname = \"camera_extrinsic_rotation\"\nrotation = [0.0, 0.01, 0.02]\n\
             [[effect]]\nname = \"camera_extrinsic_translation\"\ntranslation = [0.01, 0.0, -0.02]\n",
        );
        let pose = Isometry3::new(Vector3::new(0.5, 0.1, 0.05), Vector3::z() * 0.3);
        let reported = effects.report(&mut CameraMemory::default(), 0, &pose);
        let shown = effects.misplaced() * pose;
        assert!((reported.translation.vector - shown.translation.vector).norm() < 1e-15);
        assert!(reported.rotation.angle_to(&shown.rotation) < 1e-7);
        assert!(effects.of_the_tracker().is_empty());
    }

    #[test]
    fn scale_and_smoothing_are_the_trackers_own() {
        let effects = effects(
            "[[effect]]\nname = \"camera_scale\"\nscale = 0.02\n[[effect]]\nname = \"tracker_smoothing\"\ntime_constant = 0.05\n",
        );
        assert_eq!(effects.of_the_tracker(), ["camera_scale", "tracker_smoothing"]);
        assert_eq!(effects.misplaced(), Isometry3::identity());
    }
}
