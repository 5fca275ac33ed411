//! The object stands, before it is hit and after it came to rest: a box on a level table leans nowhere and stands half its height above
//! the table, wherever it stands.
//!
//! - Equations: with the seen axis `z` of the box `R e_z = (w_y, -w_x, 1)` for a small rotation `w` [rad] of what is seen about the
//!   base's axes; height `z - h / 2 - table = d + w_x (y - y0) - w_y (x - x0)`, `(x0, y0)` the middle of all places.
//! - What it shows: rotation of the camera about x and y (a table that leans against the arm's base shows in the same way, the gravity of
//!   the effect `table_tilt` does not), and a shift of the camera along z (so does a scale whose centre is not at that height).

use super::corrected::Corrected;
use super::regression::{Sample, regress};
use super::reported::Off;
use super::{Axis, CLIPS, SHARED_SHARE_OF_NOISE, Shown, Witness};
use crate::likelihood::object::{SEEN_MOTION, noise_of};
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::Cell;
use twin::scene::{ObjectModel, ObjectShape};

const STAGE: &str = "rest";
/// Poses so long before the first and after the last motion are those of an object at rest [ns] (a choice: six poses at 60 Hz).
const AROUND_MOTION_NS: u64 = 100_000_000;
/// The last poses are those of an object at rest, so many (a choice).
const LAST_POSES: usize = 10;
/// Fewer clips do not say how much clips differ (a choice).
const FEWEST_CLIPS: usize = 6;
/// A box that leans further does not stand on its face [rad] (a choice).
const STANDS: f64 = 0.2;
/// A camera may be turned by so much before anything is measured, one sigma [rad].
const PLAUSIBLE_ROTATION: f64 = 1.0;
/// And be off by so much [m].
const PLAUSIBLE_SHIFT: f64 = 0.1;

/// A pose at rest.
struct Standing {
    clip: usize,
    pose: Isometry3<f64>,
}

/// The witnesses of poses at rest, where the object is a box.
pub(super) fn witnesses(cell: &Cell, clips: &[Corrected]) -> Vec<Witness> {
    let Ok(Some(model)) = ObjectModel::new(cell, None) else { return Vec::new() };
    let ObjectShape::Box { half_extents } = model.shape else { return Vec::new() };
    let poses: Vec<Standing> = clips.iter().enumerate().flat_map(standing).collect();
    let noise = noise_of(cell);
    let lean = |k: usize, about: Shown| {
        let of = |standing: &Standing| {
            let up = standing.pose.rotation * Vector3::z();
            let measured = [-up.y, up.x][k];
            Sample { clip: standing.clip, regressors: vec![1.0], measured }
        };
        let samples: Vec<Sample> = poses.iter().map(of).collect();
        let found = regress(&samples, &[PLAUSIBLE_ROTATION], 1, SHARED_SHARE_OF_NOISE * noise.rotation)?;
        about.of(STAGE, 0, &samples, &found)
    };
    let height = || {
        let table = cell.table.as_ref()?.height + half_extents.z;
        let samples = heights(&poses, table);
        let scale = [PLAUSIBLE_SHIFT, PLAUSIBLE_ROTATION, PLAUSIBLE_ROTATION];
        let found = regress(&samples, &scale, 3, SHARED_SHARE_OF_NOISE * noise.position)?;
        shift_along_z().of(STAGE, 0, &samples, &found)
    };
    let [x, y] = ["rotation about x", "rotation about y"].map(rotation);
    let all = [lean(0, x), lean(1, y), height()];
    all.into_iter().flatten().filter(|witness| witness.clips >= FEWEST_CLIPS).collect()
}

fn rotation(number: &'static str) -> Shown {
    Shown {
        off: Off::Turn,
        number,
        unit: "rad",
        alike: &[],
        against: CLIPS,
        measured: Axis { name: "lean of the object at rest", unit: "rad" },
        turned: false,
    }
}

fn shift_along_z() -> Shown {
    Shown {
        off: Off::Shift,
        number: "translation along z",
        unit: "m",
        alike: &[Off::Scale],
        against: CLIPS,
        measured: Axis { name: "height of the object at rest above where it stands", unit: "m" },
        turned: false,
    }
}

/// Heights beyond `expected`, and where on the table.
fn heights(poses: &[Standing], expected: f64) -> Vec<Sample> {
    let count = poses.len().max(1) as f64;
    let middle = poses.iter().map(|standing| standing.pose.translation.vector).sum::<Vector3<f64>>() / count;
    let sample = |standing: &Standing| {
        let beside = standing.pose.translation.vector - middle;
        let measured = standing.pose.translation.z - expected;
        Sample { clip: standing.clip, regressors: vec![1.0, beside.y, -beside.x], measured }
    };
    poses.iter().map(sample).collect()
}

/// Poses of a clip before the first and after the last motion.
fn standing((clip, recorded): (usize, &Corrected)) -> Vec<Standing> {
    let (stamps, poses) = (&recorded.stamps_ns, &recorded.poses);
    if poses.len() <= LAST_POSES {
        return Vec::new();
    }
    let place = |row: usize| poses[row].translation.vector;
    let end = (poses.len() - LAST_POSES..poses.len()).map(place).sum::<Vector3<f64>>() / LAST_POSES as f64;
    let first = (0..poses.len()).find(|row| (place(*row) - place(0)).norm() > SEEN_MOTION);
    let last = (0..poses.len()).rfind(|row| (place(*row) - end).norm() > SEEN_MOTION);
    let (Some(first), Some(last)) = (first, last) else { return Vec::new() };
    let before = |row: &usize| stamps[*row] + AROUND_MOTION_NS < stamps[first];
    let after = |row: &usize| stamps[*row] > stamps[last] + AROUND_MOTION_NS;
    let upright = |row: &usize| (poses[*row].rotation * Vector3::z()).z > STANDS.cos();
    let at_rest = (0..poses.len()).filter(|row| (before(row) || after(row)) && upright(row));
    at_rest.map(|row| Standing { clip, pose: poses[row] }).collect()
}
