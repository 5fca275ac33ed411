//! How well a hypothesis predicts clips: `-2 ln` of the likelihood of each clip at numbers that were not fitted to it.
//!
//! Clips of the choosing set were not fitted. Those of the training set are predicted by the numbers the others give: one
//! Newton step away from the joint fit. What a clip costs there its linearisation knows already; where that says much more
//! than it costs at the joint fit, it is simulated: a hit is not linear for long.

use super::held_out::Fits;
use crate::diagnose::fit::bench::{Bench, FittedClip, Hypothesis};
use crate::diagnose::fit::effort::ANOTHER_WAY_DEVIANCE;
use crate::diagnose::fit::left_out::shift_to;
use crate::diagnose::select::criteria::EFFECTS;
use crate::diagnose::select::gain::Gain;
use inference::estimate::quadratic::value;
use inference::likelihood::random_effects_scale::{Around, at_the_best_scale};

/// Deviance of every judged clip out of sample, and what it says about numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Clip and deviance, training clips first.
    pub clips: Vec<(usize, f64)>,
}

/// Predicts training and choosing clips.
pub fn predict(bench: &Bench<'_>, hypothesis: &Hypothesis, choose: &[usize], weights: &[f64]) -> Option<Predicted> {
    let left_out = left_out(bench, hypothesis, weights);
    let judged = bench.judge(hypothesis, choose, weights)?;
    let all: Vec<&FittedClip> = hypothesis.fitted.iter().chain(&judged).collect();
    let deviances = left_out.into_iter().chain(judged.iter().map(|clip| (clip.clip, clip.deviance()))).collect();
    Some(at_one_scale(bench, &all, deviances))
}

/// Predicts clips by numbers that were fitted to others.
pub(in crate::diagnose) fn predict_unseen(bench: &Bench<'_>, fits: &Fits, weights: &[f64]) -> Option<Predicted> {
    let judged: Option<Vec<_>> = fits.iter().map(|(fit, clips)| bench.judge(fit, clips, weights)).collect();
    let judged = judged?.concat();
    let deviances = judged.iter().map(|clip| (clip.clip, clip.deviance())).collect();
    Some(at_one_scale(bench, &judged.iter().collect::<Vec<_>>(), deviances))
}

/// With the scatter between clips as wide as makes all of them most likely.
fn at_one_scale(bench: &Bench<'_>, clips: &[&FittedClip], mut deviances: Vec<(usize, f64)>) -> Predicted {
    let around: Vec<&Around> = clips.iter().map(|clip| &clip.reduced.around).collect();
    for ((_, deviance), change) in deviances.iter_mut().zip(at_the_best_scale(&around, &bench.scatter)) {
        *deviance += change;
    }
    Predicted { clips: deviances }
}

fn left_out(bench: &Bench<'_>, hypothesis: &Hypothesis, weights: &[f64]) -> Vec<(usize, f64)> {
    let all: Vec<usize> = (1..=hypothesis.free.len()).collect();
    let total = bench.held(hypothesis);
    let one = |clip: &FittedClip| {
        let form = &clip.reduced.form;
        let shift = shift_to(bench, hypothesis, &(&total - form));
        let linear = value(form, &all, &shift) + clip.reduced.volume;
        let doubted = linear > clip.deviance() + ANOTHER_WAY_DEVIANCE;
        let answer = if doubted { simulated(bench, hypothesis, clip, &shift, weights) } else { None };
        (clip.clip, answer.unwrap_or(linear))
    };
    hypothesis.fitted.iter().map(one).collect()
}

/// Deviance of a clip with the free numbers shifted; `None` where the twin has no answer there.
fn simulated(
    bench: &Bench<'_>,
    hypothesis: &Hypothesis,
    clip: &FittedClip,
    shift: &[f64],
    weights: &[f64],
) -> Option<f64> {
    let mut shifted = hypothesis.clone();
    hypothesis.free.iter().zip(shift).for_each(|(k, shift)| shifted.full[*k] += shift);
    Some(bench.judge(&shifted, &[clip.clip], weights)?.first()?.deviance())
}

impl Predicted {
    /// Sum of the deviances.
    pub fn deviance(&self) -> f64 {
        self.clips.iter().map(|(_, deviance)| deviance).sum()
    }

    /// What this hypothesis is worth over another on the same clips of one session.
    pub fn over(&self, other: &Self) -> Gain {
        let gains = self.gains(other).map(|(_, gain)| gain).collect();
        Gain::of(vec![gains], EFFECTS.min_gain_nats)
    }

    /// By how much each clip is likelier than under another hypothesis [nats].
    pub fn gains<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (usize, f64)> + 'a {
        self.clips.iter().zip(&other.clips).map(|((clip, own), (_, its))| (*clip, 0.5 * (its - own)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::{ONCE, on_strokes, shipped};
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn a_clip_left_out_is_simulated_where_its_linearisation_says_that_it_falls_far_off() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |bench, even| {
            let mut fit = bench.fit(&[], bench.library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            let left_out = |fit: &Hypothesis| predict(bench, fit, &[], even).expect("strokes").clips[0].1;
            let nearly_straight = left_out(&fit);
            // As if the first clip lay on an edge: at the point everything is steep, and a step away nothing is.
            fit.fitted[0].reduced.form.view_mut((1, 1), (fit.free.len(), fit.free.len())).fill_diagonal(1e12);
            assert!((left_out(&fit) / nearly_straight - 1.0).abs() < 0.5, "{} {nearly_straight}", left_out(&fit));
        });
    }

    #[test]
    fn one_clip_that_gains_far_more_than_the_others_makes_them_no_less_certain() {
        let before = Predicted { clips: (0..6).map(|clip| (clip, 9000.0)).collect() };
        let gains = [20.0, 24.0, 8000.0, 30.0, 18.0, 22.0];
        let after = Predicted { clips: gains.iter().enumerate().map(|(clip, gain)| (clip, 9000.0 - gain)).collect() };
        let advantage = after.over(&before);
        assert!(advantage.nats > 2.0 * advantage.error && advantage.nats < 150.0, "{advantage:?}");
    }

    #[test]
    fn hypotheses_that_gain_on_the_same_clips_differ_by_the_difference_only() {
        let before = Predicted { clips: (0..6).map(|clip| (clip, 900.0)).collect() };
        let over = |gains: [f64; 6]| {
            let clips = gains.iter().enumerate().map(|(clip, gain)| (clip, 900.0 - 2.0 * gain)).collect();
            Predicted { clips }.over(&before)
        };
        let [better, worse] = [over([40.0, 10.0, 60.0, 25.0, 55.0, 20.0]), over([38.0, 8.5, 57.5, 23.0, 53.0, 18.0])];
        let ahead = better.beyond(&worse);
        assert!((ahead.nats - 12.0).abs() < 1e-9 && ahead.error < 1.0 && better.error > 40.0, "{ahead:?}");
    }

    #[test]
    fn clips_that_gain_unevenly_need_more_of_their_kind_and_even_ones_none() {
        let before = Predicted { clips: (0..4).map(|clip| (clip, 100.0)).collect() };
        let over = |gains: [f64; 4]| {
            let clips = gains.iter().enumerate().map(|(clip, gain)| (clip, 100.0 - 2.0 * gain)).collect();
            Predicted { clips }.over(&before)
        };
        assert_eq!(over([20.0, 22.0, 19.0, 21.0]).clips_more(), None, "proven");
        let uneven = over([-5.0, 30.0, 70.0, 25.0]);
        let more = uneven.clips_more().expect("unproven") as f64;
        // With the same mean and scatter in so many more clips.
        let scale = (4.0 + more) / 4.0;
        assert!(uneven.nats * scale >= 2.0 * uneven.error * scale.sqrt() && more <= 20.0, "{more} {uneven:?}");
        assert_eq!(over([-30.0, 30.0, -20.0, 21.0]).clips_more(), None, "hardly a gain at all");
        assert_eq!(over([-30.0, -3.0, -20.0, 2.0]).clips_more(), None);
    }

    #[test]
    fn an_advantage_that_one_clip_alone_gives_is_uncertain() {
        let before = Predicted { clips: (0..6).map(|clip| (clip, 100.0)).collect() };
        let even = Predicted { clips: (0..6).map(|clip| (clip, 90.0 + clip as f64 * 0.1)).collect() };
        let one = Predicted { clips: (0..6).map(|clip| (clip, if clip == 3 { 40.0 } else { 100.0 })).collect() };
        let [even, one] = [even.over(&before), one.over(&before)];
        assert!(even.nats > 25.0 && even.nats > 10.0 * even.error && even.share == 1.0, "{even:?}");
        assert!(one.nats < 2.0 * one.error, "{one:?}");
    }
}
