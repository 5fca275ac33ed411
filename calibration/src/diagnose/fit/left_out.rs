//! The numbers that a hypothesis has without some of its clips: one Newton step away from the fit to all of them. The
//! linearisation around that fit knows them, so no simulation is needed.

use super::bench::{Bench, Hypothesis};
use inference::estimate::quadratic::minimum;
use nalgebra::DMatrix;

/// How far the free numbers move to the minimum of a form over (residual, free numbers), within their bounds.
pub(in crate::diagnose) fn shift_to(bench: &Bench<'_>, hypothesis: &Hypothesis, form: &DMatrix<f64>) -> Vec<f64> {
    let all: Vec<usize> = (1..=hypothesis.free.len()).collect();
    let within = |(index, shift): (&usize, &f64)| {
        let (value, unknown) = (hypothesis.full[*index], &bench.library.unknowns[*index]);
        (value + shift).clamp(unknown.lower, unknown.upper) - value
    };
    hypothesis.free.iter().zip(&minimum(form, &all).at).map(within).collect()
}

/// All numbers without the clips `out`.
pub(in crate::diagnose) fn numbers_without(bench: &Bench<'_>, hypothesis: &Hypothesis, out: &[usize]) -> Vec<f64> {
    let left_out = hypothesis.fitted.iter().filter(|clip| out.contains(&clip.clip));
    let rest = left_out.fold(bench.held(hypothesis), |sum, clip| sum - &clip.reduced.form);
    let mut full = hypothesis.full.clone();
    hypothesis.free.iter().zip(shift_to(bench, hypothesis, &rest)).for_each(|(k, shift)| full[*k] += shift);
    full
}
