//! The search where another program simulates strokes: around the baseline, with the twin's differences; what was found is fitted to the
//! program's own roll-outs afterwards.

use super::combine;
use super::refit::last_pass;
use crate::diagnose::clips::split::Split;
use crate::diagnose::evidence::anchored::Anchored;
use crate::diagnose::evidence::measured::Evidence;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::stages;
use crate::diagnose::judge::trial::Found;
use shared_mem::progress::Progress;

/// [`combine::search`]; the same where no other program simulates strokes.
pub fn search<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    baseline: Hypothesis,
    refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
    bar: &Progress,
) -> Option<Found> {
    if bench.evidence.engine().is_none() {
        return combine::search(bench, split, baseline, refined, bar);
    }
    let around = Anchored::new(bench.evidence, &baseline.full);
    let mut found = combine::search(&around.bench(bench), split, baseline, refined, bar)?;
    bar.stage(stages::REFINEMENT, 1);
    let by_engine = |fit: &Hypothesis, weights: &[f64]| {
        let numbers = (&fit.effects[..], fit.full.clone());
        bench.fit(numbers, &split.train, weights, Some(fit), last_pass(bench)).unwrap_or_else(|| fit.clone())
    };
    let last_weights = found.steps.last()?.weights.clone();
    let first = found.steps.first_mut()?;
    first.from = by_engine(&first.from, &first.weights);
    found.last = if found.last.effects.is_empty() { first.from.clone() } else { by_engine(&found.last, &last_weights) };
    Some(found)
}
