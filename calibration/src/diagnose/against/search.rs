//! What changed: changes are added while the clips of both sessions are predicted better with them than with the same thing in both.

use super::fits::{Fitted, PairBench};
use super::scores::{Score, Slopes, is_apart};
use super::subjects::Subject;
use super::turned::Model;
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::fit::effort::{REFINEMENT, SCREENING};
use crate::diagnose::fit::multi_start::{Fit as _, cheapest};
use crate::diagnose::fit::stages;
use crate::diagnose::select::criteria::CHANGES;
use crate::diagnose::select::forward::{Selection, backward, forward};
use crate::diagnose::select::gain::Gain;
use inference::statistics::normal;
use shared_mem::progress::Progress;

/// At most so many effects that both sessions have are found on the way.
const MAX_SHARED_EFFECTS: usize = 2;
/// An effect in both sessions that promises less than this is not fitted [deviance].
const MIN_SHARED_GAIN: f64 = 6.0;

/// A change that was fitted.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    /// Index of the subject.
    pub(super) subject: usize,
    pub(super) fitted: Fitted,
    /// What it is worth over the same thing in both sessions.
    pub(super) change: Gain,
    /// What it is worth over the model without.
    pub(super) whole: Gain,
    /// Parameters that it costs.
    pub(super) cost: usize,
}

impl Trial {
    fn net(&self) -> f64 {
        self.whole.net(self.cost)
    }

    fn is_proven(&self) -> bool {
        CHANGES.proves(&self.change, self.cost) && CHANGES.proves(&self.whole, self.cost)
    }
}

/// A model of both sessions with what was added to that of A.
#[derive(Debug, Clone)]
pub(super) struct Extended {
    pub(super) fitted: Fitted,
    /// Subjects that changed, in the order in which they were found.
    pub(super) changed: Vec<usize>,
    /// How many effects both sessions have beside those that were found in A alone.
    shared: usize,
}

#[derive(Debug, Clone)]
pub(super) struct Step {
    /// What is extended.
    from: Extended,
    /// What the slopes say of every subject that has not changed, the most promising first.
    pub(super) scores: Vec<Score>,
    /// Those that were fitted.
    pub(super) trials: Vec<Trial>,
    /// The change that was added; none in the last step.
    pub(super) added: Option<usize>,
}

/// What was found.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// The steps, the first from the model of A.
    pub(super) steps: Vec<Step>,
    /// The model of both without any change.
    pub(super) without: Fitted,
    /// ... with all that was found.
    pub(super) last: Extended,
    /// Factors on the channels.
    pub(super) weights: Vec<f64>,
}

/// What may be added to a model of both sessions.
struct Changes<'a> {
    pair_bench: &'a PairBench<'a>,
    subjects: &'a [Subject],
    weights: Vec<f64>,
    /// What the slopes around A's own model say: they show a change as it is; those around a mean of both sessions show half of it
    /// either way.
    around_a: Vec<Score>,
    bar: &'a Progress,
}

/// Searches from a hypothesis that was found on A alone. `None` where the twin has no answer, or the time is over.
pub(super) fn search(
    pair_bench: &PairBench<'_>,
    subjects: &[Subject],
    of_a: &Hypothesis,
    bar: &Progress,
) -> Option<Found> {
    let start = Model::shared(of_a.full.clone(), &of_a.free);
    bar.stage(stages::SLOPES, 1);
    let slopes = Slopes::around(pair_bench, &start, of_a, None)?;
    let around_a = slopes.scores(pair_bench.bench, &start, subjects);
    let changes = Changes { pair_bench, subjects, weights: slopes.weights, around_a, bar };
    let begin = changes.fitted(start, None)?;
    let selected = forward(&changes, Extended { fitted: begin, changed: Vec::new(), shared: 0 })?;
    let without = selected.steps.iter().rfind(|step| step.from.changed.is_empty())?.from.fitted.clone();
    let last = backward(selected.last, |now| changes.fewer(now));
    Some(Found { steps: selected.steps, without, last, weights: changes.weights })
}

impl Selection for Changes<'_> {
    type Model = Extended;
    type Step = Step;

    fn step(&self, now: &Extended, before: &[Step]) -> Option<(Step, Option<Extended>)> {
        let scores = if before.is_empty() { self.around_a.clone() } else { self.scores(&now.fitted)? };
        let best = scores.iter().map(|score| score.gain).fold(0.0, f64::max);
        let promising = scores.iter().filter(|score| CHANGES.promises(score.p, score.gain, best));
        let promising: Vec<&Score> = promising.take(CHANGES.max_fitted).collect();
        self.bar.stage(stages::CHANGES, promising.len() as u64);
        let (mut trials, mut shared) = (Vec::new(), Vec::new());
        for (done, score) in promising.into_iter().enumerate() {
            self.bar.show(done as u64, &stages::of(stages::CHANGES, &self.subjects[score.subject].name));
            if self.pair_bench.bench.interrupt.asked() {
                return None;
            }
            let Some((trial, in_both)) = self.tried(&now.fitted, score) else { continue };
            trials.push(trial);
            shared.extend(in_both);
        }
        let step = Step { from: now.clone(), scores, trials, added: None };
        Some(self.extended(step, shared))
    }

    fn extends(step: &Step) -> &Extended {
        &step.from
    }
}

/// An effect that both sessions have, fitted, and what it is worth less what its parameters gain by chance [nats].
type Shared = (Fitted, f64);

impl Changes<'_> {
    fn fitted(&self, model: Model, near: Option<&Fitted>) -> Option<Fitted> {
        self.pair_bench.fit(model, &self.weights, near, self.pair_bench.bench.last_pass())
    }

    /// What the slopes around a model say.
    fn scores(&self, now: &Fitted) -> Option<Vec<Score>> {
        self.bar.stage(stages::SLOPES, 1);
        let slopes = Slopes::around(self.pair_bench, &now.model, &now.hypothesis, Some(&self.weights))?;
        Some(slopes.scores(self.pair_bench.bench, &now.model, self.subjects))
    }

    /// A change fitted; with the same effect in both sessions where that is worth it by itself.
    fn tried(&self, now: &Fitted, score: &Score) -> Option<(Trial, Option<Shared>)> {
        let subject = &self.subjects[score.subject];
        let known = subject.is_in(|k| now.model.turned.iter().any(|turned| turned.number == k));
        let same = if known || score.gain_shared < MIN_SHARED_GAIN {
            None
        } else {
            self.fit_from([placed(&now.model, subject, &score.starts[1]).with(&subject.turned)], now)
        };
        let over = same.as_ref().unwrap_or(now);
        let parted = subject.parted(known);
        let split =
            |model: Model| if known { model.apart(&parted) } else { model.with(&subject.turned).apart(&parted) };
        let starts = [placed(&now.model, subject, &score.starts[0]), over.model.clone()];
        let fitted = self.fit_from(starts.map(split), over)?;
        let (change, whole) = (self.pair_bench.gain(&fitted, over), self.pair_bench.gain(&fitted, now));
        let of_both = subject.turned.len();
        let cost = if known { parted.len() } else { of_both + parted.len() };
        let shared = same.and_then(|same| {
            let gain = self.pair_bench.gain(&same, now);
            CHANGES.proves(&gain, of_both).then(|| (same, gain.net(of_both)))
        });
        Some((Trial { subject: score.subject, fitted, change, whole, cost }, shared))
    }

    /// A fit from the first of several starts from which it comes to more than the model `near` it.
    fn fit_from(&self, starts: impl IntoIterator<Item = Model>, near: &Fitted) -> Option<Fitted> {
        let fit = |model, near: &Fitted, effort| self.pair_bench.fit(model, &self.weights, Some(near), effort);
        let mut best: Option<Fitted> = None;
        for start in starts {
            if best.as_ref().is_none_or(|best| best.cost() >= near.cost()) {
                best = cheapest(best.into_iter().chain(fit(start, near, SCREENING)));
            }
        }
        let best = best?;
        fit(best.model.clone(), &best, REFINEMENT)
    }

    /// The model with what is worth most: the best change, or an effect that both sessions have where one is worth more.
    fn extended(&self, step: Step, shared: Vec<Shared>) -> (Step, Option<Extended>) {
        let best =
            step.best(self.pair_bench, self.subjects).map(|trial| (trial.subject, trial.fitted.clone(), trial.net()));
        let ahead = best.as_ref().map_or(0.0, |(_, _, net)| *net);
        let from = &step.from;
        // The first of those that are worth the same.
        let in_both = shared.into_iter().rev().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((fitted, _)) = in_both.filter(|(_, net)| *net > ahead && from.shared < MAX_SHARED_EFFECTS) {
            let extended = Extended { fitted, changed: from.changed.clone(), shared: from.shared + 1 };
            return (step, Some(extended));
        }
        let Some((subject, fitted, _)) = best.filter(|_| from.changed.len() < CHANGES.max_extensions) else {
            return (step, None);
        };
        let fitted = self.fitted(fitted.model.clone(), Some(&fitted)).unwrap_or(fitted);
        let extended = Extended { fitted, changed: [&from.changed[..], &[subject]].concat(), shared: from.shared };
        (Step { added: Some(subject), ..step }, Some(extended))
    }

    /// The model without the first of its changes that the others make superfluous.
    fn fewer(&self, now: &Extended) -> Option<Extended> {
        let all = now.changed.len();
        (0..all).filter(|_| all > 1).find_map(|place| self.without(now, place))
    }

    /// The model without one of its changes, where that predicts clips as well.
    fn without(&self, now: &Extended, place: usize) -> Option<Extended> {
        if self.pair_bench.bench.interrupt.asked() {
            return None;
        }
        let model = &now.fitted.model;
        let numbers = own(model, &self.subjects[now.changed[place]]);
        let fitted = self.fitted(model.clone().together(&numbers), Some(&now.fitted))?;
        let loss = self.pair_bench.gain(&now.fitted, &fitted);
        let changed = [&now.changed[..place], &now.changed[place + 1..]].concat();
        (!CHANGES.proves(&loss, numbers.len())).then_some(Extended { fitted, changed, shared: now.shared })
    }
}

/// The numbers of a subject of which each session has its own.
fn own(model: &Model, subject: &Subject) -> Vec<usize> {
    subject.numbers.clone().filter(|k| is_apart(model, *k)).collect()
}

impl Step {
    /// Trials that are proven.
    pub(super) fn proven(&self) -> impl Iterator<Item = &Trial> {
        self.trials.iter().filter(|trial| trial.is_proven())
    }

    /// The proven trial that is worth most. Of those that are worth the same as far as clips tell, what has a mass, a length or a
    /// friction behind it explains before what needs none.
    fn best(&self, pair_bench: &PairBench<'_>, subjects: &[Subject]) -> Option<&Trial> {
        let best = self.proven().max_by(|a, b| a.net().total_cmp(&b.net()))?;
        if subjects[best.subject].is_of_bodies {
            return Some(best);
        }
        let as_good = |trial: &&Trial| {
            subjects[trial.subject].is_of_bodies && pair_bench.gain(&best.fitted, &trial.fitted).may_be_none(1.0)
        };
        self.proven().filter(as_good).max_by(|a, b| a.net().total_cmp(&b.net())).or(Some(best))
    }

    /// What does as well as the change that was added, with no more parameters.
    pub(super) fn rivals(&self, pair_bench: &PairBench<'_>) -> Vec<&Trial> {
        let Some(added) = self.added.and_then(|added| self.trials.iter().find(|trial| trial.subject == added)) else {
            return Vec::new();
        };
        let alike = |trial: &&Trial| {
            let other = trial.subject != added.subject && trial.cost <= added.cost;
            other && pair_bench.gain(&added.fitted, &trial.fitted).may_be_none(1.0)
        };
        self.proven().filter(alike).collect()
    }
}

impl Found {
    /// Whether a rival of the change that a step added does as well in its place beside all others that were found.
    pub(super) fn stands_in(
        &self,
        pair_bench: &PairBench<'_>,
        subjects: &[Subject],
        step: &Step,
        rival: &Trial,
    ) -> bool {
        let (Some(added), last) = (step.added, &self.last.fitted) else { return false };
        let subject = &subjects[rival.subject];
        let model = last.model.clone().together(&own(&last.model, &subjects[added]));
        let model = placed(&model, subject, &rival.fitted.model.values).with(&subject.turned);
        let model = model.apart(&own(&rival.fitted.model, subject));
        let swapped = pair_bench.fit(model, &self.weights, Some(last), REFINEMENT);
        swapped.is_none_or(|swapped| pair_bench.gain(last, &swapped).may_be_none(1.0))
    }
}

/// A model with the numbers of a subject as they are in others.
fn placed(model: &Model, subject: &Subject, others: &[Vec<f64>; 2]) -> Model {
    let mut model = model.clone();
    for (values, others) in model.values.iter_mut().zip(others) {
        values[subject.numbers.clone()].copy_from_slice(&others[subject.numbers.clone()]);
    }
    model
}

/// The smallest change of a size that is proven in nine of ten sessions like these, from one sigma of it: its gain must come to what a
/// change has to be worth, less what its numbers gain by chance.
pub(super) fn smallest_seen(sigma: f64, cost: usize) -> f64 {
    let needed = CHANGES.price(cost) + 0.5 * cost as f64;
    let below = nine_of_ten_sigmas();
    sigma * (below + (below * below + 2.0 * needed).sqrt())
}

/// Nine of ten normal numbers lie above so many sigmas below their mean: eight of ten between these and as many above it.
fn nine_of_ten_sigmas() -> f64 {
    normal(0.8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_the_smallest_size_that_is_seen_gains_enough_in_nine_of_ten() {
        let size = smallest_seen(1.0, 1);
        let gained = |noise: f64| 0.5 * size * size + noise * size;
        assert!((gained(-nine_of_ten_sigmas()) - (CHANGES.min_gain_nats + 0.5)).abs() < 1e-9, "{size}");
        assert!(smallest_seen(1.0, 7) > size && (smallest_seen(0.1, 1) / size - 0.1).abs() < 1e-9);
    }
}
