//! The camera looks into another direction than its calibration says.
//!
//! - Equation: `position_reported = centre + R(rotation) (position - centre)`, `orientation_reported = R(rotation) orientation`;
//!   the place that stays where it is is the base's origin, or wherever the camera was aligned. About another place it differs
//!   by a constant shift, which is `camera_extrinsic_translation`.
//! - Source: hand-eye calibration error.
//! - Units: rotation rad, a rotation vector in the base frame; centre m, in the base frame. Plausible: rotation -0.1 to 0.1
//!   (0.02 after calibration); centre within a metre of the base.
//! - Signature (V1): poses at rest are wrong too, by as much more as they are further away; all clips alike.
//! - Confused with: table tilt (a yaw bends nothing), encoder offset, tool offset.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Parameter, Search};
use crate::effects::remedy::{Remedy, list, short};
use crate::effects::separation::{Experiment, Separation};
use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "camera_extrinsic_rotation",
    stage: Stage::Camera,
    acts_on: Place::ObjectObservation,
    parameters: &[
        Parameter::size("rotation", "rad", [-0.1, 0.1], 0.0).vector(3).within(-3.2, 3.2),
        Parameter::form("centre", "m", [-1.0, 1.0], 0.0).vector(3).searched(Search::Middle),
    ],
    confusable_with: &["camera_extrinsic_translation", "joint_encoder_offset", "tool_offset", "table_tilt"],
    separated: &[Separation {
        from: "camera_extrinsic_translation",
        by: "put the object in a place far from the last one before each of these",
        record: &[Experiment::OneStroke, Experiment::OneStroke, Experiment::OneStroke, Experiment::OneStroke],
    }],
    install: |values, effects| {
        let centre: [f64; 3] = values.vector("centre");
        effects.camera.camera_extrinsic_rotation =
            Some(CameraExtrinsicRotation { rotation: values.vector("rotation"), centre: centre.into() });
    },
    remedy: |found| {
        let (turn, centre): ([f64; 3], [f64; 3]) = (found.vector("rotation"), found.vector("centre"));
        let back = Rotation3::new(Vector3::from(turn)).inverse();
        let pose = found.cell().camera.as_ref().and_then(|camera| camera.base_from_camera());
        let set = pose.map_or_else(String::new, |pose| {
            let pose = pose.isometry();
            let place = Vector3::from(centre) + back * (pose.translation.vector - Vector3::from(centre));
            let turned = UnitQuaternion::from_rotation_matrix(&back) * pose.rotation;
            let wxyz = [turned.w, turned.i, turned.j, turned.k].map(|x| format!("{x:.6}"));
            let place = [place.x, place.y, place.z].map(|x| format!("{x:.4}"));
            format!(
                "; in cell.toml under [camera]: pose = {{ position = [{}], orientation = [{}] }}",
                place.join(", "),
                wxyz.join(", ")
            )
        });
        let words = turn.map(|angle| short(angle.to_degrees())).join(", ");
        Remedy::new(
            format!(
                "Turn the camera's calibrated pose back by {words} degrees about the base's x, y, z axes through {} m, or calibrate it anew (`calibration viewpoint`){set}.",
                list(&centre)
            ),
            format!(
                "Nothing in the cell's model; a simulated camera reports poses turned by {} rad about {} m.",
                list(&turn),
                list(&centre)
            ),
        )
    },
    model: |found| vec![Change::CameraTurn { rotation: found.vector("rotation"), centre: found.vector("centre") }],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CameraExtrinsicRotation {
    rotation: [f64; 3],
    centre: Vector3<f64>,
}

impl CameraExtrinsicRotation {
    pub(super) fn apply(&self, pose: &mut Isometry3<f64>) {
        *pose = self.about_the_centre() * *pose;
    }

    pub(super) fn undo(&self, pose: &mut Isometry3<f64>) {
        *pose = self.about_the_centre().inverse() * *pose;
    }

    fn about_the_centre(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(self.rotation));
        Isometry3::from_parts((self.centre - turn * self.centre).into(), turn)
    }
}

#[cfg(test)]
mod tests {
    use super::super::CameraMemory;
    use super::super::test_camera::effects;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn a_yaw_moves_poses_around_the_base_and_turns_them() {
        let effects = effects("[[effect]]\nname = \"camera_extrinsic_rotation\"\nrotation = [0.0, 0.0, 0.02]");
        let pose = Isometry3::new(Vector3::new(0.5, 0.0, 0.05), Vector3::z() * 0.3);
        let seen = effects.report(&mut CameraMemory::default(), 0, &pose);
        let expected =
            Isometry3::new(Vector3::new(0.5 * 0.02f64.cos(), 0.5 * 0.02f64.sin(), 0.05), Vector3::z() * 0.32);
        assert!((seen.translation.vector - expected.translation.vector).norm() < 1e-15);
        assert!(seen.rotation.angle_to(&expected.rotation) < 1e-7);
    }

    #[test]
    fn a_yaw_about_a_place_leaves_that_place_and_moves_what_lies_beside_it() {
        let effects = effects(
            "[[effect]]\nname = \"camera_extrinsic_rotation\"\nrotation = [0.0, 0.0, 0.02]\ncentre = [0.5, 0.1, 0.0]",
        );
        let seen = |x| effects.report(&mut CameraMemory::default(), 0, &Isometry3::translation(x, 0.1, 0.05));
        assert!((seen(0.5).translation.vector - Vector3::new(0.5, 0.1, 0.05)).norm() < 1e-15);
        let beside = Vector3::new(0.5 + 0.1 * 0.02f64.cos(), 0.1 + 0.1 * 0.02f64.sin(), 0.05);
        assert!((seen(0.6).translation.vector - beside).norm() < 1e-15);
        let pose = Isometry3::new(Vector3::new(0.62, -0.2, 0.1), Vector3::z() * 0.3);
        let back = effects.undistorted(&effects.report(&mut CameraMemory::default(), 0, &pose));
        assert!((back.translation.vector - pose.translation.vector).norm() < 1e-15);
    }
}
