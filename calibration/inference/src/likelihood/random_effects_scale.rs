//! How widely clips scatter under one hypothesis: the empirical-Bayes scale of its random effects.
//!
//! Clips may deviate as far as those of another engine do from a twin that is given everything ([`RandomEffects`]). Where they
//! deviate less under one hypothesis than under another, that speaks for it: the scale of the scatter is set to what makes
//! the clips most likely (empirical Bayes), for every hypothesis by itself. Nuisance parameters act linearly, so another scale
//! costs no simulation.

use super::random_effects::RandomEffects;
use crate::kept::numbers;
use nalgebra::{Cholesky, DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Least scale that is tried [1], a choice: nothing real scatters less than an eighth of the usual.
pub const MIN_SCALE: f64 = 0.125;
/// Scales of the usual scatter that are tried [1].
const SCALES: [f64; 4] = [1.0, 0.5, 0.25, MIN_SCALE];
/// Steps in which a clip finds its nuisance parameters at another scale [1]; every one takes the hold of the last.
const REWEIGHTED_STEPS: usize = 12;

/// A clip around its nuisance parameters.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Around {
    /// Products of (residual, nuisance parameters), weighted.
    #[serde(with = "numbers")]
    pub gram: DMatrix<f64>,
    /// Their values there.
    pub own: Vec<f64>,
}

/// What every clip's deviance changes by at the scale at which all of them together are most likely; nothing where no
/// number has heavy tails.
pub fn at_the_best_scale(clips: &[&Around], scatter: &RandomEffects) -> Vec<f64> {
    if scatter.heavy.is_empty() {
        return vec![0.0; clips.len()];
    }
    let usual: Vec<f64> = clips.iter().map(|clip| deviance(clip, scatter)).collect();
    let changes = |scale: &f64| -> Vec<f64> {
        let scatter = scatter.scaled(*scale);
        clips.iter().zip(&usual).map(|(clip, usual)| deviance(clip, &scatter) - usual).collect()
    };
    let best = SCALES.iter().map(changes).min_by(|a, b| a.iter().sum::<f64>().total_cmp(&b.iter().sum()));
    best.unwrap_or_default()
}

/// `-2 ln` of a clip's likelihood with its nuisance parameters at their best and integrated over.
fn deviance(clip: &Around, scatter: &RandomEffects) -> f64 {
    let n = clip.own.len();
    let (inner, cross) = (clip.gram.view((1, 1), (n, n)).into_owned(), clip.gram.view((1, 0), (n, 1)).into_owned());
    let cross = cross.column(0).into_owned();
    let mut own = DVector::from_column_slice(&clip.own);
    let held = |own: &DVector<f64>| DVector::from_vec(scatter.precision(own.as_slice()));
    let solved = |precision: &DVector<f64>| Cholesky::new(&inner + DMatrix::from_diagonal(precision));
    let start = own.clone();
    for _ in 0..REWEIGHTED_STEPS {
        let precision = held(&own);
        let Some(factor) = solved(&precision) else { return f64::INFINITY };
        // Minimum of |r + B (u - start)|^2 + u' P u.
        own = factor.solve(&(&inner * &start - &cross));
    }
    let precision = held(&own);
    let Some(factor) = solved(&precision) else { return f64::INFINITY };
    let moved = &own - &start;
    let misfit = clip.gram[(0, 0)] + 2.0 * cross.dot(&moved) + moved.dot(&(&inner * &moved));
    let pull = precision.component_mul(&own).dot(&own);
    let volume = factor.ln_determinant() - precision.iter().map(|p| p.ln()).sum::<f64>();
    misfit + pull + volume + scatter.correction(own.as_slice())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Random;

    /// Clips with one random effect, each seen a hundred times with a noise of one sigma.
    fn clips(deviations: &[f64]) -> Vec<Around> {
        let gram = |deviation: f64| {
            DMatrix::from_row_slice(2, 2, &[100.0 * deviation * deviation, 100.0 * deviation, 100.0 * deviation, 100.0])
        };
        deviations.iter().map(|deviation| Around { gram: gram(*deviation), own: vec![0.0] }).collect()
    }

    fn scatter(heavy: std::ops::Range<usize>) -> RandomEffects {
        let random = vec![Random { name: "deviation".into(), sigma: 4.0, step: 4.0 }];
        RandomEffects { random, heavy, forgiving: 1.0 }
    }

    fn changes(deviations: &[f64], heavy: std::ops::Range<usize>) -> f64 {
        let scatter = scatter(heavy);
        let clips = clips(deviations);
        at_the_best_scale(&clips.iter().collect::<Vec<_>>(), &scatter).iter().sum()
    }

    #[test]
    fn clips_that_deviate_little_become_likelier_and_those_that_deviate_as_usual_stay_as_they_are() {
        let usual = [4.0, -5.0, 3.0, -3.5, 6.0, -4.0, 2.0, 5.0];
        assert_eq!(changes(&usual, 0..1), 0.0);
        let little = usual.map(|deviation| 0.1 * deviation);
        // Of eight numbers held to a quarter or an eighth, each becomes likelier by at most the logarithm of that, twice.
        let gain = -changes(&little, 0..1);
        assert!((0.5..1.0).contains(&(gain / (8.0 * 2.0 * 8_f64.ln()))), "{gain}");
        assert_eq!(changes(&little, 0..0), 0.0, "what has no heavy tails is known");
    }

    #[test]
    fn a_clip_at_its_best_is_found_from_wherever_it_was_left() {
        let scatter = scatter(0..1);
        let at = |own: f64| {
            // The residual of a deviation of 3 that `own` takes off already.
            let left = 3.0 + own;
            let gram = DMatrix::from_row_slice(2, 2, &[100.0 * left * left, 100.0 * left, 100.0 * left, 100.0]);
            deviance(&Around { gram, own: vec![own] }, &scatter)
        };
        assert!((at(0.0) - at(-2.5)).abs() < 1e-6);
    }
}
