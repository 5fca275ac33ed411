//! How well a hypothesis predicts clips: `-2 ln` of the likelihood of each clip at numbers that were not fitted to it.
//!
//! Clips of the choosing set were not fitted. Those of the training set are predicted by the numbers the others give: one
//! Newton step away from the joint fit. What a clip costs there its linearisation knows already; where that says much more
//! than it costs at the joint fit, it is simulated: a hit is not linear for long.

use super::held_out::Fits;
use crate::diagnose::fit::bench::{Bench, FittedClip, Hypothesis};
use crate::diagnose::fit::left_out::shift_to;
use inference::estimate::quadratic::value;
use inference::likelihood::Evidence;
use inference::likelihood::random_effects_scale::{Around, at_the_best_scale};
use inference::statistics::median;

/// Deviance of every judged clip out of sample, and what it says about numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Clip and deviance, training clips first.
    pub clips: Vec<(usize, f64)>,
}

/// What one hypothesis is worth over another.
#[derive(Debug, Clone, PartialEq)]
pub struct Advantage {
    /// Sum over clips of the gain in ln of the likelihood, outstanding clips cut off [nats].
    pub nats: f64,
    /// Its standard error from the scatter between clips.
    pub error: f64,
    /// Share of the clips that gain.
    pub share: f64,
    /// Clip by clip, outstanding ones cut off [nats].
    gains: Vec<f64>,
}

/// A clip's gain or loss counts up to so many times that of the clip in the middle, or up to so many nats: no clip decides
/// alone, and none makes what all the others say uncertain.
const OUTSTANDING: f64 = 5.0;
const LEAST: f64 = 4.0;
/// A linearisation is believed that the cost of a clip left out rises by no more than this.
const DOUBTED: f64 = 100.0;

/// What would take more than so many times the clips at hand is no promise.
const MOST_TIMES: f64 = 6.0;

/// Predicts training and choosing clips.
pub fn predict<E: Evidence>(
    bench: &Bench<'_, E>,
    hypothesis: &Hypothesis,
    choose: &[usize],
    weights: &[f64],
) -> Option<Predicted> {
    let left_out = left_out(bench, hypothesis, weights);
    let judged = bench.judge(hypothesis, choose, weights)?;
    let all: Vec<&FittedClip> = hypothesis.fitted.iter().chain(&judged).collect();
    let deviances = left_out.into_iter().chain(judged.iter().map(|clip| (clip.clip, clip.deviance()))).collect();
    Some(at_one_scale(bench, &all, deviances))
}

/// Predicts clips by numbers that were fitted to others.
pub(in crate::diagnose) fn predict_unseen<E: Evidence>(
    bench: &Bench<'_, E>,
    fits: &Fits,
    weights: &[f64],
) -> Option<Predicted> {
    let judged: Option<Vec<_>> = fits.iter().map(|(fit, clips)| bench.judge(fit, clips, weights)).collect();
    let judged = judged?.concat();
    let deviances = judged.iter().map(|clip| (clip.clip, clip.deviance())).collect();
    Some(at_one_scale(bench, &judged.iter().collect::<Vec<_>>(), deviances))
}

/// With the scatter between clips as wide as makes all of them most likely.
fn at_one_scale<E>(bench: &Bench<'_, E>, clips: &[&FittedClip], mut deviances: Vec<(usize, f64)>) -> Predicted {
    let around: Vec<&Around> = clips.iter().map(|clip| &clip.reduced.around).collect();
    for ((_, deviance), change) in deviances.iter_mut().zip(at_the_best_scale(&around, &bench.scatter)) {
        *deviance += change;
    }
    Predicted { clips: deviances }
}

fn left_out<E: Evidence>(bench: &Bench<'_, E>, hypothesis: &Hypothesis, weights: &[f64]) -> Vec<(usize, f64)> {
    let all: Vec<usize> = (1..=hypothesis.free.len()).collect();
    let total = bench.held(hypothesis);
    let one = |clip: &FittedClip| {
        let form = &clip.reduced.form;
        let shift = shift_to(bench, hypothesis, &(&total - form));
        let linear = value(form, &all, &shift) + clip.reduced.volume;
        let doubted = linear > clip.deviance() + DOUBTED;
        let answer = if doubted { simulated(bench, hypothesis, (clip, &shift), weights) } else { None };
        (clip.clip, answer.unwrap_or(linear))
    };
    hypothesis.fitted.iter().map(one).collect()
}

/// Deviance of a clip with the free numbers shifted; `None` where the twin has no answer there.
fn simulated<E: Evidence>(
    bench: &Bench<'_, E>,
    hypothesis: &Hypothesis,
    (clip, shift): (&FittedClip, &[f64]),
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

    /// What this hypothesis is worth over another on the same clips.
    pub fn over(&self, other: &Self) -> Advantage {
        let mut gains: Vec<f64> = self.clips.iter().zip(&other.clips).map(|((_, a), (_, b))| 0.5 * (b - a)).collect();
        let most = (OUTSTANDING * median(gains.iter().map(|gain| gain.abs())).unwrap_or(0.0)).max(LEAST);
        gains.iter_mut().for_each(|gain| *gain = gain.clamp(-most, most));
        let (nats, error) = sum(&gains);
        let share = gains.iter().filter(|gain| **gain > 0.0).count() as f64 / gains.len() as f64;
        Advantage { nats, error, share, gains }
    }
}

impl Advantage {
    /// How many clips judged.
    pub fn clips(&self) -> usize {
        self.gains.len()
    }

    /// How many clips more would make it twice its error, gaining as those at hand do; `None` where more would prove nothing, at
    /// most as many as there are five times over, or it is proven.
    pub fn clips_more(&self) -> Option<usize> {
        if self.nats <= 0.0 || self.nats > 2.0 * self.error {
            return None;
        }
        // The sum grows with the number of clips, its error with the root of it.
        let count = self.clips() as f64;
        let needed = count * (2.0 * self.error / self.nats).powi(2);
        (needed <= MOST_TIMES * count).then(|| (needed - count).ceil().max(1.0) as usize)
    }

    /// By how much more this is worth than another on the same clips, and the standard error of that from the scatter of the
    /// difference between clips [nats]: what two hypotheses gain alike on a clip says nothing about which is right.
    pub fn beyond(&self, other: &Self) -> (f64, f64) {
        sum(&self.gains.iter().zip(&other.gains).map(|(a, b)| a - b).collect::<Vec<_>>())
    }
}

/// Sum, and its standard error.
fn sum(gains: &[f64]) -> (f64, f64) {
    let count = gains.len() as f64;
    let total: f64 = gains.iter().sum();
    let mean = total / count;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    (total, (variance * count).sqrt())
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
            let mut fit = bench.fit((&[], bench.library.start()), &[0, 1], even, None, ONCE).expect("a fit");
            let told = |fit: &Hypothesis| predict(bench, fit, &[], even).expect("strokes").clips[0].1;
            let nearly_straight = told(&fit);
            // As if the first clip lay on an edge: at the point everything is steep, and a step away nothing is.
            fit.fitted[0].reduced.form.view_mut((1, 1), (fit.free.len(), fit.free.len())).fill_diagonal(1e12);
            assert!((told(&fit) / nearly_straight - 1.0).abs() < 0.5, "{} {nearly_straight}", told(&fit));
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
        let (nats, error) = better.beyond(&worse);
        assert!((nats - 12.0).abs() < 1e-9 && error < 1.0 && better.error > 40.0, "{nats} {error}");
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
