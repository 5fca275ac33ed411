//! What changed: changes are added while the clips of both sessions are predicted better with them than with the same thing in both.

use super::fits::{Fitted, LEAST, PairBench, Worth};
use super::scores::{Score, Slopes, is_apart};
use super::subjects::Subject;
use super::turned::Model;
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::fit::effort::{FIRST_PASS, HEAT};
use crate::diagnose::fit::stages;
use crate::diagnose::search::refit::last_pass;
use crate::words::words;
use inference::likelihood::Evidence;
use shared_mem::progress::{Planned, Progress};

/// At most so many changes are named, and so many effects that both sessions have are found on the way.
const MOST: usize = 3;
const MOST_SHARED: usize = 2;
/// So many changes are fitted in each step.
const FITTED: usize = 6;
/// Those are fitted whose gain chance does not reach with this probability, and that promise this share of the best.
const BY_CHANCE: f64 = 0.05;
const CLOSE: f64 = 0.05;
/// An effect in both sessions that promises less than this is not fitted [deviance].
const SHARED_GAIN: f64 = 6.0;
/// Two changes whose log-likelihoods differ by less than this are not distinguishable [nats].
const ALIKE: f64 = 4.0;

/// The stages of the search, for the bar.
const SLOPES: &str = "slopes of both sessions";
/// See [`SLOPES`].
const CHANGES: &str = "changes";
/// With about how long each takes beside those of a diagnosis: a search that finds one change.
pub(super) const STAGES: [Planned; 5] =
    [(SLOPES, 1.0), (CHANGES, 2.0), (SLOPES, 1.0), (CHANGES, 1.0), (stages::CONCLUSION, 0.2)];

/// A change that was fitted.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    /// Index of the subject.
    pub(super) subject: usize,
    pub(super) fitted: Fitted,
    /// What it is worth over the same thing in both sessions.
    pub(super) change: Worth,
    /// What it is worth over the model without.
    pub(super) whole: Worth,
    /// Numbers that it costs.
    pub(super) cost: usize,
}

impl Trial {
    /// What it is worth less what its numbers gain by chance.
    fn net(&self) -> f64 {
        self.whole.nats - 0.5 * self.cost as f64
    }
}

#[derive(Debug, Clone)]
pub(super) struct Step {
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
    pub(super) last: Fitted,
    /// Subjects that changed, in the order in which they were found.
    pub(super) changed: Vec<usize>,
    /// Factors on the channels.
    pub(super) weights: Vec<f64>,
}

/// Searches from a hypothesis that was found on A alone. `None` where the twin has no answer, or the time is over.
pub(super) fn search<E: Evidence>(
    pair_bench: &PairBench<'_, E>,
    subjects: &[Subject],
    of_a: &Hypothesis,
    bar: &Progress,
) -> Option<Found> {
    let start = Model::shared(of_a.full.clone(), &of_a.free);
    bar.stage(SLOPES, 1);
    let slopes = Slopes::around(pair_bench.bench, &start, (&at(pair_bench, of_a), pair_bench.first_of_b), None)?;
    let weights = slopes.weights.clone();
    let mut now = pair_bench.fit(start.clone(), &weights, None, last_pass(pair_bench.bench))?;
    let mut without = now.clone();
    let (mut steps, mut changed, mut shared): (Vec<Step>, Vec<usize>, usize) = (Vec::new(), Vec::new(), 0);
    // Slopes around A's own numbers show a change as it is; those around a mean of both sessions show half of it either way.
    let mut scores = slopes.scores(pair_bench.bench, &start, subjects);
    loop {
        let mut step = Step { scores, trials: Vec::new(), added: None };
        let in_both = step.fit(pair_bench, subjects, (&now, &weights), bar)?;
        let best = step.best().map(|trial| (trial.subject, trial.fitted.clone(), trial.net()));
        let ahead = best.as_ref().map_or(0.0, |(_, _, net)| *net);
        let more = in_both.filter(|(_, net)| *net > ahead && shared < MOST_SHARED);
        if let Some((fitted, _)) = more {
            shared += 1;
            now = fitted;
            if changed.is_empty() {
                without = now.clone();
            }
        } else if let Some((subject, fitted, _)) = best.filter(|_| changed.len() < MOST) {
            now = pair_bench
                .fit(fitted.model.clone(), &weights, Some(&fitted), last_pass(pair_bench.bench))
                .unwrap_or(fitted);
            changed.push(subject);
            step.added = Some(subject);
        } else {
            steps.push(step);
            break;
        }
        steps.push(step);
        bar.stage(SLOPES, 1);
        let slopes = Slopes::around(
            pair_bench.bench,
            &now.model,
            (&at(pair_bench, &now.hypothesis), pair_bench.first_of_b),
            Some(&weights),
        )?;
        scores = slopes.scores(pair_bench.bench, &now.model, subjects);
    }
    let (last, changed) = without_superfluous(pair_bench, subjects, (now, changed), &weights);
    Some(Found { steps, without, last, changed, weights })
}

/// Clips that are fitted, each with its own numbers.
fn at<E: Evidence>(pair_bench: &PairBench<'_, E>, hypothesis: &Hypothesis) -> Vec<(usize, Vec<f64>)> {
    let count = pair_bench.bench.scatter.count();
    pair_bench.split.train.iter().map(|clip| (*clip, hypothesis.own(*clip, count))).collect()
}

impl Step {
    /// Fits the changes that promise most; the best effect that both sessions have instead, where one is worth it, with its
    /// worth. `None` when the time is over.
    fn fit<E: Evidence>(
        &mut self,
        pair_bench: &PairBench<'_, E>,
        subjects: &[Subject],
        (now, weights): (&Fitted, &[f64]),
        bar: &Progress,
    ) -> Option<Option<(Fitted, f64)>> {
        let best = self.scores.iter().map(|score| score.gain).fold(0.0, f64::max);
        let promising = |score: &&Score| score.p < BY_CHANCE && score.gain > CLOSE * best;
        let wanted: Vec<Score> = self.scores.iter().filter(promising).take(FITTED).cloned().collect();
        bar.stage(CHANGES, wanted.len() as u64);
        let mut in_both: Option<(Fitted, f64)> = None;
        for (done, score) in wanted.iter().enumerate() {
            let subject = &subjects[score.subject];
            bar.show(done as u64, &format!("{CHANGES}: {}", words(&subject.name)));
            if pair_bench.bench.interrupt.asked() {
                return None;
            }
            let known = subject.is_in(|k| now.model.turned.iter().any(|turned| turned.number == k));
            let same = if known || score.gain_shared < SHARED_GAIN {
                None
            } else {
                let model = placed(&now.model, subject, &score.starts[1]).with(&subject.turned);
                fit_from(pair_bench, vec![model], now, weights)
            };
            let over = same.as_ref().unwrap_or(now);
            let parted = subject.parted(known);
            let split =
                |model: Model| if known { model.apart(&parted) } else { model.with(&subject.turned).apart(&parted) };
            let starts = vec![split(placed(&now.model, subject, &score.starts[0])), split(over.model.clone())];
            let Some(fitted) = fit_from(pair_bench, starts, over, weights) else { continue };
            let worth = |a: &Fitted, b: &Fitted| Worth::of(&a.predicted, &b.predicted, pair_bench.first_of_b);
            let (change, whole) = (worth(&fitted, over), worth(&fitted, now));
            let cost = if known { parted.len() } else { subject.turned.len() + parted.len() };
            self.trials.push(Trial { subject: score.subject, fitted, change, whole, cost });
            let of_same = same.map(|same| (worth(&same, now), same));
            if let Some((gain, same)) = of_same.filter(|(gain, _)| gain.is_proven(subject.turned.len())) {
                let net = gain.nats - 0.5 * subject.turned.len() as f64;
                if in_both.as_ref().is_none_or(|(_, best)| net > *best) {
                    in_both = Some((same, net));
                }
            }
        }
        Some(in_both)
    }

    /// Trials that are proven.
    pub(super) fn proven(&self) -> impl Iterator<Item = &Trial> {
        self.trials.iter().filter(|trial| trial.change.is_proven(trial.cost) && trial.whole.is_proven(trial.cost))
    }

    /// The proven trial that is worth most.
    fn best(&self) -> Option<&Trial> {
        self.proven().max_by(|a, b| a.net().total_cmp(&b.net()))
    }

    /// What does as well as the change that was added, with no more numbers.
    pub(super) fn rivals<E>(&self, pair_bench: &PairBench<'_, E>) -> Vec<&Trial> {
        let Some(added) = self.added.and_then(|added| self.trials.iter().find(|trial| trial.subject == added)) else {
            return Vec::new();
        };
        let alike = |trial: &&Trial| {
            let ahead = Worth::of(&added.fitted.predicted, &trial.fitted.predicted, pair_bench.first_of_b);
            trial.subject != added.subject && trial.cost <= added.cost && ahead.nats < ALIKE.max(ahead.chance())
        };
        self.proven().filter(alike).collect()
    }
}

impl Found {
    /// Whether a rival of the change that a step added does as well in its place beside all others that were found.
    pub(super) fn stands_in<E: Evidence>(
        &self,
        pair_bench: &PairBench<'_, E>,
        subjects: &[Subject],
        (step, rival): (&Step, &Trial),
    ) -> bool {
        let Some(added) = step.added else { return false };
        let numbers: Vec<usize> = subjects[added].numbers.clone().filter(|k| is_apart(&self.last.model, *k)).collect();
        let subject = &subjects[rival.subject];
        let own: Vec<usize> = subject.numbers.clone().filter(|k| is_apart(&rival.fitted.model, *k)).collect();
        let model = placed(&self.last.model.clone().together(&numbers), subject, &rival.fitted.model.values);
        let model = model.with(&subject.turned).apart(&own);
        let swapped = pair_bench.fit(model, &self.weights, Some(&self.last), FIRST_PASS);
        swapped.is_none_or(|swapped| {
            let ahead = Worth::of(&self.last.predicted, &swapped.predicted, pair_bench.first_of_b);
            ahead.nats < ALIKE.max(ahead.chance())
        })
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

/// A fit from the first of several starts from which it comes to more than the model `near` it.
fn fit_from<E: Evidence>(
    pair_bench: &PairBench<'_, E>,
    starts: Vec<Model>,
    near: &Fitted,
    weights: &[f64],
) -> Option<Fitted> {
    let mut best: Option<Fitted> = None;
    for start in starts {
        let heat = pair_bench.fit(start, weights, Some(near), HEAT);
        let least = best.as_ref().map_or(f64::INFINITY, |best| best.hypothesis.deviance());
        best = heat.filter(|heat| heat.hypothesis.deviance() < least).or(best);
        if best.as_ref().is_some_and(|best| best.hypothesis.deviance() < near.hypothesis.deviance()) {
            break;
        }
    }
    let best = best?;
    pair_bench.fit(best.model.clone(), weights, Some(&best), FIRST_PASS)
}

/// Drops changes that those found after them make superfluous.
fn without_superfluous<E: Evidence>(
    pair_bench: &PairBench<'_, E>,
    subjects: &[Subject],
    (mut now, mut changed): (Fitted, Vec<usize>),
    weights: &[f64],
) -> (Fitted, Vec<usize>) {
    while changed.len() > 1 && !pair_bench.bench.interrupt.asked() {
        let dropped = changed.iter().position(|subject| {
            let numbers: Vec<usize> = subjects[*subject].numbers.clone().filter(|k| is_apart(&now.model, *k)).collect();
            let fit =
                pair_bench.fit(now.model.clone().together(&numbers), weights, Some(&now), last_pass(pair_bench.bench));
            let superfluous = fit.filter(|fit| {
                let loss = Worth::of(&now.predicted, &fit.predicted, pair_bench.first_of_b);
                !loss.is_proven(numbers.len())
            });
            superfluous.map(|fit| now = fit).is_some()
        });
        match dropped {
            Some(place) => drop(changed.remove(place)),
            None => break,
        }
    }
    (now, changed)
}

/// The smallest change of a size that is proven in nine of ten sessions like these, from one sigma of it: its gain must come to what a
/// change has to be worth, less what its numbers gain by chance.
pub(super) fn smallest_seen(sigma: f64, cost: usize) -> f64 {
    let needed = LEAST.max(cost as f64) + 0.5 * cost as f64;
    sigma * (NINE_OF_TEN + (NINE_OF_TEN * NINE_OF_TEN + 2.0 * needed).sqrt())
}

/// Nine of ten normal numbers lie above so many sigmas below their mean.
const NINE_OF_TEN: f64 = 1.2816;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_the_smallest_size_that_is_seen_gains_enough_in_nine_of_ten() {
        let size = smallest_seen(1.0, 1);
        let gained = |noise: f64| 0.5 * size * size + noise * size;
        assert!((gained(-NINE_OF_TEN) - (LEAST + 0.5)).abs() < 1e-9, "{size}");
        assert!(smallest_seen(1.0, 7) > size && (smallest_seen(0.1, 1) / size - 0.1).abs() < 1e-9);
    }
}
