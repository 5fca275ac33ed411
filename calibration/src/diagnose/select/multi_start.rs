//! One fit from several starts: a local solver finds the nearest minimum, and over hits, sticking joints and limits there are many. What
//! differs from effect to effect is where its fits begin, and that is data.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::Effort;
use inference::likelihood::Likelihood;

/// A fit with its cost.
pub trait Fit {
    /// `-2 ln` of the likelihood.
    fn cost(&self) -> f64;
}

impl<V> Fit for Hypothesis<V> {
    fn cost(&self) -> f64 {
        self.deviance()
    }
}

/// The cheapest of some fits; the first that costs less than is `enough` ends the search for it.
pub fn cheapest<F: Fit>(fits: impl IntoIterator<Item = F>, enough: f64) -> Option<F> {
    let mut best: Option<F> = None;
    for fit in fits {
        if best.as_ref().is_none_or(|best| fit.cost() < best.cost()) {
            best = Some(fit);
        }
        if best.as_ref().is_some_and(|best| best.cost() < enough) {
            break;
        }
    }
    best
}

/// Whatever it costs.
pub const NEVER_ENOUGH: f64 = f64::NEG_INFINITY;

/// Effects that are fitted together to the same clips, from wherever.
pub struct MultiStart<'a, E: Likelihood> {
    pub bench: &'a Bench<'a, E>,
    pub effects: &'a [usize],
    pub clips: &'a [usize],
    pub weights: &'a [f64],
    /// Where each clip's nuisance parameters begin.
    pub near: Option<&'a Hypothesis<E::Own>>,
}

impl<E: Likelihood> MultiStart<'_, E> {
    /// From one start.
    pub fn fit(&self, full: Vec<f64>, effort: Effort) -> Option<Hypothesis<E::Own>> {
        self.bench.fit(self.effects, full, self.clips, self.weights, self.near, effort)
    }

    /// The cheapest of fits from several starts.
    pub fn best(&self, starts: impl IntoIterator<Item = Vec<f64>>, effort: Effort) -> Option<Hypothesis<E::Own>> {
        cheapest(starts.into_iter().filter_map(|full| self.fit(full, effort)), NEVER_ENOUGH)
    }

    /// Fits from several starts, `count` of the cheapest fitted further, and the cheapest of these.
    pub fn best_further(
        &self,
        starts: impl IntoIterator<Item = Vec<f64>>,
        effort: Effort,
        count: usize,
        further: Effort,
    ) -> Option<Hypothesis<E::Own>> {
        let mut begun: Vec<_> = starts.into_iter().filter_map(|full| self.fit(full, effort)).collect();
        begun.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        let onwards = |fit: &Hypothesis<E::Own>| MultiStart { near: Some(fit), ..*self }.fit(fit.full.clone(), further);
        cheapest(begun.iter().take(count).filter_map(onwards), NEVER_ENOUGH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Fit for f64 {
        fn cost(&self) -> f64 {
            *self
        }
    }

    #[test]
    fn the_cheapest_fit_counts_and_none_is_made_after_one_that_is_enough() {
        assert_eq!(cheapest([3.0, 1.0, 2.0], NEVER_ENOUGH), Some(1.0));
        let made = std::cell::Cell::new(0);
        let fits = [5.0, 3.0, 1.0].into_iter().inspect(|_| made.set(made.get() + 1));
        assert_eq!((cheapest(fits, 4.0), made.get()), (Some(3.0), 2));
        assert_eq!(cheapest([], NEVER_ENOUGH), None::<f64>);
    }
}
