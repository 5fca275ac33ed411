//! A clip as a TwinAligner folder, byte-compatible with what its recorder writes: `init.json`, `control.json`,
//! `frame.json`, `cam_K.txt`, `rgb/`, `depth/` and `pose.npy`. Seconds count from the clip's first row.
//!
//! The format pairs one joint state, one picture and one pose in a frame. Frames are made of the poses where there are
//! any, else of the pictures, else of the joint rows; the joint row that is nearest in time goes with each.

use super::super::picture::Picture;
use super::super::picture_file::pack_png;
use super::super::{Payload, ReadError};
use super::left_out::Carried;
use super::source::Source;
use super::{ExportError, Exported, FlangeAt, npz};
use crate::cell::{Camera, CameraPose, Cell};
use crate::msg::image::{CameraInfo, ImageHeader, PixelEncoding};
use crate::origin;
use crate::output::{OutputError, OutputFolder};
use serde_json::{Map, Value, json};
use std::path::Path;

/// A picture farther than this from its frame belongs to none [ns]: half a frame at 30 Hz.
const SAME_MOMENT_NS: u64 = 16_000_000;

/// Where the clip goes: the new session, and the clip's name in it.
type Place<'a> = (&'a OutputFolder, &'a Path);

/// Writes the folder.
pub(super) fn write(
    source: &Source,
    (cell, carried): (&Cell, &mut Carried),
    target: Place<'_>,
    flange_at: FlangeAt<'_>,
) -> Result<Exported, ExportError> {
    let clip = &source.clip;
    let mut exported = Exported::of(source, target.1);
    if clip.measured.is_empty() || clip.desired.is_empty() {
        let what = "has no arm, which a TwinAligner folder needs; export it as a ROS 2 bag".to_owned();
        return Err(ExportError::Unfit { path: source.path.clone(), what });
    }
    let origin = clip.measured.stamps_ns[0].min(clip.desired.stamps_ns[0]);
    let seconds = |stamp_ns: u64| crate::time::seconds_between(origin, stamp_ns);
    let frames = frames(source)?;

    put_json(target, "init.json", &init(source, cell))?;
    let controls = clip
        .desired
        .stamps_ns
        .iter()
        .enumerate()
        .map(|(i, stamp)| json!({ "id": i, "ros_timestamp": seconds(*stamp), "cmd": clip.desired.q_row(i) }));
    put_json(target, "control.json", &controls.collect())?;
    let listed = frames.iter().enumerate().map(|(i, frame)| {
        let q = clip.measured.q_row(frame.row);
        let mut entry = Map::new();
        entry.insert("id".into(), json!(i));
        entry.insert("ros_timestamp".into(), json!(seconds(clip.measured.stamps_ns[frame.row])));
        entry.insert("camera_timestamp".into(), json!(seconds(frame.stamp_ns)));
        entry.insert("joint_state".into(), json!(q));
        if let Some((position, wxyz)) = flange_at(q) {
            entry.insert("ee_trans".into(), json!(position));
            entry.insert("ee_quat_wxyz".into(), json!(wxyz));
        }
        Value::Object(entry)
    });
    put_json(target, "frame.json", &listed.collect())?;
    put_poses(source, cell, target, &mut exported)?;
    let info = put_pictures(source, &frames, target, (&mut exported, carried))?;
    put_camera(info, cell, target)?;
    if frames.len() < clip.measured.len() {
        let what =
            format!("{} joint rows between the frames have no room in the format", clip.measured.len() - frames.len());
        exported.warnings.push(what);
    }
    if clip.measured.dq_row(0).is_some() || clip.measured.tau_row(0).is_some() {
        exported.warnings.push("velocities and torques have no room in the format".into());
    }
    let is_lost = |from: &origin::Origin| from.source() != origin::Source::Elsewhere;
    if clip.origins.iter().any(is_lost) {
        let what = format!("where the clip comes from has no room in the format: {}", clip.origins);
        exported.warnings.push(what);
    }
    Ok(exported)
}

/// One frame: when its picture was taken, and the joint row that goes with it.
struct Frame {
    stamp_ns: u64,
    row: usize,
}

fn frames(source: &Source) -> Result<Vec<Frame>, ReadError> {
    let clip = &source.clip;
    let rows = &clip.measured.stamps_ns;
    let mut stamps = clip.object.stamps_ns.clone();
    if stamps.is_empty() {
        for beside in source.beside()? {
            let beside = beside?;
            if let Payload::Picture(Picture::Pixels { header, .. }) = &beside.payload
                && header.encoding == PixelEncoding::Rgb8
            {
                stamps.push(beside.stamp_ns);
            }
        }
    }
    if stamps.is_empty() {
        stamps.clone_from(rows);
    }
    // As many of each: they were recorded in pairs.
    let paired = stamps.len() == rows.len();
    let row = |i: usize, stamp_ns: u64| if paired { i } else { nearest(rows, stamp_ns) };
    Ok(stamps.iter().enumerate().map(|(i, stamp_ns)| Frame { stamp_ns: *stamp_ns, row: row(i, *stamp_ns) }).collect())
}

/// Index of the stamp that is nearest; 0 where there is none.
fn nearest(stamps: &[u64], stamp_ns: u64) -> usize {
    let after = stamps.partition_point(|stamp| *stamp < stamp_ns);
    let before = after.saturating_sub(1);
    match stamps.get(after) {
        Some(later) if later - stamp_ns < stamp_ns.abs_diff(stamps[before]) => after,
        _ => before,
    }
}

fn init(source: &Source, cell: &Cell) -> Value {
    let gains = cell.controller.as_ref();
    json!({
        "init_pose": source.clip.measured.q_row(0),
        "k_gains": gains.map_or(&[][..], |c| &c.stiffness),
        "d_gains": gains.map_or(&[][..], |c| &c.damping),
    })
}

/// `pose.npy`: the object in the camera, one 4x4 a frame.
fn put_poses(source: &Source, cell: &Cell, target: Place<'_>, exported: &mut Exported) -> Result<(), ExportError> {
    let object = &source.clip.object;
    exported.poses = object.len();
    if object.is_empty() {
        return Ok(());
    }
    let camera = cell.camera.as_ref().filter(|camera| camera.pose != CameraPose::default());
    let Some(base_from_camera) = camera.and_then(Camera::base_from_camera) else {
        exported.poses = 0;
        exported.warnings.push(
            "the format gives poses in the camera, and cell.toml does not say where the camera stands: they were left \
             out; set `[camera] pose`"
                .into(),
        );
        return Ok(());
    };
    let camera_from_base = base_from_camera.isometry().inverse();
    let numbers = object.poses.iter().flat_map(|pose| {
        let matrix = (camera_from_base * pose.isometry()).to_homogeneous();
        // Row by row.
        matrix.transpose().as_slice().to_vec()
    });
    let data: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    put(target, "pose.npy", &npz::npy("<f8", &[object.len(), 4, 4], &data))
}

/// Pictures under the number of their frame; what the camera told about itself.
fn put_pictures(
    source: &Source,
    frames: &[Frame],
    target: Place<'_>,
    (exported, carried): (&mut Exported, &mut Carried),
) -> Result<Option<CameraInfo>, ExportError> {
    let stamps: Vec<u64> = frames.iter().map(|frame| frame.stamp_ns).collect();
    let (mut info, mut homeless) = (None, 0_usize);
    for beside in source.beside()? {
        let beside = beside?;
        match &beside.payload {
            Payload::CameraInfo(found) => {
                info = Some(**found);
                carried.one(&beside.topic);
            }
            Payload::Picture(Picture::Pixels { header, pixels }) => {
                let frame = nearest(&stamps, beside.stamp_ns);
                if stamps[frame].abs_diff(beside.stamp_ns) > SAME_MOMENT_NS {
                    homeless += 1;
                    continue;
                }
                put_picture(target, frame, header, pixels)?;
                exported.pictures += 1;
                carried.one(&beside.topic);
            }
            Payload::Picture(Picture::Compressed { .. }) => homeless += 1,
            _ => {}
        }
    }
    if homeless > 0 {
        exported.warnings.push(format!("{homeless} pictures belong to no frame, or are JPEGs; they were left out"));
    }
    Ok(info)
}

fn put_picture(target: Place<'_>, frame: usize, header: &ImageHeader, pixels: &[u8]) -> Result<(), ExportError> {
    let (width, height) = (header.width as usize, header.height as usize);
    let depth = header.encoding == PixelEncoding::Depth16;
    let row = width * if depth { 2 } else { 3 };
    let rows = pixels.chunks(header.stride.max(1) as usize).take(height);
    let tight: Vec<u8> = rows.flat_map(|line| line.iter().take(row).copied()).collect();
    if depth {
        let metres = |pair: &[u8]| (f64::from(u16::from_le_bytes([pair[0], pair[1]])) * header.depth_scale) as f32;
        let data: Vec<u8> = tight.chunks_exact(2).flat_map(|pair| metres(pair).to_le_bytes()).collect();
        let array = npz::npy("<f4", &[height, width], &data);
        return put(target, &format!("depth/{frame:05}.npz"), &npz::npz("depth", &array));
    }
    let name = format!("rgb/{frame:05}.png");
    let packed = pack_png(header.width, header.height, &tight, png::Compression::Fast);
    let bytes = packed.map_err(|error| OutputError::of(&target.1.join(&name), error.into()))?;
    put(target, &name, &bytes)
}

/// `cam_K.txt`, where the camera is known.
fn put_camera(info: Option<CameraInfo>, cell: &Cell, target: Place<'_>) -> Result<(), ExportError> {
    let described = cell.camera.as_ref().map(|camera| {
        let pinhole = camera.pinhole();
        [pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy]
    });
    let Some([fx, fy, cx, cy]) = info.map(|info| info.intrinsics).or(described) else { return Ok(()) };
    put(target, "cam_K.txt", format!("{fx:e} 0 {cx:e}\n0 {fy:e} {cy:e}\n0 0 1\n").as_bytes())
}

fn put_json(target: Place<'_>, name: &str, value: &Value) -> Result<(), ExportError> {
    let text = serde_json::to_vec(value).unwrap_or_default();
    put(target, name, &text)
}

fn put((folder, clip): Place<'_>, name: &str, bytes: &[u8]) -> Result<(), ExportError> {
    Ok(folder.write(&clip.join(name), bytes)?)
}
