//! Where the object stands: its height against its size, which tells lengths in other units, and its orientation, which tells
//! quaternions whose parts are in another order.

use super::columns::Columns;
use super::limits::{CAMERA_OFF, LEANS, NEAR_HEIGHT, ORDER_SHARE, REST_POSES, RESTS, STANDS};
use super::remark::{Fault, Remark, Severity, Size};
use super::statistics::{deviation, mean};
use inference::likelihood::arm::noise;
use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use twin::scene::{ObjectModel, ObjectShape};

/// Heights in half heights of the object that have a meaning, and what it is.
const HEIGHTS: [(f64, &str, &str); 4] = [
    (
        2.0,
        "`object.size` holds half widths",
        "give whole edge lengths in `[object] size` of cell.toml: twice those that stand there",
    ),
    (1e3, "the poses are in millimetres", "publish poses in metres"),
    (1e-3, "`object.size` is in millimetres", "give `[object] size` of cell.toml in metres"),
    (1e2, "the poses are in centimetres", "publish poses in metres"),
];

/// Corners of the object about its centre.
pub(super) fn corners(cell: &Cell) -> Option<Vec<Point3<f64>>> {
    let model = ObjectModel::new(cell, None).ok()??;
    Some(model.shape.triangles().0)
}

/// Poses in which the object rests: those before it is hit, or the last ones of a toss.
fn at_rest(clip: &Columns) -> Vec<Isometry3<f64>> {
    let poses: Vec<Isometry3<f64>> = clip.object.poses.iter().map(|pose| pose.isometry()).collect();
    // As the unit of the poses is in question, rest is seen beside their noise.
    let noise =
        [0, 1, 2].map(|k| noise::sigma(&poses.iter().map(|pose| pose.translation.vector[k]).collect::<Vec<_>>()));
    let most = RESTS * noise.into_iter().fold(1e-5, f64::max);
    let still = |w: &[Isometry3<f64>]| (w[1].translation.vector - w[0].translation.vector).norm() < most;
    let count = if clip.kind == ClipKind::FreeMotion {
        poses.windows(2).rev().take_while(|w| still(w)).count()
    } else {
        poses.windows(2).take_while(|w| still(w)).count()
    };
    if count < REST_POSES {
        return Vec::new();
    }
    if clip.kind == ClipKind::FreeMotion {
        poses[poses.len() - REST_POSES..].to_vec()
    } else {
        poses[..REST_POSES].to_vec()
    }
}

/// Height of the centre over the table in half heights of the object as it is turned, with one sigma; `None` without table.
fn height(poses: &[Isometry3<f64>], corners: &[Point3<f64>], cell: &Cell) -> Option<[f64; 2]> {
    let table = cell.table.as_ref()?.height;
    let below = |pose: &Isometry3<f64>| corners.iter().map(|c| -(pose.rotation * c).z).fold(0.0, f64::max);
    let ratios: Vec<f64> = poses.iter().map(|pose| (pose.translation.z - table) / below(pose)).collect();
    (!ratios.is_empty()).then(|| [mean(&ratios), deviation(&ratios) / (ratios.len() as f64).sqrt()])
}

/// Remarks on a clip with an object.
pub(super) fn remarks(clip: &Columns, cell: &Cell, corners: &[Point3<f64>]) -> Vec<Remark> {
    if let Some(remark) = order(clip, cell, corners) {
        return vec![remark];
    }
    unit(clip, cell, corners).into_iter().collect()
}

fn unit(clip: &Columns, cell: &Cell, corners: &[Point3<f64>]) -> Option<Remark> {
    let rest = at_rest(clip);
    let [value, sigma] = height(&rest, corners, cell)?;
    let (factor, meaning, remedy) =
        HEIGHTS.into_iter().find(|(factor, ..)| (value / factor - 1.0).abs() < NEAR_HEIGHT)?;
    let high = rest.first()?.translation.z - cell.table.as_ref()?.height;
    let off = (high - high / value).abs();
    let remark = Remark::new(
        Fault::LengthUnit,
        &clip.file,
        "object size",
        format!(
            "the object's centre rests {value:.3} times half its height above the table, {:.0} mm off ({factor} fits): {meaning}",
            off * 1e3
        ),
    )
    .sized(Size { value, interval: [value - 1.96 * sigma, value + 1.96 * sigma], unit: "half heights" });
    if off > CAMERA_OFF {
        return Some(remark.mended_by(remedy));
    }
    // A camera that is off by so much is a cause that a diagnosis may find.
    let doubt = format!("{remedy}; if they are right, look at `table.height` and at where the camera stands");
    Some(remark.mended_by(doubt).weighed(Severity::Warning))
}

/// How far the object is turned from the nearest of its axes that could look up [rad].
fn lean(rotation: &UnitQuaternion<f64>) -> f64 {
    let up = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (rotation * axis).z.abs());
    up.into_iter().fold(0.0, f64::max).min(1.0).acos()
}

/// The rotation if its parts were stored w first and read as x, y, z, w.
pub(super) fn reordered(read: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(read.i, read.j, read.k, read.w))
}

/// Quaternions under which a box stands on a face in most poses if their parts are put into the other order, and does not as
/// they are.
fn order(clip: &Columns, cell: &Cell, corners: &[Point3<f64>]) -> Option<Remark> {
    let model = ObjectModel::new(cell, None).ok()??;
    if !matches!(model.shape, ObjectShape::Box { .. }) || clip.object.len() < REST_POSES {
        return None;
    }
    let poses: Vec<Isometry3<f64>> = clip.object.poses.iter().map(|pose| pose.isometry()).collect();
    // What tumbles stands at its end alone.
    let poses = if clip.kind == ClipKind::FreeMotion { at_rest(clip) } else { poses };
    let fits = |pose: &Isometry3<f64>| {
        height(std::slice::from_ref(pose), corners, cell).is_none_or(|[ratio, _]| (ratio - 1.0).abs() < 0.3)
    };
    let stands = |pose: &Isometry3<f64>| lean(&pose.rotation) < STANDS && fits(pose);
    let fails = |pose: &Isometry3<f64>| lean(&pose.rotation) > LEANS || !fits(pose);
    let other = |pose: &Isometry3<f64>| Isometry3::from_parts(pose.translation, reordered(&pose.rotation));
    let only_other = poses.iter().filter(|pose| fails(pose) && stands(&other(pose))).count();
    let only_this = poses.iter().filter(|pose| stands(pose) && fails(&other(pose))).count();
    // One that stands, but at another height, is of another size.
    let leaning = poses.iter().filter(|pose| lean(&pose.rotation) > LEANS).count();
    let share = only_other as f64 / poses.len().max(1) as f64;
    if poses.is_empty() || share < ORDER_SHARE || only_this * 5 > only_other || leaning * 2 < only_other {
        return None;
    }
    let half = 1.96 * (share * (1.0 - share) / poses.len() as f64).sqrt();
    Some(
        Remark::new(
            Fault::Quaternion,
            &clip.file,
            "object poses",
            format!(
                "the object stands on none of its faces in {only_other} of {} poses, and on one if its quaternions hold w first",
                poses.len()
            ),
        )
        .sized(Size { value: share, interval: [share - half, (share + half).min(1.0)], unit: "share of poses" })
        .mended_by("publish quaternions as x, y, z, w"),
    )
}
