//! Least squares over rows of clips, clips being the units: each row has white noise, and all rows of a clip share an error of their own.
//! Both are estimated from what is left; rows far out count less (Huber).

use crate::statistics::robust_sigma;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Standard deviations from which on a row counts less (Huber's constant, rounded up).
const HUBER: f64 = 2.0;
/// Noise, shared error and weights are found in turn, so often (a choice: they no longer change).
const PASSES: usize = 10;

/// A row: what was measured, and what it is regressed on.
pub(super) struct Sample {
    pub(super) clip: usize,
    pub(super) regressors: Vec<f64>,
    pub(super) measured: f64,
}

/// What was found.
pub(super) struct Regression {
    pub(super) values: Vec<f64>,
    /// One standard error each.
    pub(super) errors: Vec<f64>,
    /// Error that the rows of a clip share, one sigma, unit of what was measured.
    pub(super) shared: f64,
    residuals: Vec<f64>,
    weights: Vec<f64>,
    clips: usize,
}

/// Equations of a pass.
struct Equations {
    information: DMatrix<f64>,
    score: DVector<f64>,
}

/// Regresses samples that lie clip by clip. `scale`: one sigma of what each number may be before anything is measured; those beyond `free`
/// are known so well that they cost no degree of freedom. `least_shared`: the least error that rows of a clip share. `None` of samples
/// that say nothing.
pub(super) fn regress(samples: &[Sample], scale: &[f64], free: usize, least_shared: f64) -> Option<Regression> {
    let mut found = Regression {
        values: vec![0.0; scale.len()],
        errors: Vec::new(),
        shared: 0.0,
        residuals: samples.iter().map(|sample| sample.measured).collect(),
        weights: vec![1.0; samples.len()],
        clips: rows(samples).count(),
    };
    let mut noise = robust_sigma(found.residuals.iter().copied())?.max(f64::MIN_POSITIVE);
    found.shared = least_shared;
    for _ in 0..PASSES {
        let Equations { information, score } = found.equations(samples, scale, noise);
        let factor = information.cholesky()?;
        found.values = factor.solve(&score).iter().copied().collect();
        found.errors = factor.inverse().diagonal().iter().map(|variance| variance.sqrt()).collect();
        found.residuals =
            samples.iter().map(|sample| sample.measured - dot(&sample.regressors, &found.values)).collect();
        noise = found.white(samples)?.max(f64::MIN_POSITIVE);
        let largest = HUBER * noise.hypot(found.shared);
        found.weights = found.residuals.iter().map(|residual| (largest / residual.abs()).min(1.0)).collect();
        found.shared = found.between(samples, noise, free).max(least_shared.powi(2)).sqrt();
    }
    Some(found)
}

/// Rows of each clip.
fn rows(samples: &[Sample]) -> impl Iterator<Item = Range<usize>> {
    samples.chunk_by(|a, b| a.clip == b.clip).scan(0, |end, of_clip| {
        let begin = *end;
        *end += of_clip.len();
        Some(begin..*end)
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Regression {
    /// How many clips it comes from.
    pub(super) fn clips(&self) -> usize {
        self.clips
    }

    /// Normal equations; the error that a clip's rows share is eliminated (Sherman & Morrison 1950).
    fn equations(&self, samples: &[Sample], scale: &[f64], noise: f64) -> Equations {
        let count = scale.len();
        let mut information = DMatrix::from_fn(count, count, |i, j| if i == j { scale[i].powi(-2) } else { 0.0 });
        let mut score = DVector::zeros(count);
        for rows in rows(samples) {
            let (mut along, mut measured, mut sum) = (DVector::zeros(count), 0.0, 0.0);
            for row in rows {
                let weight = self.weights[row] / noise.powi(2);
                let regressors = DVector::from_column_slice(&samples[row].regressors);
                information += weight * &regressors * regressors.transpose();
                score += weight * samples[row].measured * &regressors;
                measured += weight * samples[row].measured;
                sum += weight;
                along += weight * regressors;
            }
            let share = self.shared.powi(2) / (1.0 + self.shared.powi(2) * sum);
            information -= share * &along * along.transpose();
            score -= share * measured * along;
        }
        Equations { information, score }
    }

    /// White noise of the rows, one sigma: what they scatter by within clips.
    fn white(&self, samples: &[Sample]) -> Option<f64> {
        let within = rows(samples).flat_map(|rows| {
            let middle = crate::statistics::median(rows.clone().map(|row| self.residuals[row])).unwrap_or_default();
            rows.map(move |row| self.residuals[row] - middle).collect::<Vec<_>>()
        });
        robust_sigma(within)
    }

    /// Variance of the error that the rows of a clip share.
    fn between(&self, samples: &[Sample], noise: f64, free: usize) -> f64 {
        let beyond = rows(samples).map(|rows| {
            let count = rows.len() as f64;
            let mean = rows.map(|row| self.residuals[row]).sum::<f64>() / count;
            mean.powi(2) - noise.powi(2) / count
        });
        beyond.sum::<f64>() / self.clips.saturating_sub(free).max(1) as f64
    }

    /// For each clip the mean of regressor `k`, and of what is left.
    pub(super) fn by_clip(&self, samples: &[Sample], k: usize) -> Vec<[f64; 2]> {
        let mean = |rows: Range<usize>, of: &dyn Fn(usize) -> f64| {
            let sum: f64 = rows.clone().map(|row| self.weights[row]).sum();
            rows.map(|row| self.weights[row] * of(row)).sum::<f64>() / sum
        };
        let of = |rows: Range<usize>| {
            [mean(rows.clone(), &|row| samples[row].regressors[k]), mean(rows, &|row| self.residuals[row])]
        };
        rows(samples).map(of).collect()
    }
}
