//! Models of two sessions fitted to the clips of both, and how well they predict clips that they were not fitted to.

use super::turned::{Model, SIDES, Side, TwoSessions, side_of};

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::Effort;
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out;
use crate::diagnose::judge::score::{Predicted, predict};
use crate::diagnose::judge::trial::NEARLY_ALL;
use inference::admit::Split;
use inference::likelihood::Evidence;
use inference::statistics::{median, student_sigmas};

/// What all fits share.
pub(super) struct PairBench<'a, E> {
    /// All clips under the whole library.
    pub(super) bench: &'a Bench<'a, E>,
    /// Index of B's first clip.
    pub(super) first_of_b: usize,
    /// Which clips are for what.
    pub(super) split: &'a Split,
}

/// A model at its best.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) model: Model,
    /// The same as a hypothesis over what is turned.
    pub(super) hypothesis: Hypothesis,
    /// How it predicts clips.
    pub(super) predicted: Predicted,
}

/// What one model is worth over another on the clips of both sessions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Worth {
    /// Gain in ln of the likelihood, outstanding clips cut off [nats].
    pub(super) nats: f64,
    /// Its standard error by the scatter between the clips of each session.
    pub(super) error: f64,
    /// Share of the clips that gain.
    pub(super) share: f64,
    /// Clips that judged.
    pub(super) clips: usize,
}

/// A change must be worth more than this [nats] ...
pub(super) const LEAST: f64 = 5.0;
/// ... and more than so many of its errors, were these known exactly.
const CHANCE: f64 = 2.0;
/// ... unless nearly all clips agree, and there are so many that this is no chance: seven of eight do so once in thirty.
const ENOUGH: usize = 8;
/// A clip's gain or loss counts up to so many times that of its session's clip in the middle.
const OUTSTANDING: f64 = 5.0;

impl Worth {
    /// Of one model over another on the same clips.
    pub(super) fn of(model: &Predicted, over: &Predicted, first_of_b: usize) -> Self {
        let gains: Vec<(usize, f64)> =
            model.clips.iter().zip(&over.clips).map(|((clip, a), (_, b))| (*clip, 0.5 * (b - a))).collect();
        let (mut nats, mut variance) = (0.0, 0.0);
        for side in SIDES {
            // What a change gains in one session says nothing about what it gains in the other.
            let mut of_side: Vec<f64> =
                gains.iter().filter(|(clip, _)| side_of(*clip, first_of_b) == side).map(|(_, gain)| *gain).collect();
            let most = (OUTSTANDING * median(of_side.iter().map(|gain| gain.abs())).unwrap_or(0.0)).max(LEAST);
            of_side.iter_mut().for_each(|gain| *gain = gain.clamp(-most, most));
            let count = of_side.len() as f64;
            let mean = of_side.iter().sum::<f64>() / count.max(1.0);
            nats += count * mean;
            variance += of_side.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() * count / (count - 1.0).max(1.0);
        }
        let share = gains.iter().filter(|(_, gain)| *gain > 0.0).count() as f64 / gains.len().max(1) as f64;
        Self { nats, error: variance.sqrt(), share, clips: gains.len() }
    }

    /// Whether it is no chance that something with `cost` more numbers is worth this.
    pub(super) fn is_proven(&self, cost: usize) -> bool {
        let agree = self.share > NEARLY_ALL && self.clips >= ENOUGH;
        self.nats > LEAST.max(cost as f64) && (agree || self.nats > self.chance())
    }

    /// What chance may be worth.
    pub(super) fn chance(&self) -> f64 {
        student_sigmas(CHANCE, self.clips.saturating_sub(2)) * self.error
    }
}

impl<E: Evidence> PairBench<'_, E> {
    /// Fits a model from where it is, each clip's own numbers from where `near` has them.
    pub(super) fn fit(&self, model: Model, weights: &[f64], near: Option<&Fitted>, effort: Effort) -> Option<Fitted> {
        let (hypothesis, predicted) = self.on_bench(&model, |bench| {
            let near = near.map(|near| &near.hypothesis);
            let hypothesis = bench.fit((&[], model.start()), &self.split.train, weights, near, effort)?;
            let predicted = predict(bench, &hypothesis, &self.split.choose, weights)?;
            Some((hypothesis, predicted))
        })?;
        Some(Fitted { model: model.at(&hypothesis.full), hypothesis, predicted })
    }

    /// Asks a bench on which the numbers that a model turns are all there are.
    pub(super) fn on_bench<R>(
        &self,
        model: &Model,
        ask: impl FnOnce(&Bench<'_, TwoSessions<'_, E>>) -> Option<R>,
    ) -> Option<R> {
        let library = model.library(self.bench.library);
        let evidence = TwoSessions { evidence: self.bench.evidence, first_of_b: self.first_of_b, model };
        let name = format!("two sessions: {:?}", model.turned);
        let (scatter, trail) = (self.bench.scatter.clone(), (self.bench.trail.0, &name[..]));
        ask(&Bench { evidence: &evidence, library: &library, scatter, interrupt: self.bench.interrupt, trail })
    }

    /// Numbers of B for clips of B that they were not fitted to.
    pub(super) fn held_out(&self, fitted: &Fitted, weights: &[f64]) -> Option<held_out::Fits> {
        let fits =
            self.on_bench(&fitted.model, |bench| held_out::fits(bench, self.split, (&fitted.hypothesis, weights)))?;
        let of_b = |(fit, clips): (Hypothesis, Vec<usize>)| {
            let clips: Vec<usize> = clips.into_iter().filter(|clip| self.is_of_b(*clip)).collect();
            (numbers(fitted.model.full(Side::B, &fit.full)), clips)
        };
        Some(fits.into_iter().map(of_b).filter(|(_, clips)| !clips.is_empty()).collect())
    }

    /// What numbers leave of some clips, on which they may have been fitted.
    pub(super) fn left(&self, full: &[f64], clips: &[usize]) -> Option<Residuals> {
        Residuals::at(self.bench, &numbers(full.to_vec()), clips)
    }

    pub(super) fn is_of_b(&self, clip: usize) -> bool {
        side_of(clip, self.first_of_b) == Side::B
    }
}

/// A hypothesis of which only the numbers count.
pub(super) fn numbers(full: Vec<f64>) -> Hypothesis {
    Hypothesis { effects: Vec::new(), full, free: Vec::new(), fitted: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worth(gains: &[f64], first_of_b: usize) -> Worth {
        let before = Predicted { clips: (0..gains.len()).map(|clip| (clip, 900.0)).collect() };
        let after =
            Predicted { clips: gains.iter().enumerate().map(|(clip, gain)| (clip, 900.0 - 2.0 * gain)).collect() };
        Worth::of(&after, &before, first_of_b)
    }

    #[test]
    fn a_change_that_only_the_clips_of_one_session_gain_by_is_no_less_proven() {
        let gains = [0.1, -0.2, 0.0, 0.1, -0.1, 0.2, 20.0, 21.0, 19.5];
        let one_sided = worth(&gains, 6);
        assert!(one_sided.is_proven(1) && one_sided.error < 3.0, "{one_sided:?}");
        assert!(!worth(&gains[..6], 3).is_proven(1));
    }

    #[test]
    fn gains_that_scatter_as_widely_as_they_are_large_prove_nothing() {
        assert!(!worth(&[9.0, -8.0, 7.0, 10.0, -9.0, 8.0], 3).is_proven(1));
    }
}
