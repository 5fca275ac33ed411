//! nerfstudio's `transforms.json`, and `poses.json` of a camera that a robot held. In the first, a camera looks along its -z and
//! y is up (OpenGL); in the second x is right, y down, z forwards, lengths are metres and poses are `x, y, z, qw, qx, qy, qz`, or
//! those of the end effector, `O_T_EE`.

use super::camera::{Camera, Lens};
use super::error::ScanError;
use super::held::Held;
use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use shared_mem::hand_eye::Matrix;
use shared_mem::input::{self, Kind};
use std::path::{Path, PathBuf};

/// Numbers of a camera as they stand beside the frames or in each of them.
#[derive(Debug, Clone, Default, Deserialize)]
struct Numbers {
    camera_model: Option<String>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct File {
    #[serde(flatten)]
    camera: Numbers,
    depth_unit_scale_factor: Option<f64>,
    /// How the camera is mounted, where frames give the end effector's pose.
    hand_eye: Option<PathBuf>,
    /// How high the table is on which the object stands [m].
    table: Option<f64>,
    frames: Vec<Frame>,
}

#[derive(Debug, Deserialize)]
struct Frame {
    file_path: PathBuf,
    mask_path: Option<PathBuf>,
    depth_file_path: Option<PathBuf>,
    transform_matrix: Option<[[f64; 4]; 4]>,
    /// Of `poses.json` in place of the matrix.
    base_from_camera: Option<[f64; 7]>,
    /// And in place of both.
    #[serde(rename = "O_T_EE")]
    end_effector: Option<Matrix>,
    #[serde(flatten)]
    camera: Numbers,
}

/// A picture as the file lists it; paths are relative to the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Listed {
    pub(crate) picture: PathBuf,
    pub(crate) mask: Option<PathBuf>,
    pub(crate) depth: Option<PathBuf>,
    pub(crate) camera: Camera,
    pub(crate) scan_from_camera: Isometry3<f64>,
}

/// The pictures of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct List {
    pub(crate) listed: Vec<Listed>,
    /// Metres for one count of a depth picture, where the file says it.
    pub(crate) depth_unit: Option<f64>,
    /// Whether poses are a robot's: metres in its base frame.
    pub(crate) of_robot: bool,
    /// How high the table is, where a robot's file says it [m].
    pub(crate) table: Option<f64>,
}

/// Reads a file and, where it gives the end effector's poses, how the camera is mounted.
pub(crate) fn read(path: &Path) -> Result<List, ScanError> {
    let bad = |what: String| ScanError::content(path, what);
    let text = input::text(path, Kind::Poses)?;
    let file: File = serde_json::from_str(&text).map_err(|error| bad(format!("{error}; see docs/reconstruct.md")))?;
    let is_held = file.frames.iter().any(|frame| frame.end_effector.is_some());
    let held = is_held.then(|| Held::read(path, file.hand_eye.as_deref())).transpose()?;
    let listed = file.frames.iter().map(|frame| {
        let name = frame.file_path.display();
        let camera = camera(&file.camera, &frame.camera).map_err(|what| bad(format!("{name}: {what}")))?;
        let pose = match (&held, &frame.end_effector) {
            (Some(held), Some(end_effector)) => held.base_from_camera(end_effector),
            (Some(_), None) => Err("has no `O_T_EE`, as other frames do".into()),
            (None, _) => pose(frame),
        };
        Ok(Listed {
            picture: frame.file_path.clone(),
            mask: frame.mask_path.clone(),
            depth: frame.depth_file_path.clone(),
            camera,
            scan_from_camera: pose.map_err(|what| bad(format!("{name}: {what}")))?,
        })
    });
    let of_robot = is_held || path.file_name().is_some_and(|name| name == "poses.json");
    if file.table.is_some_and(|height| !height.is_finite() || !of_robot) {
        return Err(bad(
            "`table` is the height of the table in a robot's base frame [m], and goes with poses in it".into()
        ));
    }
    Ok(List {
        table: file.table,
        of_robot,
        listed: listed.collect::<Result<_, ScanError>>()?,
        depth_unit: file.depth_unit_scale_factor,
    })
}

fn pose(frame: &Frame) -> Result<Isometry3<f64>, String> {
    match (&frame.transform_matrix, &frame.base_from_camera) {
        (Some(rows), _) => {
            let matrix = Matrix4::from_fn(|row, column| rows[row][column]);
            let turn: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
            let opencv = turn * Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
            isometry(&opencv, matrix.fixed_view::<3, 1>(0, 3).into_owned())
        }
        (None, Some([x, y, z, w, i, j, k])) => {
            let turn = Quaternion::new(*w, *i, *j, *k);
            if !(0.5..2.0).contains(&turn.norm()) || [x, y, z].iter().any(|v| !v.is_finite()) {
                return Err("`base_from_camera` is no pose; it is x, y, z [m], qw, qx, qy, qz".into());
            }
            Ok(Isometry3::from_parts(Translation3::new(*x, *y, *z), UnitQuaternion::from_quaternion(turn)))
        }
        (None, None) => Err("has none of `transform_matrix`, `base_from_camera` and `O_T_EE`".into()),
    }
}

/// A pose from a matrix that must be a rotation, but for rounding.
fn isometry(turn: &Matrix3<f64>, place: Vector3<f64>) -> Result<Isometry3<f64>, String> {
    let off = (turn.transpose() * turn - Matrix3::identity()).amax();
    if !(off < 1e-3 && place.iter().all(|v| v.is_finite())) {
        return Err(
            "`transform_matrix` holds no rotation; its columns must be of length one and square to each other".into()
        );
    }
    if turn.determinant() < 0.0 {
        return Err(
            "`transform_matrix` is mirrored (its determinant is -1): change the sign of one axis of the camera".into(),
        );
    }
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(turn));
    Ok(Isometry3::from_parts(Translation3::from(place), turn))
}

fn camera(common: &Numbers, own: &Numbers) -> Result<Camera, String> {
    let number = |of: fn(&Numbers) -> Option<f64>| of(own).or_else(|| of(common));
    let needed = |of: fn(&Numbers) -> Option<f64>, key: &str| number(of).ok_or_else(|| format!("`{key}` is missing"));
    let model = own.camera_model.as_ref().or(common.camera_model.as_ref());
    if let Some(model) = model
        .filter(|model| !["PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"].contains(&model.as_str()))
    {
        return Err(format!("the camera model {model} is not known here; undistort the pictures"));
    }
    let (width, height) = (needed(|n| n.w, "w")?, needed(|n| n.h, "h")?);
    let fx = needed(|n| n.fl_x, "fl_x")?;
    let or_zero = |of: fn(&Numbers) -> Option<f64>| number(of).unwrap_or(0.0);
    if or_zero(|n| n.k3) != 0.0 {
        return Err("`k3` is not known here; undistort the pictures".into());
    }
    let bends = [or_zero(|n| n.k1), or_zero(|n| n.k2), or_zero(|n| n.p1), or_zero(|n| n.p2)];
    let camera = Camera {
        width: width as u32,
        height: height as u32,
        focal: [fx, number(|n| n.fl_y).unwrap_or(fx)],
        centre: [number(|n| n.cx).unwrap_or(width / 2.0), number(|n| n.cy).unwrap_or(height / 2.0)],
        lens: if bends == [0.0; 4] { Lens::Straight } else { Lens::OpenCv(bends) },
    };
    camera.checked()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<Listed>, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("transforms.json");
        std::fs::write(&path, text).expect("a file");
        read(&path).map(|list| list.listed).map_err(|error| error.to_string())
    }

    const HEAD: &str = r#""fl_x": 600, "w": 640, "h": 480, "k1": -0.1"#;

    #[test]
    fn a_camera_of_opengl_looks_the_other_way_and_robot_poses_are_taken_as_they_are() {
        let matrix = "[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]";
        let text = format!(r#"{{{HEAD}, "frames": [{{"file_path": "a.png", "transform_matrix": {matrix}}}]}}"#);
        let listed = read_text(&text).expect("a scan");
        let forwards = listed[0].scan_from_camera.rotation * Vector3::z();
        assert!((forwards + Vector3::z()).norm() < 1e-12);
        assert_eq!(
            (listed[0].camera.centre, listed[0].camera.lens),
            ([320.0, 240.0], Lens::OpenCv([-0.1, 0.0, 0.0, 0.0]))
        );
        let text = format!(r#"{{{HEAD}, "frames": [{{"file_path": "a.png", "base_from_camera": [0,0,1,1,0,0,0]}}]}}"#);
        let listed = read_text(&text).expect("a scan");
        assert!((listed[0].scan_from_camera.rotation * Vector3::z() - Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn what_is_no_pose_or_no_camera_is_named_with_its_picture() {
        let frame =
            |matrix: &str| format!(r#"{{{HEAD}, "frames": [{{"file_path": "a.png", "transform_matrix": {matrix}}}]}}"#);
        let cases = [
            (frame("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), "mirrored"),
            (frame("[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "no rotation"),
            (r#"{"w": 640, "h": 480, "frames": [{"file_path": "a.png"}]}"#.into(), "`fl_x` is missing"),
            (format!(r#"{{{HEAD}, "table": 0.1, "frames": []}}"#), "a robot's base frame"),
            ("{}".into(), "frames"),
        ];
        for (text, what) in cases {
            let line = read_text(&text).expect_err("it is refused");
            assert!(line.contains(what) && !line.contains('\n'), "{line}");
        }
    }
}
