//! What a search around points of another program found, fitted to that program's own roll-outs.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::FIRST_PASS;
use crate::diagnose::judge::trial::Found;
use inference::admit::Split;
use inference::likelihood::Evidence;

/// A hypothesis at its best by the engine; as it is where the twin simulates, the engine has no answer, or no time is left.
pub(super) fn by_engine<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    fit: Hypothesis,
    weights: &[f64],
) -> Hypothesis {
    if bench.evidence.engine().is_none() || bench.interrupt.asked() {
        return fit;
    }
    let numbers = (&fit.effects[..], fit.full.clone());
    bench.fit(numbers, &split.train, weights, Some(&fit), FIRST_PASS).unwrap_or(fit)
}

impl Found {
    /// The same with baseline and result at their best by the engine. The baseline is fitted once more from where the result ended: a
    /// likelihood ratio compares two maxima, and fits over rough hits end in many.
    pub(super) fn by_engine<E: Evidence>(mut self, bench: &Bench<'_, E>, split: &Split) -> Self {
        if bench.evidence.engine().is_none() || bench.interrupt.asked() {
            return self;
        }
        let Some(last_weights) = self.steps.last().map(|step| step.weights.clone()) else { return self };
        let first = &mut self.steps[0];
        let from = by_engine(bench, split, first.from.clone(), &first.weights);
        if self.last.effects == first.from.effects {
            (first.from, self.last) = (from.clone(), from);
            return self;
        }
        self.last = by_engine(bench, split, self.last, &last_weights);
        let mut full = self.last.full.clone();
        for k in self.last.effects.iter().flat_map(|effect| bench.library.candidates[*effect].numbers.clone()) {
            full[k] = from.full[k];
        }
        let other = bench.fit((&from.effects, full), &split.train, &first.weights, Some(&self.last), FIRST_PASS);
        first.from = other.filter(|other| other.deviance() < from.deviance()).unwrap_or(from);
        self
    }
}
