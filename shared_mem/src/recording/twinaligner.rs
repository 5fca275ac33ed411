//! A TwinAligner clip folder as a clip: `control.json` (commands), `frame.json` (joint states at picture rate) and
//! `pose.npy` (object in the camera, one 4x4 a frame). Times in it are seconds since the clip's start.

use super::checks;
use super::clip::{self, Clip, NamedLog};
use super::error::ReadError;
use super::joint_log::JointLog;
use super::npy;
use super::origins;
use super::ros2::JointState;
use crate::budget::Budget;
use crate::cell::{CameraPose, Cell, ClipKind};
use crate::frames::{Base, Camera, Object, Pose};
use crate::input;
use crate::json;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::Path;

pub(super) const CONTROL: &str = "control.json";
pub(super) const FRAME: &str = "frame.json";
pub(super) const POSE: &str = "pose.npy";

/// One command.
#[derive(Debug, Deserialize)]
struct Control {
    /// [s]
    ros_timestamp: f64,
    /// Desired joint positions [rad].
    cmd: Vec<f64>,
}

/// One picture and the robot's state with it.
#[derive(Debug, Deserialize)]
struct Frame {
    /// When the state was read [s].
    ros_timestamp: f64,
    /// When the picture was taken [s].
    #[serde(default)]
    camera_timestamp: Option<f64>,
    /// Joint positions [rad].
    joint_state: Vec<f64>,
}

/// True for a folder that holds the two files without which there is no clip.
pub(super) fn is_clip_folder(path: &Path) -> bool {
    path.join(CONTROL).is_file() && path.join(FRAME).is_file()
}

/// Reads a clip folder.
pub(super) fn read(path: &Path, kind: ClipKind, cell: &Cell) -> Result<Clip, ReadError> {
    let controls: Vec<Control> = read_json(&path.join(CONTROL))?;
    let frames: Vec<Frame> = read_json(&path.join(FRAME))?;
    if controls.is_empty() || frames.is_empty() {
        return Err(ReadError::kind(path, "holds no commands or no frames; record the clip again"));
    }
    let names = clip::numbered_joints(cell, frames.first().map_or(0, |f| f.joint_state.len()));
    let desired = log(&names, controls.iter().map(|c| (c.ros_timestamp, c.cmd.as_slice())));
    let measured = log(&names, frames.iter().map(|f| (f.ros_timestamp, f.joint_state.as_slice())));
    let joints = clip::joints(
        path,
        NamedLog { topic: FRAME, log: measured },
        NamedLog { topic: CONTROL, log: desired },
        &clip::wanted_joints(cell),
    )?;
    let mut clip = Clip { origins: origins::of_folder(), ..Clip::empty(path, kind) };
    clip.joint_names = joints.names;
    clip.desired = joints.desired;
    clip.measured = joints.measured;
    clip.warnings = joints.warnings;
    read_poses(path, cell, &frames, &mut clip)?;
    Ok(clip)
}

fn read_poses(path: &Path, cell: &Cell, frames: &[Frame], clip: &mut Clip) -> Result<(), ReadError> {
    let file = path.join(POSE);
    if !file.is_file() {
        clip.warnings
            .push(format!("`{POSE}` is not there: the object was not tracked; run the tracker on the pictures"));
        return Ok(());
    }
    let camera = cell.camera.as_ref().filter(|camera| camera.pose != CameraPose::default());
    let Some(base_from_camera) = camera.and_then(crate::cell::Camera::base_from_camera) else {
        clip.warnings.push(format!(
            "`{POSE}` gives the object in the camera, and cell.toml does not say where the camera stands; set \
             `[camera] pose` to use it"
        ));
        return Ok(());
    };
    let bytes = input::bytes(&file, input::Kind::Array)?;
    let budget = Budget::of(bytes.len() as u64);
    let array = npy::parse(&bytes, &budget).map_err(|what| ReadError::content(path, POSE, what.to_string()))?;
    let &[count, 4, 4] = array.shape.as_slice() else {
        let what = format!("has the shape {:?}; one 4x4 pose a frame is needed: (frames, 4, 4)", array.shape);
        return Err(ReadError::content(path, POSE, what));
    };
    if count != frames.len() {
        clip.warnings
            .push(format!("`{POSE}` holds {count} poses for {} frames; the first ones are paired", frames.len()));
    }
    let stamps = picture_stamps(frames, &mut clip.warnings);
    let rows = stamps.into_iter().zip(array.values.chunks_exact(16)).map(|(stamp, matrix)| {
        (nanoseconds(stamp), camera_from_object(matrix).map(|camera_from_object| base_from_camera * camera_from_object))
    });
    let rows: Vec<(u64, Option<Pose<Base, Object>>)> = rows.collect();
    let fail = |what| ReadError::content(path, POSE, what);
    let (object, warnings) = checks::object(rows, POSE).map_err(fail)?;
    clip.warnings.extend(warnings);
    let (object, warning) = checks::beside_arm(object, &clip.measured, POSE).map_err(fail)?;
    clip.object = object;
    clip.warnings.extend(warning);
    Ok(())
}

/// When the pictures of a clip folder were taken [ns], on the clock of the clip that [`read`] makes of it.
pub(super) fn picture_stamps_ns(path: &Path) -> Result<Vec<u64>, ReadError> {
    let frames: Vec<Frame> = read_json(&path.join(FRAME))?;
    Ok(picture_stamps(&frames, &mut Vec::new()).into_iter().map(nanoseconds).collect())
}

/// When the pictures were taken [s]; the times of the joint states where the camera's are missing or of another clock.
fn picture_stamps(frames: &[Frame], warnings: &mut Vec<String>) -> Vec<f64> {
    let by_camera: Option<Vec<f64>> = frames.iter().map(|f| f.camera_timestamp).collect();
    let near = |f: &Frame| f.camera_timestamp.is_some_and(|t| (t - f.ros_timestamp).abs() < 1.0);
    match by_camera {
        Some(stamps) if frames.iter().all(near) => stamps,
        _ => {
            warnings.push(format!(
                "`{FRAME}`: camera_timestamp is missing or more than 1 s from ros_timestamp; poses take ros_timestamp: \
                 let one clock stamp both"
            ));
            frames.iter().map(|f| f.ros_timestamp).collect()
        }
    }
}

/// Pose of the object in the camera from a row-major 4x4; `None` when it is no rigid transform.
fn camera_from_object(m: &[f64]) -> Option<Pose<Camera, Object>> {
    let &[a, b, c, x, d, e, f, y, g, h, i, z, ..] = m else { return None };
    let rotation = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let finite = m.iter().all(|v| v.is_finite());
    let rigid = finite && (rotation * rotation.transpose() - Matrix3::identity()).norm() < 1e-2;
    if !rigid || rotation.determinant() <= 0.0 {
        return None;
    }
    // The rotation that is nearest. `Rotation3::from_matrix` looks for it step by step and never leaves the identity
    // for a half turn.
    let parts = rotation.svd(true, true);
    let rotation = Rotation3::from_matrix_unchecked(parts.u? * parts.v_t?);
    let turn = UnitQuaternion::from_rotation_matrix(&rotation);
    Some(Pose::from_isometry(Isometry3::from_parts(Translation3::new(x, y, z), turn)))
}

/// Rows of seconds and joint positions as a log.
fn log<'a>(names: &[String], rows: impl Iterator<Item = (f64, &'a [f64])>) -> JointLog {
    let mut log = JointLog::default();
    for (seconds, position) in rows {
        let state = JointState {
            stamp_ns: nanoseconds(seconds),
            names: names.iter().map(String::as_str).collect(),
            position: position.to_vec(),
            velocity: Vec::new(),
            effort: Vec::new(),
        };
        log.push(&state, state.stamp_ns);
    }
    log
}

/// Seconds since the clip's start, which a first stamp may precede a little, as a stamp [ns]: one second is added.
fn nanoseconds(seconds: f64) -> u64 {
    ((seconds + 1.0) * 1e9).round().max(0.0) as u64
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, ReadError> {
    let bytes = input::bytes(path, input::Kind::List)?;
    parse_json(path, &bytes, &Budget::of(bytes.len() as u64))
}

fn parse_json<T: DeserializeOwned>(path: &Path, bytes: &[u8], budget: &Budget) -> Result<T, ReadError> {
    json::read(bytes, budget).map_err(|what| {
        ReadError::kind(path, format!("is not what a TwinAligner recorder writes: it {what}; record it again"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_read_within_its_budget_and_what_is_wrong_is_said_in_words() {
        let path = Path::new("clip/control.json");
        let read = |text: &str, room: u64| {
            parse_json::<Vec<Control>>(path, text.as_bytes(), &Budget::with(room, 1 << 20)).map_err(|e| e.to_string())
        };
        let rows = format!("[{}]", vec![r#"{"ros_timestamp": 0.1, "cmd": [1, 2]}"#; 100].join(","));
        assert_eq!(read(&rows, 1 << 20).expect("room enough").len(), 100);
        let line = read(&rows, 1 << 10).expect_err("too little room");
        assert!(line.contains("control.json") && line.contains("becomes more than"), "{line}");
        let line = read(r#"[{"ros_timestamp": 0.1, "cmd": 7}]"#, 1 << 20).expect_err("no list");
        assert!(line.contains("where a list is wanted") && !line.contains("expected"), "{line}");
    }
}
