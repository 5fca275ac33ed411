//! Poses of a camera that a robot holds, from the end effector's: `O_T_EE` of each picture times `EE_T_camera` of the hand-eye
//! calibration. They are in the base frame and in metres.

use super::error::ScanError;
use nalgebra::Isometry3;
use shared_mem::hand_eye::{HandEye, Matrix};
use std::path::Path;

/// The calibration's file where a list of pictures names none.
const USUAL: &str = "hand_eye.toml";

/// How the camera is mounted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Held {
    end_effector_from_camera: Isometry3<f64>,
}

impl Held {
    /// Reads the calibration that a list of pictures names, relative to the list, or the one beside it.
    ///
    /// # Errors
    /// [`ScanError`] when it is missing or the arm does not hold the camera.
    pub(super) fn read(list: &Path, named: Option<&Path>) -> Result<Self, ScanError> {
        let path = list.parent().unwrap_or(Path::new("")).join(named.unwrap_or(Path::new(USUAL)));
        if named.is_none() && !path.is_file() {
            let what = format!(
                "gives `O_T_EE`, and {USUAL} does not lie beside it: write it with `calibration hand-eye`, or name it with `hand_eye`"
            );
            return Err(ScanError::content(list, what));
        }
        let calibration = HandEye::read(&path).map_err(|error| ScanError::Missing(error.to_string()))?;
        let mount = calibration.end_effector_from_camera().map_err(|what| ScanError::content(&path, what))?;
        Ok(Self { end_effector_from_camera: mount })
    }

    /// The camera in the base frame.
    ///
    /// # Errors
    /// A sentence where the end effector's pose is none.
    pub(super) fn base_from_camera(&self, end_effector: &Matrix) -> Result<Isometry3<f64>, String> {
        Ok(end_effector.isometry()? * self.end_effector_from_camera)
    }
}

#[cfg(test)]
mod tests {
    use super::super::transforms;

    const MOUNT: &str =
        "mount = \"eye_in_hand\"\n[EE_T_camera]\nposition = [0.1, 0.0, 0.0]\norientation = [1.0, 0.0, 0.0, 0.0]\n";

    fn list(more: &str) -> String {
        let pose = "[0,1,0,0, -1,0,0,0, 0,0,1,0, 0.5,0.2,0.4,1]";
        format!(r#"{{{more} "fl_x": 600, "w": 640, "h": 480, "frames": [{{"file_path": "a.png", "O_T_EE": {pose}}}]}}"#)
    }

    #[test]
    fn the_arms_pose_and_the_mount_give_the_cameras_pose_in_metres() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("poses.json");
        std::fs::write(&path, list("")).expect("a file");
        let missing = transforms::read(&path).expect_err("no mount").to_string();
        assert!(missing.contains("calibration hand-eye") && !missing.contains('\n'), "{missing}");
        std::fs::write(folder.path().join("hand_eye.toml"), MOUNT).expect("a file");
        let read = transforms::read(&path).expect("a scan");
        let camera = read.listed[0].scan_from_camera.translation.vector;
        assert!((camera - nalgebra::Vector3::new(0.5, 0.3, 0.4)).norm() < 1e-9 && read.of_robot, "{camera}");
        std::fs::write(&path, list(r#""hand_eye": "of_monday.toml","#)).expect("a file");
        assert!(transforms::read(&path).expect_err("no such file").to_string().contains("of_monday.toml"));
        std::fs::write(folder.path().join("of_monday.toml"), "mount = \"fixed_camera\"\n").expect("a file");
        let fixed = transforms::read(&path).expect_err("not on the arm").to_string();
        assert!(fixed.contains("EE_T_camera") && !fixed.contains('\n'), "{fixed}");
    }
}
