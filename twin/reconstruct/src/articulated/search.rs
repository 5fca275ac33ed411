//! Poses without a start: rotations spread over all (super-Fibonacci spirals, Alexa 2022), for each of them the translations that
//! most pairs of points with alike normals ask for (a Hough transform), then the best of them fitted.

use super::body::{Body, Place, Sample};
use super::fit::{Pair, Points};
use super::motion::Motion;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use shared_mem::ending;

/// Rotations that are tried; no rotation is further than about 15 degrees from one of them.
const ROTATIONS: usize = 4000;
/// Translations for each of them.
const PEAKS: usize = 3;
/// Cells of the votes along each axis, over [`SPAN`] sizes of the object.
const CELLS: usize = 48;
const SPAN: f64 = 2.6;
/// Points that vote, of each state.
const VOTERS: [usize; 2] = [160, 240];
/// Normals of a pair that votes agree so far (cosine).
const PARALLEL: f64 = 0.92;
/// Candidates that are fitted, and points of each state in such a fit.
const FITTED: usize = 160;
const POINTS: usize = 350;
/// Tolerances of a fit, of the object's size, and steps with each.
const TOLERANCES: [f64; 3] = [0.05, 0.025, 0.0125];
const STEPS_PER_TOLERANCE: usize = 6;
/// Two poses that carry the object's points nearer to each other than this share of its size are one.
const SAME_POSE: f64 = 0.03;

/// What a point counts that lies on the other state's surface, inside of it, in the open.
pub(super) fn value(place: &Place) -> f64 {
    match place {
        Place::On(..) => 1.0,
        Place::Hidden => 0.25,
        Place::Free => 0.0,
    }
}

/// Points that have to be explained, and what each counts already without the pose that is looked for.
pub(super) struct Open {
    pub(super) first: Vec<(Sample, f64)>,
    pub(super) second: Vec<(Sample, f64)>,
}

impl Open {
    /// All points, of which nothing is explained.
    pub(super) fn all(points: &Points<'_>) -> Self {
        let of = |samples: &[Sample]| samples.iter().map(|sample| (*sample, 0.0)).collect();
        Self { first: of(points.first), second: of(points.second) }
    }

    /// Points that are not on the other state's surface when the whole has a pose.
    pub(super) fn beside(pair: &Pair<'_>, points: &Points<'_>, pose: &Isometry3<f64>, tolerance: f64) -> Self {
        let of = |samples: &[Sample], other: &Body, pose: &Isometry3<f64>| {
            let counted = samples.iter().map(|s| (*s, value(&other.place_of(s, pose, tolerance))));
            counted.filter(|(_, value)| *value < 1.0).collect()
        };
        Self { first: of(points.first, pair.second, pose), second: of(points.second, pair.first, &pose.inverse()) }
    }

    /// What the points count more with a pose, of the first so many points of each state; a mean over both states' points.
    pub(super) fn gain(&self, pair: &Pair<'_>, pose: &Isometry3<f64>, tolerance: f64, most: usize) -> f64 {
        let of = |open: &[(Sample, f64)], other: &Body, pose: &Isometry3<f64>| {
            let some = &open[..most.min(open.len())];
            let more = some.iter().map(|(s, before)| (value(&other.place_of(s, pose, tolerance)) - before).max(0.0));
            more.sum::<f64>() / some.len().max(1) as f64 * open.len() as f64
        };
        of(&self.first, pair.second, pose) + of(&self.second, pair.first, &pose.inverse())
    }

    fn some(&self, most: usize) -> [Vec<Sample>; 2] {
        [&self.first, &self.second].map(|open| open.iter().take(most).map(|(sample, _)| *sample).collect())
    }
}

/// Poses of the second state from the first by what they explain of the open points, the best first and no two alike; once the end was
/// asked for, fewer.
pub(super) fn poses(pair: &Pair<'_>, open: &Open, also: &[Isometry3<f64>], most: usize) -> Vec<(f64, Isometry3<f64>)> {
    let size = pair.size();
    let mut candidates: Vec<(f64, Isometry3<f64>)> = rotations()
        .into_par_iter()
        .chain(also.iter().map(|pose| pose.rotation).collect::<Vec<_>>())
        .filter(|_| !ending::asked())
        .flat_map_iter(|rotation| translations(pair, open, rotation))
        .chain(also.to_vec())
        .map(|pose| (open.gain(pair, &pose, 0.03 * size, VOTERS[0]), pose))
        .collect();
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    candidates.truncate(FITTED);
    candidates.extend(also.iter().map(|pose| (0.0, *pose)));
    let [first, second] = open.some(POINTS);
    let points = Points { first: &first, second: &second };
    let mut fitted: Vec<(f64, Isometry3<f64>)> = candidates
        .into_par_iter()
        .filter(|_| !ending::asked())
        .map(|(_, pose)| {
            let mut motion = Motion::Pose(pose);
            for tolerance in TOLERANCES {
                motion = pair.fitted(motion, &points, tolerance * size, STEPS_PER_TOLERANCE);
            }
            let pose = motion.poses()[0];
            (open.gain(pair, &pose, TOLERANCES[2] * size, usize::MAX), pose)
        })
        .collect();
    fitted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut distinct: Vec<(f64, Isometry3<f64>)> = Vec::new();
    for (gain, pose) in fitted {
        if distinct.len() < most && distinct.iter().all(|(_, other)| apart(pair.first, &pose, other) > SAME_POSE * size)
        {
            distinct.push((gain, pose));
        }
    }
    distinct
}

/// How far two poses carry a body's points apart, at most [m].
pub(super) fn apart(body: &Body, one: &Isometry3<f64>, other: &Isometry3<f64>) -> f64 {
    let (low, high) = body.mesh.bounds();
    let corner = |i: usize| {
        nalgebra::Point3::from(Vector3::from_fn(|axis, _| if i >> axis & 1 == 0 { low[axis] } else { high[axis] }))
    };
    (0..8).map(|i| (one * corner(i) - other * corner(i)).norm()).fold(0.0, f64::max)
}

/// Rotations spread evenly, the identity first.
fn rotations() -> Vec<UnitQuaternion<f64>> {
    const FIRST: f64 = std::f64::consts::SQRT_2;
    const SECOND: f64 = 1.533_751_168_755_204_3;
    let spread = (0..ROTATIONS).map(|i| {
        let at = i as f64 + 0.5;
        let share = at / ROTATIONS as f64;
        let turn = std::f64::consts::TAU * at;
        let ((sin, cos), (far_sin, far_cos)) = ((turn / FIRST).sin_cos(), (turn / SECOND).sin_cos());
        let (near, far) = (share.sqrt(), (1.0 - share).sqrt());
        UnitQuaternion::new_normalize(Quaternion::new(far * far_cos, near * sin, near * cos, far * far_sin))
    });
    std::iter::once(UnitQuaternion::identity()).chain(spread).collect()
}

/// The translations that most pairs of points ask for.
fn translations(pair: &Pair<'_>, open: &Open, rotation: UnitQuaternion<f64>) -> Vec<Isometry3<f64>> {
    let cell = SPAN * pair.size() / CELLS as f64;
    let about = pair.second.middle - rotation * pair.first.middle;
    let mut votes = vec![0u16; CELLS * CELLS * CELLS];
    let mut touched = Vec::new();
    for (from, _) in open.first.iter().take(VOTERS[0]) {
        let (turned, normal) = (rotation * from.point, rotation * from.normal);
        for (to, _) in open.second.iter().take(VOTERS[1]) {
            if to.normal.dot(&normal) < PARALLEL {
                continue;
            }
            let at = ((to.point - turned) - about) / cell + Vector3::repeat(0.5 * CELLS as f64);
            if at.iter().all(|v| (0.0..CELLS as f64).contains(v)) {
                let [x, y, z] = [0, 1, 2].map(|axis| at[axis] as usize);
                let index = (z * CELLS + y) * CELLS + x;
                if votes[index] == 0 {
                    touched.push(index);
                }
                votes[index] += 1;
            }
        }
    }
    let place = |index: usize| [index % CELLS, index / CELLS % CELLS, index / (CELLS * CELLS)];
    let mut peaks: Vec<usize> = Vec::new();
    for _ in 0..PEAKS {
        let beside = |index: &usize, other: &usize| {
            let (a, b) = (place(*index), place(*other));
            (0..3).all(|axis| a[axis].abs_diff(b[axis]) <= 1)
        };
        let left = touched.iter().filter(|index| !peaks.iter().any(|peak| beside(index, peak)));
        peaks.extend(left.max_by_key(|index| (votes[**index], **index)).copied());
    }
    let pose = |index: usize| {
        let middle = Vector3::from(place(index).map(|v| v as f64 + 0.5 - 0.5 * CELLS as f64)) * cell;
        Isometry3::from_parts(Translation3::from(about + middle), rotation)
    };
    peaks.into_iter().map(pose).collect()
}
