//! Lengths in the camera's picture are off by a factor.
//!
//! - Equation: `position_reported = (1 + scale) position` about the base's origin; about the camera instead it differs by a
//!   constant shift, which is `camera_extrinsic_translation`.
//! - Source: focal length, depth scale or marker size off.
//! - Unit: 1. Plausible: -0.1 to 0.1 (0.02 after calibration).
//! - Signature (V2): in proportion to the distance, at rest too; speeds and decelerations grow alike.
//! - Confused with: restitution and friction together, an extrinsic translation where the object hardly moves.

use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};
use nalgebra::Isometry3;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "camera_scale",
    stage: Stage::Camera,
    acts_on: Place::ObjectObservation,
    parameters: &[Parameter::size("scale", "1", [-0.1, 0.1], 0.0).within(-0.99, 100.0)],
    confusable_with: &["camera_extrinsic_translation", "restitution"],
    install: |values, effects| effects.camera.camera_scale = Some(CameraScale { scale: values.number("scale") }),
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CameraScale {
    scale: f64,
}

impl CameraScale {
    pub(super) fn apply(&self, pose: &mut Isometry3<f64>) {
        pose.translation.vector *= 1.0 + self.scale;
    }

    pub(super) fn undo(&self, pose: &mut Isometry3<f64>) {
        pose.translation.vector /= 1.0 + self.scale;
    }
}

#[cfg(test)]
mod tests {
    use super::super::CameraMemory;
    use super::super::test_camera::effects;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn distances_grow_by_the_scale_and_turns_stay() {
        let effects = effects("[[effect]]\nname = \"camera_scale\"\nscale = 0.25");
        let see = |x: f64| {
            let pose = Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::z() * 0.3);
            effects.report(&mut CameraMemory::default(), 0, &pose)
        };
        assert_eq!((see(0.8).translation.vector - see(0.4).translation.vector).x, 0.5);
        assert_eq!(see(0.8).rotation, see(0.4).rotation);
    }
}
