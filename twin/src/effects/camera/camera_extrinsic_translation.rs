//! The camera stands elsewhere than its calibration says.
//!
//! - Equation: `pose_reported = pose + translation` in the base frame.
//! - Source: hand-eye calibration error.
//! - Unit: m. Plausible: -0.03 to 0.03 (0.005 after calibration).
//! - Signature (V1): every pose is off by the same, at rest too.
//! - Confused with: encoder offset, tool offset, a rotation seen over a small table.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, list};
use nalgebra::{Isometry3, Vector3};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "camera_extrinsic_translation",
    stage: Stage::Camera,
    acts_on: Place::ObjectObservation,
    parameters: &[Parameter::size("translation", "m", [-0.03, 0.03], 0.0).vector(3)],
    confusable_with: &["camera_extrinsic_rotation", "joint_encoder_offset", "tool_offset"],
    separated: &[],
    install: |values, effects| {
        effects.camera.camera_extrinsic_translation =
            Some(CameraExtrinsicTranslation { translation: values.vector("translation") });
    },
    remedy: |found| {
        let shift: [f64; 3] = found.vector("translation");
        let set = found.cell().camera.as_ref().map_or_else(String::new, |camera| {
            let place: Vec<String> =
                camera.pose.position.iter().zip(shift).map(|(x, shift)| format!("{:.4}", x - shift)).collect();
            format!("; in cell.toml, in pose under [camera]: position = [{}]", place.join(", "))
        });
        Remedy::new(
            format!(
                "Take {} mm along x, y, z off the camera's calibrated place, or calibrate it anew (`calibration viewpoint`){set}.",
                list(&shift.map(|x| 1e3 * x))
            ),
            format!("Nothing in the cell's model; a simulated camera reports poses shifted by {} m.", list(&shift)),
        )
    },
    model: |found| vec![Change::CameraShift(found.vector("translation"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CameraExtrinsicTranslation {
    translation: [f64; 3],
}

impl CameraExtrinsicTranslation {
    pub(super) fn apply(&self, pose: &mut Isometry3<f64>) {
        pose.translation.vector += Vector3::from(self.translation);
    }

    pub(super) fn undo(&self, pose: &mut Isometry3<f64>) {
        pose.translation.vector -= Vector3::from(self.translation);
    }
}

#[cfg(test)]
mod tests {
    use super::super::CameraMemory;
    use super::super::test_camera::effects;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn every_pose_is_shifted_and_none_turned() {
        let effects = effects("[[effect]]\nname = \"camera_extrinsic_translation\"\ntranslation = [0.0, 0.25, -0.5]");
        let pose = Isometry3::new(Vector3::new(0.5, 0.25, 0.5), Vector3::z() * 0.3);
        let seen = effects.report(&mut CameraMemory::default(), 0, &pose);
        assert_eq!(seen, Isometry3::new(Vector3::new(0.5, 0.5, 0.0), Vector3::z() * 0.3));
    }
}
