//! One clip around one point: residuals, their slopes by differences, and what is left once the clip's nuisance parameters are
//! eliminated
//! ([`super::eliminate`]).

use super::eliminate::Eliminated;
use super::problem::{ClipModel, Impossible, Random, Unknown};
use crate::kept::numbers;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A clip, linearised. `P` shared parameters, `Q` nuisance parameters.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ClipFit {
    /// Number of residuals.
    pub rows: usize,
    /// Sum of squared residuals.
    pub chi2: f64,
    /// The clip's nuisance parameters there, `Q`.
    pub own: Vec<f64>,
    /// Their covariance given the shared ones, `Q x Q`.
    #[serde(with = "numbers")]
    pub own_covariance: DMatrix<f64>,
    /// `-2 ln` of the clip's likelihood with the nuisance parameters integrated out, without the constant of the noise.
    pub deviance: f64,
    /// Half the slope of [`Self::deviance`] by the shared parameters, `P` (the volume term taken as constant).
    #[serde(with = "numbers")]
    pub gradient: DVector<f64>,
    /// Information on the shared parameters, `P x P`.
    #[serde(with = "numbers")]
    pub information: DMatrix<f64>,
    /// What each stretch of the clip adds to [`Self::gradient`]; a single one where the model tells no stretches.
    #[serde(with = "numbers")]
    pub scores: Vec<DVector<f64>>,
    /// How the nuisance parameters answer to the shared ones and where they want to go: [`ClipFit::own_part_way`].
    #[serde(with = "numbers")]
    own_step: DVector<f64>,
    #[serde(with = "numbers")]
    own_answer: DMatrix<f64>,
}

impl ClipFit {
    /// Linearises a clip at (`shared`, `own`). Costs `1 + P + Q` evaluations, `Q` counting only random effects that scatter.
    ///
    /// # Errors
    /// [`Impossible`] when the model has no answer at the point itself, or one that is too large to be squared. A step without
    /// an answer is tried the other way,
    /// and then counts as one that changes nothing.
    pub fn at(
        model: &impl ClipModel,
        clip: usize,
        (unknowns, shared): (&[Unknown], &[f64]),
        (random, own): (&[Random], &[f64]),
    ) -> Result<Self, Impossible> {
        let mut base = Vec::new();
        model.residuals(clip, shared, own, &mut base)?;
        let a = slopes(&base, shared, unknowns.iter().map(|unknown| (unknown.step, unknown.upper)), |moved, out| {
            model.stepped(clip, (moved, own), ((shared, own), &base), out)
        });
        let steps = random.iter().map(|effect| (if effect.sigma > 0.0 { effect.step } else { 0.0 }, f64::INFINITY));
        let b =
            slopes(&base, own, steps, |moved, out| model.stepped(clip, (shared, moved), ((shared, own), &base), out));
        Self::eliminate(&DVector::from_vec(base), (&a, &b), (random, own), &model.stretches(clip))
    }

    fn eliminate(
        r: &DVector<f64>,
        (a, b): (&DMatrix<f64>, &DMatrix<f64>),
        (random, own): (&[Random], &[f64]),
        stretches: &[usize],
    ) -> Result<Self, Impossible> {
        let (shared, numbers) = (a.ncols(), own.len());
        let mut columns = DMatrix::zeros(r.len(), 1 + shared + numbers);
        columns.set_column(0, r);
        columns.columns_mut(1, shared).copy_from(a);
        columns.columns_mut(1 + shared, numbers).copy_from(b);
        let precision = |effect: &Random| if effect.sigma > 0.0 { effect.sigma.powi(-2) } else { 1.0 };
        let precision: Vec<f64> = random.iter().map(precision).collect();
        let left = Eliminated::of(&(columns.transpose() * &columns), &precision, own)?;
        let own_answer = left.follows().columns(1, shared).into_owned();
        let starts = std::iter::once(&0).chain(stretches);
        let all = r.len();
        let ends = stretches.iter().filter(|end| **end < all).chain(std::iter::once(&all));
        let score = |(start, end): (&usize, &usize)| {
            let (rows, first) = (end - start, *start);
            let r = r.rows(first, rows);
            a.rows(first, rows).tr_mul(&r) + own_answer.tr_mul(&b.rows(first, rows).tr_mul(&r))
        };
        let scores = starts.zip(ends).map(score).collect();
        let at_rest: f64 = precision.iter().zip(own).map(|(precision, u)| precision * u * u).sum();
        Ok(Self {
            rows: r.len(),
            chi2: r.norm_squared(),
            own: own.to_vec(),
            deviance: r.norm_squared() + at_rest + left.volume,
            gradient: left.form.view((1, 0), (shared, 1)).column(0).into_owned(),
            information: left.form.view((1, 1), (shared, shared)).into_owned(),
            scores,
            own_covariance: left.own_covariance(),
            own_step: left.own_change(&DVector::zeros(shared)),
            own_answer,
        })
    }

    /// Where the nuisance parameters want to go with the shared ones held.
    pub fn own_way(&self) -> &DVector<f64> {
        &self.own_step
    }

    /// The nuisance parameters `share` of the way to where a step `dx` of the shared ones brings them.
    pub fn own_part_way(&self, dx: &DVector<f64>, share: f64) -> Vec<f64> {
        let step = &self.own_step + &self.own_answer * dx;
        self.own.iter().zip(step.iter()).map(|(own, step)| own + share * step).collect()
    }
}

/// Slopes of the residuals by each number, from its step and its upper bound. A step of 0 has no slope.
fn slopes(
    base: &[f64],
    at: &[f64],
    steps: impl Iterator<Item = (f64, f64)>,
    evaluate: impl Fn(&[f64], &mut Vec<f64>) -> Result<(), Impossible> + Sync,
) -> DMatrix<f64> {
    let steps: Vec<(f64, f64)> = steps.collect();
    let mut slopes = DMatrix::zeros(base.len(), steps.len());
    if base.is_empty() {
        return slopes;
    }
    slopes.as_mut_slice().par_chunks_exact_mut(base.len()).enumerate().for_each(|(k, column)| {
        let (step, upper) = steps[k];
        let step = if upper - at[k] < step { -step } else { step };
        if step != 0.0 {
            slope(base, column, at, (k, step), &evaluate);
        }
    });
    slopes
}

/// Slope of the residuals by number `k`, by a step forward or, where that has no answer, backward.
fn slope(
    base: &[f64],
    column: &mut [f64],
    at: &[f64],
    (k, step): (usize, f64),
    evaluate: &impl Fn(&[f64], &mut Vec<f64>) -> Result<(), Impossible>,
) {
    let (mut out, mut moved) = (Vec::with_capacity(base.len()), at.to_vec());
    for step in [step, -step] {
        moved[k] = at[k] + step;
        // What rounding left of the step.
        let step = moved[k] - at[k];
        let finite = |out: &[f64]| out.iter().all(|residual| residual.is_finite());
        if evaluate(&moved, &mut out).is_ok() && out.len() == base.len() && finite(&out) {
            column.iter_mut().zip(&out).zip(base).for_each(|((slope, out), base)| *slope = (out - base) / step);
            return;
        }
    }
}
