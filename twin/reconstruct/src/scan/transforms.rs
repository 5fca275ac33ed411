//! `transforms.json` of nerfstudio, instant-ngp and Blender, and `poses.json` of a camera that a robot held. In the first, a camera
//! looks along its -z and y is up (OpenGL); in the second x is right, y down, z forwards, lengths are metres and poses are `x, y, z,
//! qw, qx, qy, qz`, or those of the end effector, `O_T_EE`.

use super::camera::Camera;
use super::error::ScanError;
use super::held::Held;
use super::picture;
use super::table::Table;
use crate::remark::Remark;
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use shared_mem::budget::Budget;
use shared_mem::hand_eye::Matrix;
use shared_mem::input::{self, Kind};
use shared_mem::json;
use shared_mem::lens::listed::{ListedCamera, Numbers};
use shared_mem::lens::spelling::Other;
use shared_mem::recording::picture_size;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

#[derive(Debug, Deserialize)]
struct File {
    #[serde(flatten)]
    camera: Numbers,
    depth_unit_scale_factor: Option<f64>,
    /// How the camera is mounted, where frames give the end effector's pose.
    hand_eye: Option<PathBuf>,
    /// On what the object stands.
    table: Option<Stated>,
    frames: Vec<Frame>,
    #[serde(flatten)]
    others: BTreeMap<String, Other>,
}

/// How a file states the table, in the frame and the unit of its poses.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(
    untagged,
    expecting = "`table` is its height along z, or [nx, ny, nz, d]: its normal, up, and its distance from the origin along it"
)]
enum Stated {
    Height(f64),
    Plane([f64; 4]),
}

#[derive(Debug, Deserialize)]
struct Frame {
    file_path: String,
    mask_path: Option<String>,
    #[serde(alias = "depth_path")]
    depth_file_path: Option<String>,
    transform_matrix: Option<Vec<Vec<f64>>>,
    /// Of `poses.json` in place of the matrix.
    base_from_camera: Option<[f64; 7]>,
    /// And in place of both.
    #[serde(rename = "O_T_EE")]
    end_effector: Option<Matrix>,
    #[serde(flatten)]
    camera: Numbers,
    #[serde(flatten)]
    others: BTreeMap<String, Other>,
}

/// Keys of other programs that change nothing here: the volume and the exposure that their networks are trained with, numbers of
/// pictures, poses' frames that are as good as any other, and corners that `calibration hand-eye` reads.
const PASSED_OVER: [&str; 25] = [
    "aabb",
    "aabb_scale",
    "applied_scale",
    "applied_transform",
    "auto_orient_and_center_poses",
    "bounding_box",
    "camera_label",
    "cam_label",
    "colmap_im_id",
    "enable_depth_loading",
    "exposure",
    "frame_id",
    "image_id",
    "is_hdr",
    "n_extra_learnable_dims",
    "offset",
    "orientation_override",
    "ply_file_path",
    "points",
    "render_aabb",
    "rotation",
    "scale",
    "sharpness",
    "time",
    "timestamp",
];

/// A picture as the file lists it, and the file of its pixels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Listed {
    pub(crate) picture: PathBuf,
    pub(crate) pixels: PathBuf,
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
    /// On what the object stands, where the file says it.
    pub(crate) table: Option<Table>,
    /// What was not read of the file.
    pub(crate) remarks: Vec<Remark>,
}

/// Reads a file and, where it gives the end effector's poses, how the camera is mounted.
pub(crate) fn read(path: &Path) -> Result<List, ScanError> {
    let bad = |what: String| ScanError::content(path, what);
    let bytes = input::bytes(path, Kind::Poses)?;
    let file: File = json::read(&bytes, &Budget::of(bytes.len() as u64))
        .map_err(|what| bad(format!("{what}; docs/reconstruct.md has its keys")))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let is_held = file.frames.iter().any(|frame| frame.end_effector.is_some());
    let held = is_held.then(|| Held::read(path, file.hand_eye.as_deref())).transpose()?;
    let listed = file.frames.iter().map(|frame| {
        let picture = picture::path_of(&frame.file_path);
        let in_frame = |what: String| bad(format!("{}: {what}", picture.display()));
        Numbers::none_unread(&frame.others).map_err(in_frame)?;
        let pixels = picture::found(folder, &picture);
        let size = || picture_size(&pixels).map_err(|error| format!("`w` and `h` are missing, and {error}"));
        let [width, height] = frame.camera.size(&file.camera, size).map_err(in_frame)?;
        let ListedCamera { focal, centre, lens } =
            frame.camera.camera(&file.camera, || Ok([width, height])).map_err(in_frame)?;
        let pose = match (&held, &frame.end_effector) {
            (Some(held), Some(end_effector)) => held.base_from_camera(end_effector),
            (Some(_), None) => Err("has no `O_T_EE`, as other frames do".into()),
            (None, _) => pose(frame),
        };
        Ok(Listed {
            mask: frame.mask_path.as_deref().map(picture::path_of),
            depth: frame.depth_file_path.as_deref().map(picture::path_of),
            camera: Camera { width, height, focal, centre, lens },
            scan_from_camera: pose.map_err(in_frame)?,
            pixels,
            picture,
        })
    });
    let listed = listed.collect::<Result<_, ScanError>>()?;
    Numbers::none_unread(&file.others).map_err(bad)?;
    let of_robot = is_held || path.file_name().is_some_and(|name| name == "poses.json");
    let table = file.table.map(|stated| match stated {
        Stated::Height(z) => Ok(Table::at_height(z)),
        Stated::Plane(plane) => Table::plane(plane).ok_or("`table` is no plane: nx, ny, nz are the normal, not all 0"),
    });
    let table = table.transpose().map_err(|what| bad(what.into()))?;
    Ok(List { table, of_robot, listed, depth_unit: file.depth_unit_scale_factor, remarks: unread(&file) })
}

/// A remark on keys that say something here nobody knows.
fn unread(file: &File) -> Vec<Remark> {
    let frames = file.frames.iter().flat_map(|frame| frame.others.keys());
    let names: BTreeSet<&str> = file.others.keys().chain(frames).map(String::as_str).collect();
    let is_unread = |name: &&str| !PASSED_OVER.contains(name) && !Numbers::is_read(name);
    let names: Vec<String> = names.into_iter().filter(is_unread).map(|name| format!("`{name}`")).collect();
    if names.is_empty() {
        Vec::new()
    } else {
        vec![Remark(format!("not read of the poses' file: {}", names.join(", ")))]
    }
}

fn pose(frame: &Frame) -> Result<Isometry3<f64>, String> {
    match (&frame.transform_matrix, &frame.base_from_camera) {
        (Some(rows), _) => {
            let is_matrix = matches!(rows.len(), 3 | 4) && rows.iter().all(|row| row.len() == 4);
            // Where it is left out, the last row is the one that all poses have.
            if !is_matrix || rows.get(3).is_some_and(|last| last != &[0.0, 0.0, 0.0, 1.0]) {
                return Err(
                    "`transform_matrix` is no pose; it has three rows of four numbers, and 0, 0, 0, 1 as its fourth \
                            where it has one"
                        .into(),
                );
            }
            let turn = Matrix3::from_fn(|row, column| rows[row][column]);
            let opencv = turn * Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
            isometry(&opencv, Vector3::from_fn(|row, _| rows[row][3]))
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

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::lens::Distortion;

    fn read_text(text: &str) -> Result<List, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("transforms.json");
        std::fs::write(&path, text).expect("a file");
        read(&path).map_err(|error| error.to_string())
    }

    const HEAD: &str = r#""fl_x": 600, "w": 640, "h": 480, "k1": -0.1"#;

    fn frame(matrix: &str) -> String {
        format!(r#"{{{HEAD}, "frames": [{{"file_path": "a.png", "transform_matrix": {matrix}}}]}}"#)
    }

    #[test]
    fn a_camera_of_opengl_looks_the_other_way_and_robot_poses_are_taken_as_they_are() {
        let listed = read_text(&frame("[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]")).expect("a scan").listed;
        let forwards = listed[0].scan_from_camera.rotation * Vector3::z();
        assert!((forwards + Vector3::z()).norm() < 1e-12);
        assert_eq!(
            (listed[0].camera.centre, listed[0].camera.lens),
            ([320.0, 240.0], Distortion::brown([-0.1, 0.0, 0.0, 0.0, 0.0]))
        );
        let text = format!(r#"{{{HEAD}, "frames": [{{"file_path": "a.png", "base_from_camera": [0,0,1,1,0,0,0]}}]}}"#);
        let listed = read_text(&text).expect("a scan").listed;
        assert!((listed[0].scan_from_camera.rotation * Vector3::z() - Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn a_table_is_a_height_or_a_plane() {
        let table = |stated: &str| {
            let text =
                frame("[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5]]").replace("\"k1\"", &format!("\"table\": {stated}, \"k1\""));
            read_text(&text).expect("a scan").table.expect("a table")
        };
        assert_eq!(table("0.1"), Table::at_height(0.1));
        assert_eq!(table("[0, -2, 0, 0.3]"), Table { normal: -Vector3::y(), offset: 0.15 });
    }

    #[test]
    fn three_rows_are_a_matrix_and_what_other_programs_say_is_passed_over_or_named() {
        let full = read_text(&frame("[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]")).expect("a scan");
        let rows = read_text(&frame("[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5]]")).expect("a scan");
        let seen = |list: &List| (list.listed[0].camera, list.listed[0].scan_from_camera);
        assert_eq!((seen(&rows), &rows.remarks), (seen(&full), &full.remarks));
        assert_eq!(full.remarks, [], "all of its keys are read");
        let fisheye =
            frame("[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5]]").replace("\"k1\"", "\"camera_type\": \"fisheye\", \"k1\"");
        let lens = read_text(&fisheye).expect("a scan").listed[0].camera.lens;
        assert_eq!(lens, Distortion::Fisheye([-0.1, 0.0, 0.0, 0.0]));
        let more =
            frame("[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5]]").replace("\"k1\"", "\"aabb_scale\": 16, \"fog\": {}, \"k1\"");
        let read = read_text(&more).expect("a scan");
        assert_eq!(seen(&read), seen(&full));
        assert_eq!(read.remarks, [Remark("not read of the poses' file: `fog`".into())]);
    }

    #[test]
    fn what_is_no_pose_or_no_camera_is_named_with_its_picture() {
        let cases = [
            (frame("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), "mirrored"),
            (frame("[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "no rotation"),
            (frame("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]"), "three rows of four"),
            (frame("[[1,0,0],[0,1,0],[0,0,1]]"), "three rows of four"),
            (frame("[1,0,0,0]"), "a list is wanted"),
            (
                r#"{"w": 640, "h": 480, "frames": [{"file_path": "a.png"}]}"#.into(),
                "a.png: says nothing about its focal",
            ),
            (r#"{"fl_x": 640, "frames": [{"file_path": "a.png"}]}"#.into(), "`w` and `h` are missing"),
            (r#"{"fl_x": 640, "w": 9, "h": 9, "s1": 0.1, "frames": []}"#.into(), "`s1`"),
            (format!(r#"{{{HEAD}, "table": [0, 0, 0, 0.1], "frames": []}}"#), "`table` is no plane"),
            (format!(r#"{{{HEAD}, "table": [0, 1, 0], "frames": []}}"#), "[nx, ny, nz, d]"),
            (format!(r#"{{{HEAD}, "distCoeffs": [0.1], "frames": []}}"#), "`distCoeffs`"),
            (format!(r#"{{{HEAD}, "camera": {{"k2": 0.1}}, "frames": []}}"#), "`camera` holds `k2`"),
            (frame("[[1,0,0,0],[0,1,0,0],[0,0,1,0]]").replace("\"k1\"", "\"camera_type\": \"omni\", \"k1\""), "`omni`"),
            ("{}".into(), "has no `frames`"),
        ];
        for (text, what) in cases {
            let line = read_text(&text).expect_err("it is refused");
            assert!(line.contains(what) && !line.contains('\n') && !line.contains("expected"), "{line}");
        }
    }
}
