//! `hand_eye.toml`: where a camera is mounted, on the end effector or beside the robot. Written by `calibration hand-eye`, read
//! by whatever needs the pose of a camera that a robot holds. And the pose of the end effector as lists of pictures hold it.
#![allow(non_snake_case)] // O_T_EE and its kin are the Franka Control Interface's own symbols

use crate::cell::{Cell, Intrinsics};
use crate::frames::Pose;
use crate::input;
use crate::lens::Distortion;
use crate::toml_file::{self, TomlFileError};
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;

const ASKED: &str = "where a camera is mounted is asked for: give a file that `calibration hand-eye BOARD --out hand_eye.toml` has written";

/// Who holds the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mount {
    /// The arm: the camera is fixed to its end effector.
    EyeInHand,
    /// A stand beside the robot: the camera is fixed to its base.
    FixedCamera,
}

/// A pose with how sure it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of position [m] and orientation (w, x, y, z)")]
pub struct MountedPose {
    /// Position [m].
    pub position: [f64; 3],
    /// Orientation `w, x, y, z`.
    pub orientation: [f64; 4],
    /// 90 % intervals of the position [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_ci90: Option<[[f64; 2]; 3]>,
    /// 90 % intervals of what the orientation is off by, about the axes of the frame that the pose is in [rad].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_ci90: Option<[[f64; 2]; 3]>,
    /// Covariance of turn [rad] and shift [m], rows and columns in that order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 6]; 6]>,
}

/// The camera that was calibrated; its numbers were given and not changed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibratedCamera {
    /// Pinhole [pixel], the first pixel's middle at 0, 0.
    pub intrinsics: Intrinsics,
    /// The lens, as in `[camera]` of cell.toml.
    #[serde(default)]
    pub distortion: Distortion,
}

/// What is left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandEyeResidual {
    /// Pictures that took part.
    pub pictures: usize,
    /// Pictures that were left out because they do not fit.
    pub left_out: Vec<String>,
    /// Root mean square of the corners with the arm's poses as they were said [pixel].
    pub reprojection_px: f64,
    /// The same of pictures that took no part: each left out once [pixel].
    pub held_out_px: f64,
    /// One sigma of a corner by what single pictures leave [pixel].
    pub corner_sigma_px: f64,
    /// One sigma of the arm's position along each axis [m].
    pub arm_position_sigma: f64,
    /// One sigma of the arm's rotation about each axis [rad].
    pub arm_rotation_sigma: f64,
}

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandEye {
    /// Who holds the camera.
    pub mount: Mount,
    /// The camera's optical frame (z forwards, x right, y down) in the end effector's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub EE_T_camera: Option<MountedPose>,
    /// The camera's optical frame in the base frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub O_T_camera: Option<MountedPose>,
    /// Where the board lay in the base frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub O_T_board: Option<MountedPose>,
    /// Where the board was on the end effector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub EE_T_board: Option<MountedPose>,
    /// The camera's numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CalibratedCamera>,
    /// What is left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<HandEyeResidual>,
}

impl MountedPose {
    /// A pose without intervals.
    pub fn new(pose: &Isometry3<f64>) -> Self {
        let q = pose.rotation.quaternion();
        Self {
            position: pose.translation.vector.into(),
            orientation: [q.w, q.i, q.j, q.k],
            position_ci90: None,
            rotation_ci90: None,
            covariance: None,
        }
    }

    /// The pose; `None` where the orientation has no direction or a number is not finite.
    pub fn isometry(&self) -> Option<Isometry3<f64>> {
        Pose::<(), ()>::from_parts(self.position, self.orientation).map(|pose| pose.isometry())
    }
}

impl HandEye {
    /// Reads the file.
    ///
    /// # Errors
    /// [`TomlFileError`] when it cannot be read or is no such file.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        let text = input::text(path, input::Kind::Configuration)?;
        toml_file::parse(&text, path).map_err(|error| Cell::in_place_of(ASKED, &text, path, error))
    }

    /// The camera in the end effector's frame.
    ///
    /// # Errors
    /// A sentence for a camera that the arm does not hold, or a pose that is none.
    pub fn end_effector_from_camera(&self) -> Result<Isometry3<f64>, String> {
        let pose = self.EE_T_camera.as_ref().ok_or(
            "holds no `EE_T_camera`: the camera was not on the arm; calibrate one that is with `calibration hand-eye`",
        )?;
        pose.isometry().ok_or_else(|| "`EE_T_camera` is no pose; orientation is w, x, y, z".to_owned())
    }

    /// The file's text.
    ///
    /// # Panics
    /// Never: every field has a TOML form.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers, strings, arrays and tables have a TOML form")
    }
}

/// The end effector in the base frame [m] as lists of pictures hold it: sixteen numbers, column by column as libfranka has them
/// or row by row, or four rows of four.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged, expecting = "16 numbers, or four rows of four")]
pub enum Matrix {
    /// In one list.
    Flat([f64; 16]),
    /// Row by row.
    Rows([[f64; 4]; 4]),
}

/// How far a rotation written to few digits may be from one.
const ROUNDING: f64 = 2e-3;

impl Matrix {
    /// The pose.
    ///
    /// # Errors
    /// A sentence where it is none.
    pub fn isometry(&self) -> Result<Isometry3<f64>, String> {
        let matrix = match self {
            Self::Rows(rows) => Matrix4::from_fn(|row, column| rows[row][column]),
            // The row 0, 0, 0, 1 tells which way round; where both have it, the position is zero.
            Self::Flat(list) if list[12..15] == [0.0; 3] && [list[3], list[7], list[11]] != [0.0; 3] => {
                Matrix4::from_row_slice(list)
            }
            Self::Flat(list) => Matrix4::from_column_slice(list),
        };
        let turn: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let shift: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        let last = matrix.row(3);
        let off = (turn.transpose() * turn - Matrix3::identity()).amax();
        let is_last = last.iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-6);
        if !(is_last && off < ROUNDING && turn.determinant() > 0.0 && shift.iter().all(|v| v.is_finite())) {
            return Err("`O_T_EE` is no pose: a rotation, a position in metres, and the row 0, 0, 0, 1".into());
        }
        if shift.norm() > 20.0 {
            return Err(format!("`O_T_EE` lies {:.0} m from the base; its position is in metres", shift.norm()));
        }
        let turn = Rotation3::from_matrix_eps(&turn, 1e-12, 100, Rotation3::from_matrix_unchecked(turn));
        Ok(Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_rotation_matrix(&turn)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(text: &str) -> Result<Isometry3<f64>, String> {
        serde_json::from_str::<Matrix>(text).map_err(|error| error.to_string())?.isometry()
    }

    #[test]
    fn a_matrix_is_understood_by_columns_by_rows_and_in_rows() {
        let rows = "[[0,-1,0,0.5],[1,0,0,0.1],[0,0,1,0.3],[0,0,0,1]]";
        let flat = "[0,-1,0,0.5,1,0,0,0.1,0,0,1,0.3,0,0,0,1]";
        let columns = "[0,1,0,0,-1,0,0,0,0,0,1,0,0.5,0.1,0.3,1]";
        let found = [rows, flat, columns].map(|text| matrix(text).expect("a pose"));
        assert!(found.iter().all(|pose| (pose.translation.vector - Vector3::new(0.5, 0.1, 0.3)).norm() < 1e-12));
        assert!(found.iter().all(|pose| (pose * Vector3::x() - Vector3::y()).norm() < 1e-9));
        for wrong in [
            "[1,0,0,0,0,1,0,0,0,0,-1,0,0.5,0.1,0.3,1]",
            "[2,0,0,0,0,1,0,0,0,0,1,0,0.5,0.1,0.3,1]",
            "[1,0,0,0,0,1,0,0,0,0,1,0,500,100,300,1]",
            "[1,2,3]",
        ] {
            let line = matrix(wrong).expect_err("no pose");
            assert!(!line.contains('\n'), "{line}");
        }
    }

    #[test]
    fn a_cell_in_its_place_is_said_to_be_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cell.toml");
        std::fs::write(&path, include_str!("../../config/fr3_cell.toml")).expect("room");
        let error = HandEye::read(&path).expect_err("a cell").to_string();
        assert!(error.contains("describes a cell, and where a camera is mounted is asked for"), "{error}");
    }

    #[test]
    fn a_file_comes_back_as_it_was_written() {
        let pose = MountedPose {
            position_ci90: Some([[0.0, 0.1]; 3]),
            covariance: Some([[1e-6; 6]; 6]),
            ..MountedPose::new(&Isometry3::translation(0.05, 0.0, 0.04))
        };
        let written = HandEye {
            mount: Mount::EyeInHand,
            EE_T_camera: Some(pose),
            O_T_camera: None,
            O_T_board: None,
            EE_T_board: None,
            camera: None,
            residual: None,
        };
        let read: HandEye = toml::from_str(&written.to_toml()).expect("its own text");
        assert_eq!(read, written);
        assert!((read.end_effector_from_camera().expect("a pose").translation.x - 0.05).abs() < 1e-12);
        let fixed = HandEye { EE_T_camera: None, ..written };
        assert!(fixed.end_effector_from_camera().expect_err("no such pose").contains("calibration hand-eye"));
    }
}
