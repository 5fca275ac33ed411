//! One fit from several starts: a local solver finds the nearest minimum, and over hits, sticking joints and limits there are many. What
//! differs from effect to effect, and from clip to clip, is where its fits begin, and that is data.

use super::bench::{Bench, Hypothesis, Reached};
use super::effort::{Effort, PROBE};
use inference::likelihood::random_effects::{OwnNumbers, WithOwn};

/// What was fitted or tried, with its cost.
pub trait Fit {
    /// `-2 ln` of the likelihood.
    fn cost(&self) -> f64;
}

impl<V> Fit for Hypothesis<V> {
    fn cost(&self) -> f64 {
        self.deviance()
    }
}

/// Numbers, and what clips cost there.
#[derive(Debug, Clone)]
pub(in crate::diagnose) struct Tried {
    pub(in crate::diagnose) cost: f64,
    pub(in crate::diagnose) numbers: Vec<f64>,
}

impl Fit for Tried {
    fn cost(&self) -> f64 {
        self.cost
    }
}

/// The cheapest, and of several the first.
pub fn cheapest<F: Fit>(fits: impl IntoIterator<Item = F>) -> Option<F> {
    fits.into_iter().min_by(|a, b| a.cost().total_cmp(&b.cost()))
}

/// Effects that are fitted together to the same clips, from wherever.
pub struct MultiStart<'a, O: OwnNumbers = WithOwn> {
    pub bench: &'a Bench<'a, O>,
    pub effects: &'a [usize],
    pub clips: &'a [usize],
    pub weights: &'a [f64],
    /// Where each clip's nuisance parameters begin.
    pub near: Option<&'a Hypothesis<O>>,
}

impl<O: OwnNumbers> MultiStart<'_, O> {
    /// From one start.
    pub fn fit(&self, full: Vec<f64>, effort: Effort) -> Option<Hypothesis<O>> {
        self.bench.fit(self.effects, full, self.clips, self.weights, self.near, effort)
    }

    /// The cheapest of fits from several starts.
    pub fn best(&self, starts: impl IntoIterator<Item = Vec<f64>>, effort: Effort) -> Option<Hypothesis<O>> {
        cheapest(starts.into_iter().filter_map(|full| self.fit(full, effort)))
    }

    /// Fits from several starts, `count` of the cheapest fitted further, and the cheapest of these.
    pub fn best_further(
        &self,
        starts: impl IntoIterator<Item = Vec<f64>>,
        effort: Effort,
        count: usize,
        further: Effort,
    ) -> Option<Hypothesis<O>> {
        let mut begun: Vec<_> = starts.into_iter().filter_map(|full| self.fit(full, effort)).collect();
        begun.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        let onwards = |fit: &Hypothesis<O>| MultiStart { near: Some(fit), ..*self }.fit(fit.full.clone(), further);
        cheapest(begun.iter().take(count).filter_map(onwards))
    }
}

impl<O: OwnNumbers> Bench<'_, O> {
    /// What the clips of a hypothesis cost at `full` after one step of some numbers alone, and the numbers then. `None` when the
    /// twin has no answer there.
    pub(in crate::diagnose) fn after_a_step(
        &self,
        from: &Hypothesis<O>,
        full: Vec<f64>,
        moving: &[usize],
        weights: &[f64],
    ) -> Option<Tried> {
        let (Reached { full, clips, .. }, _) = self.descended(full, from.clips_with_own(), moving, weights, PROBE)?;
        Some(Tried { cost: self.cost(&full, &clips, weights)?, numbers: full })
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
    fn the_cheapest_fit_counts_and_of_several_the_first() {
        assert_eq!(cheapest([3.0, 1.0, 2.0]), Some(1.0));
        let tried = |numbers| Tried { cost: 1.0, numbers: vec![numbers] };
        assert_eq!(cheapest([tried(4.0), tried(5.0)]).map(|tried| tried.numbers), Some(vec![4.0]));
        assert_eq!(cheapest([]), None::<f64>);
    }
}
