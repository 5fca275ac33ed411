//! Models of two sessions fitted to the clips of both, and how well they predict clips that they were not fitted to.

use super::turned::{Model, SIDES, Side, TwoSessions, side_of};

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::Effort;
use crate::diagnose::fit::multi_start::Fit;
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out::{self, HeldOut};
use crate::diagnose::judge::score::{Predicted, predict};
use crate::diagnose::select::criteria::CHANGES;
use crate::diagnose::select::gain::Gain;
use inference::admit::Split;

/// What all fits share.
pub(super) struct PairBench<'a> {
    /// All clips under the whole library.
    pub(super) bench: &'a Bench<'a>,
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

impl Fit for Fitted {
    fn cost(&self) -> f64 {
        self.hypothesis.deviance()
    }
}

impl PairBench<'_> {
    /// Fits a model from where it is, each clip's nuisance parameters from where `near` has them.
    pub(super) fn fit(&self, model: Model, weights: &[f64], near: Option<&Fitted>, effort: Effort) -> Option<Fitted> {
        let (hypothesis, predicted) = self.on_bench(&model, |bench| {
            let near = near.map(|near| &near.hypothesis);
            let hypothesis = bench.fit(&[], model.start(), &self.split.train, weights, near, effort)?;
            let predicted = predict(bench, &hypothesis, &self.split.choose, weights)?;
            Some((hypothesis, predicted))
        })?;
        Some(Fitted { model: model.at(&hypothesis.full), hypothesis, predicted })
    }

    /// What a model is worth over another.
    pub(super) fn gain(&self, model: &Fitted, over: &Fitted) -> Gain {
        gain(&model.predicted, &over.predicted, self.first_of_b)
    }

    /// Asks a bench on which the numbers that a model turns are all there are.
    pub(super) fn on_bench<R>(&self, model: &Model, ask: impl FnOnce(&Bench<'_>) -> Option<R>) -> Option<R> {
        let library = model.library(self.bench.library);
        let evidence = TwoSessions { evidence: self.bench.evidence, first_of_b: self.first_of_b, model };
        let name = format!("two sessions: {:?}", model.turned);
        ask(&Bench::new(&evidence, &library, self.bench.interrupt, (self.bench.trail.0, &name)))
    }

    /// Numbers of B for clips of B that they were not fitted to.
    pub(super) fn held_out(&self, fitted: &Fitted, weights: &[f64]) -> Option<HeldOut> {
        let fits =
            self.on_bench(&fitted.model, |bench| held_out::fits(bench, self.split, &fitted.hypothesis, weights))?;
        let of_b = |(fit, clips): (Hypothesis, Vec<usize>)| {
            let clips: Vec<usize> = clips.into_iter().filter(|clip| self.is_of_b(*clip)).collect();
            (numbers(fitted.model.full(Side::B, &fit.full)), clips)
        };
        HeldOut::of(self.bench, fits.into_iter().map(of_b).filter(|(_, clips)| !clips.is_empty()).collect())
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

/// What a model of both sessions is worth over another on the same clips.
pub(super) fn gain(model: &Predicted, over: &Predicted, first_of_b: usize) -> Gain {
    let mut sessions = vec![Vec::new(); SIDES.len()];
    model.gains(over).for_each(|(clip, gain)| sessions[side_of(clip, first_of_b) as usize].push(gain));
    Gain::of(sessions, CHANGES.min_gain_nats)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worth(gains: &[f64], first_of_b: usize) -> Gain {
        let before = Predicted { clips: (0..gains.len()).map(|clip| (clip, 900.0)).collect() };
        let after =
            Predicted { clips: gains.iter().enumerate().map(|(clip, gain)| (clip, 900.0 - 2.0 * gain)).collect() };
        gain(&after, &before, first_of_b)
    }

    #[test]
    fn a_change_that_only_the_clips_of_one_session_gain_by_is_no_less_proven() {
        let gains = [0.1, -0.2, 0.0, 0.1, -0.1, 0.2, 20.0, 21.0, 19.5];
        let one_sided = worth(&gains, 6);
        assert!(CHANGES.proves(&one_sided, 1) && one_sided.error < 3.0, "{one_sided:?}");
        assert!(!CHANGES.proves(&worth(&gains[..6], 3), 1));
    }

    #[test]
    fn gains_that_scatter_as_widely_as_they_are_large_prove_nothing() {
        assert!(!CHANGES.proves(&worth(&[9.0, -8.0, 7.0, 10.0, -9.0, 8.0], 3), 1));
    }
}
