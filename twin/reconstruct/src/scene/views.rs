//! The views of a scene: sharp ones with depth, those held out apart; and whether poses and depth belong together.

use super::SceneError;
use crate::remark::Remark;
use crate::scan::{FEWEST_VIEWS, Frame, Scan, ScanError};
use crate::views::{is_held_out, read_all, without_blurred};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Longest edge of a picture [pixel]; larger ones are reduced.
const LONGEST: u32 = 800;
/// Views that are compared with another one, and the pixels of each.
const COMPARED: usize = 40;
const PIXELS: usize = 300;
/// A depth agrees with one from elsewhere that differs by so little of it.
const AGREES: f64 = 0.03;
/// Poses and depth belong together where so many agree.
const MIN_AGREEING_SHARE: f64 = 0.3;

/// What poses look like that do not agree with depth.
const FLIPPED: &str = "the cameras look the other way: give poses whose cameras look along -z with y up (transforms.json), or along z with \
                       y down (COLMAP, poses.json)";
const MIRRORED: &str =
    "the poses are mirrored: their frame is left-handed; change the sign of one axis of positions and rotations";

/// What the views show.
#[derive(Debug)]
pub(super) struct Views {
    pub(super) train: Vec<Frame>,
    pub(super) held_out: Vec<Frame>,
    pub(super) remarks: Vec<Remark>,
}

/// Reads all views. `done` is called with the number of views that are read.
pub(super) fn read(scan: &Scan, done: impl Fn(u64) + Sync) -> Result<Views, SceneError> {
    let frames = read_all(scan, LONGEST, |view, by| scan.whole_frame(view, by), done)?;
    let count = frames.len();
    let mut remarks = scan.remarks.clone();
    let has_depth = |frame: &Frame| !scan.has_depth() || frame.depth.iter().any(|z| *z > 0.0);
    let (frames, empty): (Vec<Frame>, Vec<Frame>) = frames.into_iter().partition(has_depth);
    if !empty.is_empty() {
        remarks.push(Remark(format!("{} views have no depth and were left out", empty.len())));
    }
    let frames = without_blurred(frames, &mut remarks);
    if frames.len() < FEWEST_VIEWS {
        let most = remarks.iter().map(|remark| remark.0.as_str()).collect::<Vec<_>>().join("; ");
        return Err(ScanError::Missing(format!(
            "{} of {count} views can be used, {FEWEST_VIEWS} are needed at least: {most}",
            frames.len()
        ))
        .into());
    }
    let (mut train, mut held_out) = (Vec::new(), Vec::new());
    for (number, frame) in frames.into_iter().enumerate() {
        if is_held_out(number) { held_out.push(frame) } else { train.push(frame) }
    }
    Ok(Views { train, held_out, remarks })
}

/// Points that views measured in pairs, in the frame of the first camera, with the second view.
struct Pair<'a> {
    points: Vec<Point3<f64>>,
    from: &'a Frame,
    to: &'a Frame,
}

/// Views with another one each: a quarter of the others stands nearer. The nearest would agree at any scale, the farthest see nothing
/// of the same.
fn pairs(frames: &[Frame]) -> Vec<Pair<'_>> {
    let every = frames.len().div_ceil(COMPARED);
    let one = |number: usize| {
        let from = &frames[number];
        let place = |frame: &Frame| frame.scan_from_camera.translation.vector;
        let away = |frame: &Frame| (place(frame) - place(from)).norm();
        let mut others: Vec<&Frame> = frames.iter().collect();
        others.sort_by(|a, b| away(a).total_cmp(&away(b)));
        let to = others[others.len() / 4];
        let width = from.camera.width as usize;
        let points = (0..from.depth.len()).step_by((from.depth.len() / PIXELS).max(1) | 1).filter_map(|at| {
            let z = f64::from(from.depth[at]);
            let [x, y] = from.camera.direction([(at % width) as f64 + 0.5, (at / width) as f64 + 0.5]);
            (z > 0.0).then(|| Point3::new(x * z, y * z, z))
        });
        Pair { points: points.collect(), from, to }
    };
    (0..frames.len()).step_by(every).map(one).collect()
}

/// Which share of the points that both views of a pair could see they measure alike, had one unit of the poses so many metres and
/// the cameras' axes been meant so.
fn agreement(pairs: &[Pair<'_>], metres: f64, meant: &dyn Fn(&Isometry3<f64>) -> Isometry3<f64>, within: f64) -> f64 {
    let (mut alike, mut all) = (0usize, 0usize);
    for pair in pairs {
        let (from, to) = (meant(&pair.from.scan_from_camera), meant(&pair.to.scan_from_camera));
        let mut across = to.inverse() * from;
        across.translation.vector *= metres;
        let (width, height) = (pair.to.camera.width, pair.to.camera.height);
        for point in &pair.points {
            let local = across * point;
            let Some([u, v]) = pair.to.camera.project(&local) else { continue };
            if !(u >= 0.0 && v >= 0.0 && u < f64::from(width) && v < f64::from(height)) {
                continue;
            }
            let measured = f64::from(pair.to.depth[v as usize * width as usize + u as usize]);
            if measured > 0.0 {
                all += 1;
                alike += usize::from((measured / local.z - 1.0).abs() < within);
            }
        }
    }
    alike as f64 / all.max(PIXELS) as f64
}

fn turned(by: Vector3<f64>, of_world: bool) -> impl Fn(&Isometry3<f64>) -> Isometry3<f64> {
    let mirror = Matrix3::from_diagonal(&by);
    move |pose: &Isometry3<f64>| {
        let rotation = pose.rotation.to_rotation_matrix();
        let (rotation, place) = if of_world {
            (mirror * rotation.matrix() * mirror, mirror * pose.translation.vector)
        } else {
            (rotation.matrix() * mirror, pose.translation.vector)
        };
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Isometry3::from_parts(place.into(), rotation)
    }
}

/// Looks whether depth and poses belong together; `is_scale_open`: nobody has said how long a unit of the poses is.
///
/// # Errors
/// One line with what is wrong: the scale, the axes of the cameras, a mirrored frame.
pub(super) fn agree(frames: &[Frame], is_scale_open: bool) -> Result<(), SceneError> {
    let pairs = pairs(frames);
    let share = agreement(&pairs, 1.0, &|pose| *pose, AGREES);
    let flipped = |guess: &'static str, meant: &dyn Fn(&Isometry3<f64>) -> Isometry3<f64>| {
        (agreement(&pairs, 1.0, meant, AGREES) > MIN_AGREEING_SHARE.max(1.5 * share)).then_some(guess)
    };
    let guess = if share < MIN_AGREEING_SHARE {
        flipped(FLIPPED, &turned(Vector3::new(1.0, -1.0, -1.0), false))
            .or_else(|| flipped(MIRRORED, &turned(Vector3::new(-1.0, 1.0, 1.0), true)))
    } else {
        None
    };
    if guess.is_none() && is_scale_open {
        scale_agrees(&pairs)?;
    }
    if share >= MIN_AGREEING_SHARE {
        return Ok(());
    }
    Err(ScanError::Missing(format!(
        "depth and poses do not agree: {:.0} % of the points that two views see are at the same place for both; {}",
        share * 100.0,
        guess.unwrap_or("look whether poses, pictures and depth belong together")
    ))
    .into())
}

/// An error where depth agrees far better at another scale.
fn scale_agrees(pairs: &[Pair<'_>]) -> Result<(), SceneError> {
    let best = |scales: Vec<f64>, within: f64| {
        let shares: Vec<f64> =
            scales.par_iter().map(|metres| agreement(pairs, *metres, &|pose| *pose, within)).collect();
        let best = (0..scales.len()).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(0);
        (scales[best], shares[best])
    };
    let (metres, share) = best((-120..=120).map(|step| 1.025f64.powi(step)).collect(), AGREES / 2.0);
    let now = agreement(pairs, 1.0, &|pose| *pose, AGREES / 2.0);
    if (metres - 1.0).abs() < 0.04 || share < MIN_AGREEING_SHARE.max(1.3 * now) {
        return Ok(());
    }
    let (metres, _) = best((-30..=30).map(|step| metres * 1.001f64.powi(step)).collect(), AGREES / 4.0);
    Err(SceneError::Scale { metres })
}
