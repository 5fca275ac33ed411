//! Least squares of surfaces onto each other, both ways: each point of one state is carried to the other, whose signed distance there
//! is the residual (registration by distance fields, Fitzgibbon 2003), weighted by Tukey's biweight.

use super::body::{Body, Place, Sample};
use super::motion::Motion;
use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector3};

/// Steps of a derivative, of the object's size.
const STEP: f64 = 1e-5;
/// Damping, of the matrix' largest diagonal element.
const DAMPING: f64 = 1e-7;
/// Points of which neighbours share their error: so many of them count as one.
const TOGETHER: f64 = 8.0;

/// Points of both states that take part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points<'a> {
    pub(super) first: &'a [Sample],
    pub(super) second: &'a [Sample],
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Pair<'a> {
    pub(super) first: &'a Body,
    pub(super) second: &'a Body,
}

/// Normal equations of a motion.
struct Equations {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

/// The poses of a motion, and those with each number changed a little.
struct Poses {
    now: [Isometry3<f64>; 2],
    changed: Vec<[Isometry3<f64>; 2]>,
}

impl<'a> Pair<'a> {
    pub(super) fn size(&self) -> f64 {
        self.first.size.max(self.second.size)
    }

    pub(super) fn points(&self, most: usize) -> Points<'a> {
        let of = |body: &'a Body| &body.samples[..most.min(body.samples.len())];
        Points { first: of(self.first), second: of(self.second) }
    }

    /// So many Gauss-Newton steps; points further away than the tolerance [m] take no part.
    pub(super) fn fitted(&self, motion: Motion, points: &Points<'_>, tolerance: f64, steps: usize) -> Motion {
        let mut motion = motion;
        for _ in 0..steps {
            let Equations { mut matrix, right } = self.equations(&motion, points, tolerance);
            let damping = DAMPING * matrix.diagonal().max() + 1e-12;
            (0..right.len()).for_each(|i| matrix[(i, i)] += damping);
            let Some(solved) = matrix.cholesky() else { break };
            let change = solved.solve(&right);
            let largest = change.amax();
            // No step is larger than the reach of the surface.
            let share = (2.0 * tolerance / largest.max(1e-12)).min(1.0);
            for (number, by) in change.iter().enumerate() {
                motion = motion.changed(number, by * share, &self.second.middle, 0.5 * self.size());
            }
            if largest < 1e-3 * tolerance {
                break;
            }
        }
        motion
    }

    /// Standard deviations' matrix of the motion's numbers [m²] under noise of `sigma` [m].
    pub(super) fn covariance(&self, motion: &Motion, points: &Points<'_>, tolerance: f64, sigma: f64) -> DMatrix<f64> {
        let mut matrix = self.equations(motion, points, tolerance).matrix;
        let damping = DAMPING * matrix.diagonal().max() + 1e-12;
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] += damping);
        let count = matrix.nrows();
        matrix.try_inverse().unwrap_or_else(|| DMatrix::identity(count, count)) * (sigma * sigma * TOGETHER)
    }

    fn equations(&self, motion: &Motion, points: &Points<'_>, tolerance: f64) -> Equations {
        let (count, step) = (motion.freedoms(), STEP * self.size());
        let changed = (0..count).map(|i| motion.changed(i, step, &self.second.middle, 0.5 * self.size()).poses());
        let forwards = Poses { now: motion.poses(), changed: changed.collect() };
        let inverted = |poses: [Isometry3<f64>; 2]| poses.map(|pose| pose.inverse());
        let backwards =
            Poses { now: inverted(forwards.now), changed: forwards.changed.iter().copied().map(inverted).collect() };
        let mut equations = Equations { matrix: DMatrix::zeros(count, count), right: DVector::zeros(count) };
        for (samples, other, poses) in [(points.first, self.second, &forwards), (points.second, self.first, &backwards)]
        {
            for sample in samples {
                equations.add(sample, other, poses, tolerance, step);
            }
        }
        equations
    }
}

/// The pose under which a point is on the other state's surface; of two the nearer one, unless it is
/// known whether the point moves.
pub(super) fn carried(
    sample: &Sample,
    other: &Body,
    poses: &[Isometry3<f64>; 2],
    tolerance: f64,
) -> Option<(usize, f64, Vector3<f64>)> {
    let on = |which: usize| match other.place_of(sample, &poses[which], tolerance) {
        Place::On(distance, slope) => Some((which, distance, slope)),
        Place::Hidden | Place::Free => None,
    };
    if let Some(moves) = sample.moves {
        return on(usize::from(moves));
    }
    match (on(0), on(1)) {
        (Some(whole), Some(part)) => Some(if part.1.abs() < whole.1.abs() { part } else { whole }),
        (whole, part) => whole.or(part),
    }
}

impl Equations {
    fn add(&mut self, sample: &Sample, other: &Body, poses: &Poses, tolerance: f64, step: f64) {
        let Some((which, distance, slope)) = carried(sample, other, &poses.now, tolerance) else { return };
        let weight = (1.0 - (distance / tolerance).powi(2)).powi(2);
        let now: Point3<f64> = poses.now[which] * sample.point;
        let mut row = [0.0; 11];
        for (value, changed) in row.iter_mut().zip(&poses.changed) {
            *value = slope.dot(&(changed[which] * sample.point - now)) / step;
        }
        let row = &row[..poses.changed.len()];
        for i in 0..row.len() {
            self.right[i] -= weight * row[i] * distance;
            for j in 0..row.len() {
                self.matrix[(i, j)] += weight * row[i] * row[j];
            }
        }
    }
}
