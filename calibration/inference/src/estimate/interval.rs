//! How sure the shared parameters are, in a way that residuals which depend on each other do not fool.
//!
//! The information of a fit is right where residuals are independent and as large as their sigmas. They are neither: a
//! model that is a little wrong leaves residuals that last. So the scores of whole stretches of clips are taken as
//! witnesses (a sandwich, Liang & Zeger 1986) with the correction and Student's t for their number, and of the two the
//! wider interval counts.

use super::least_squares::Fit;
use super::problem::Unknown;
use super::quadratic::minimum;
use crate::statistics;
use nalgebra::{DMatrix, DVector};

/// The rule of all intervals: half of that at `level` is the wider of two, by the curvature of the likelihood, right where residuals
/// are independent and as large as their sigmas, and by how far witnesses scatter, with Student's t for their number. Both one sigma.
pub fn half_width(level: f64, curvature: f64, scatter: f64, witnesses: usize) -> f64 {
    let by_witnesses = statistics::student(level, witnesses.saturating_sub(1)) * scatter;
    (statistics::normal(level) * curvature).max(by_witnesses)
}

/// How sure a fit is about its shared parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Intervals {
    /// Half the interval of each number; infinite where the clips say nothing about it.
    pub half_width: Vec<f64>,
    /// Correlation of the estimates, `P x P`; zero in rows of numbers that the clips say nothing about.
    pub correlation: DMatrix<f64>,
    /// One sigma of each number if residuals were independent and as large as their sigmas.
    pub model_sigma: Vec<f64>,
    /// One sigma of each number by the scatter of the witnesses' scores.
    pub witness_sigma: Vec<f64>,
    /// Number of witnesses.
    pub witnesses: usize,
}

/// Below this share of its own information a number is what the others make of it.
const MIN_EIGENVALUE: f64 = 1e-10;
/// Level of the intervals of identified parameters [1].
pub const LEVEL: f64 = 0.95;

impl Intervals {
    /// At the fit's numbers, of a level. Those in `held` were not free: they rest on a bound, or nothing depends on them.
    pub fn new(fit: &Fit, held: &[bool], level: f64) -> Self {
        let n = fit.shared.len();
        let information = fit.information();
        let free: Vec<usize> = (0..n).filter(|k| !held[*k] && information[(*k, *k)] > 0.0).collect();
        let inverse = spread(&inverse(&information, &free), &free, n);
        let scores: Vec<&DVector<f64>> = fit.clips.iter().flat_map(|clip| &clip.scores).collect();
        let middle = scores.iter().fold(DMatrix::zeros(n, n), |sum, score| sum + *score * score.transpose());
        let witnesses = scores.len();
        let correction = witnesses as f64 / (witnesses.max(2) - 1) as f64;
        let sandwich = &inverse * middle * &inverse * correction;
        let known = |k: usize| inverse[(k, k)] > 0.0;
        let sigma = |m: &DMatrix<f64>| (0..n).map(|k| m[(k, k)].max(0.0).sqrt()).collect::<Vec<_>>();
        let (model_sigma, witness_sigma) = (sigma(&inverse), sigma(&sandwich));
        let half = |k: usize| half_width(level, model_sigma[k], witness_sigma[k], witnesses);
        let half_width = (0..n).map(|k| if known(k) { half(k) } else { f64::INFINITY }).collect();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            if known(i) && known(j) { inverse[(i, j)] / (model_sigma[i] * model_sigma[j]) } else { 0.0 }
        });
        Self { half_width, correlation, model_sigma, witness_sigma, witnesses }
    }

    /// Half the intervals if clips that add `more` information were recorded besides.
    pub fn with_more(&self, fit: &Fit, more: &DMatrix<f64>) -> Vec<f64> {
        let n = self.half_width.len();
        let free: Vec<usize> = (0..n).filter(|k| self.half_width[*k].is_finite()).collect();
        let after = spread(&inverse(&(fit.information() + more), &free), &free, n);
        (0..n)
            .map(|k| {
                if self.model_sigma[k] > 0.0 {
                    self.half_width[k] * (after[(k, k)].max(0.0).sqrt() / self.model_sigma[k]).min(1.0)
                } else {
                    f64::INFINITY
                }
            })
            .collect()
    }
}

/// How far a fit's parameters scatter, by the quadratic forms of its clips over (1, parameters): witnesses are whole clips, and their
/// scatter is how the parameters move when each is left out (jackknife, Tukey 1958).
pub struct Jackknife {
    /// By the curvature, `P x P`; zero where that has no inverse.
    covariance: DMatrix<f64>,
    /// How the parameters move without each clip.
    shifts: Vec<Vec<f64>>,
}

impl Jackknife {
    /// Of clips whose forms add up to `total`, what is known besides added.
    pub fn new<'a>(total: &DMatrix<f64>, clips: impl Iterator<Item = &'a DMatrix<f64>>) -> Self {
        let n = total.ncols() - 1;
        // Parameters of many sizes: scaled, so that rounding makes none of them uncertain.
        let scale = DVector::from_fn(n, |k, _| total[(k + 1, k + 1)].max(f64::MIN_POSITIVE).sqrt().recip());
        let by = |i: usize, k: usize| scale[i] * scale[k];
        let scaled = DMatrix::from_fn(n, n, |i, k| total[(i + 1, k + 1)] * by(i, k)).cholesky();
        let inverse = scaled.map_or_else(|| DMatrix::zeros(n, n), |factor| factor.inverse());
        let all: Vec<usize> = (1..=n).collect();
        Self {
            covariance: DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] * by(i, k)),
            shifts: clips.map(|clip| minimum(&(total - clip), &all).at).collect(),
        }
    }

    /// Half the interval, at `level`, of a sum of parameters, each times a factor.
    pub fn half_width(&self, sum: &[(usize, f64)], level: f64) -> f64 {
        let square = |(i, a): &(usize, f64)| sum.iter().map(|(j, b)| a * b * self.covariance[(*i, *j)]).sum::<f64>();
        let curvature = sum.iter().map(square).sum::<f64>().max(0.0).sqrt();
        let clips = self.shifts.len() as f64;
        let moved = |shift: &Vec<f64>| sum.iter().map(|(k, factor)| factor * shift[*k]).sum::<f64>();
        let moved: Vec<f64> = self.shifts.iter().map(moved).collect();
        let mean = moved.iter().sum::<f64>() / clips;
        let squares: f64 = moved.iter().map(|moved| (moved - mean).powi(2)).sum();
        half_width(level, curvature, (squares * (clips - 1.0) / clips).sqrt(), moved.len())
    }
}

/// How far the numbers move, to first order, when the slope at the fit changes by `slope`. Those in `held` stay.
pub fn moved_by(fit: &Fit, held: &[bool], slope: &DVector<f64>) -> DVector<f64> {
    let (n, information) = (fit.shared.len(), fit.information());
    let free: Vec<usize> = (0..n).filter(|k| !held[*k] && information[(*k, *k)] > 0.0).collect();
    -spread(&inverse(&information, &free), &free, n) * slope
}

/// Which numbers rest on a bound of their search.
pub fn at_bounds(unknowns: &[Unknown], shared: &[f64]) -> Vec<bool> {
    let near = |u: &Unknown, value: f64| {
        let tolerance = 1e-6 * (u.upper - u.lower);
        value - u.lower <= tolerance || u.upper - value <= tolerance
    };
    unknowns.iter().zip(shared).map(|(unknown, value)| near(unknown, *value)).collect()
}

/// Inverse of the free part of the information, scaled; directions that rounding owns are left out of the inverse of
/// their numbers, which then have variance 0 and count as not known.
fn inverse(information: &DMatrix<f64>, free: &[usize]) -> DMatrix<f64> {
    let n = free.len();
    if n == 0 {
        // Where the clips tell nothing, there is no number whose variance could be given.
        return DMatrix::zeros(0, 0);
    }
    let scale: Vec<f64> = free.iter().map(|k| information[(*k, *k)].sqrt()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| information[(free[i], free[j])] / (scale[i] * scale[j]));
    // The search for eigenvalues of what is not finite has no end.
    if !scaled.iter().all(|value| value.is_finite()) {
        return DMatrix::zeros(n, n);
    }
    let eigen = scaled.symmetric_eigen();
    let lost: Vec<bool> = (0..n)
        .map(|i| (0..n).any(|e| eigen.eigenvalues[e] < MIN_EIGENVALUE && eigen.eigenvectors[(i, e)].abs() > 0.1))
        .collect();
    DMatrix::from_fn(n, n, |i, j| {
        if lost[i] || lost[j] {
            return 0.0;
        }
        let parts = (0..n).filter(|e| eigen.eigenvalues[*e] >= MIN_EIGENVALUE);
        let sum: f64 =
            parts.map(|e| eigen.eigenvectors[(i, e)] * eigen.eigenvectors[(j, e)] / eigen.eigenvalues[e]).sum();
        sum / (scale[i] * scale[j])
    })
}

fn spread(part: &DMatrix<f64>, free: &[usize], n: usize) -> DMatrix<f64> {
    let mut whole = DMatrix::zeros(n, n);
    for (i, row) in free.iter().enumerate() {
        for (j, column) in free.iter().enumerate() {
            whole[(*row, *column)] = part[(i, j)];
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::super::{ClipModel, Impossible, Schedule, fit};
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_distr::StandardNormal;

    /// Straight lines through noise that lasts for `lasting` rows; every stretch of 20 rows is a witness.
    struct Line {
        noise: Vec<f64>,
    }

    const CLIPS: usize = 4;
    const ROWS: usize = 200;

    impl Line {
        fn new(seed: u64, lasting: usize) -> Self {
            let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
            let drawn: Vec<f64> = (0..CLIPS * ROWS / lasting).map(|_| random.sample(StandardNormal)).collect();
            Self { noise: (0..CLIPS * ROWS).map(|i| drawn[i / lasting]).collect() }
        }
    }

    impl ClipModel for Line {
        fn clips(&self) -> usize {
            CLIPS
        }

        fn residuals(&self, clip: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            out.clear();
            let row = |i: usize| self.noise[clip * ROWS + i] - shared[0] - shared[1] * (i as f64 / ROWS as f64 - 0.5);
            out.extend((0..ROWS).map(row));
            Ok(())
        }

        fn stretches(&self, _: usize) -> Vec<usize> {
            (1..=ROWS / 20).map(|i| i * 20).collect()
        }
    }

    fn covered(lasting: usize) -> f64 {
        let unknown = |name: &str| Unknown { name: name.into(), start: 0.0, lower: -10.0, upper: 10.0, step: 1e-4 };
        let unknowns = [unknown("a"), unknown("b")];
        let inside = |seed| {
            let fit = fit(&Line::new(seed, lasting), &unknowns, &[], &Schedule::default(), |_, _| true);
            let fit = fit.expect("an answer");
            let intervals = Intervals::new(&fit, &[false; 2], LEVEL);
            (0..2).filter(|k| fit.shared[*k].abs() < intervals.half_width[*k]).count() as f64
        };
        (0..200).map(inside).sum::<f64>() / 400.0
    }

    #[test]
    fn where_nothing_can_be_told_there_is_no_inverse_and_no_panic() {
        assert!(inverse(&DMatrix::zeros(3, 3), &[]).is_empty());
    }

    #[test]
    fn of_clips_that_each_tell_a_mean_the_jackknife_is_the_scatter_of_the_mean() {
        // (x - b)^2 of clips at x = 1, 2, 3, 6.
        let form = |x: f64| DMatrix::from_row_slice(2, 2, &[x * x, -x, -x, 1.0]);
        let forms = [1.0, 2.0, 3.0, 6.0].map(form);
        let total = forms.iter().fold(DMatrix::zeros(2, 2), |sum, form| sum + form);
        // Around the mean, where the slope of the sum vanishes.
        let moved = DMatrix::from_row_slice(2, 2, &[1.0, 3.0, 0.0, 1.0]);
        let around = |form: &DMatrix<f64>| &moved * form * moved.transpose();
        let forms = forms.each_ref().map(around);
        let jackknife = Jackknife::new(&around(&total), forms.iter());
        let variance = (4.0 + 1.0 + 0.0 + 9.0) / 3.0;
        let expected = statistics::student(LEVEL, 3) * f64::sqrt(variance / 4.0);
        let half = jackknife.half_width(&[(0, 1.0)], LEVEL);
        assert!((half / expected - 1.0).abs() < 1e-6, "{half} {expected}");
        assert!((jackknife.half_width(&[(0, 2.0)], LEVEL) / half - 2.0).abs() < 1e-12);
    }

    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say_whether_noise_lasts_or_not() {
        for lasting in [1, 10] {
            let share = covered(lasting);
            assert!((0.92..0.995).contains(&share), "noise that lasts {lasting} rows: {share}");
        }
    }
}
