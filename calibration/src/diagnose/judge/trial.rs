//! Candidates tried on top of a hypothesis, and what makes one of them a cause.

use super::closing::closes;
use super::gap::{Residuals, Typical};
use super::score::{Advantage, Predicted, predict};
use crate::diagnose::criteria::OBJECT_EXCESS;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::floor;
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::library::Library;
use inference::admit::Split;
use inference::likelihood::Evidence;

/// A new effect must be worth at least this [nats], more than twice its error, and more than its numbers cost.
pub(in crate::diagnose) const LEAST: f64 = 4.0;
/// ... of the arm more than this for each of its residuals: there are so many that the least numerics add up.
pub(in crate::diagnose) const WORTHWHILE: f64 = 0.0025;
/// ... and close at least this share of the gap: what helps only beside numbers that clips have of their own is no cause.
pub const CLOSES: f64 = 0.1;
/// ... unless it closes so much of the gap and predicts so many of the clips better that one which it predicts worse does
/// not matter: 11 of 12 clips do not agree by chance (p = 0.003).
pub(in crate::diagnose) const PLAIN: f64 = 0.3;
pub(in crate::diagnose) const NEARLY_ALL: f64 = 0.85;
/// An advantage of so many of its errors is no chance.
const CLEAR: f64 = 3.5;
/// More than half of a gap is most of it.
const MOST_OF_IT: f64 = 0.5;
/// An effect that leads is worth this share more than others: two effects of nearly the same worth do the same.
const AHEAD: f64 = 0.2;
/// ... and what more numbers make of that difference by this share of the gain: friction at rest is every engine's own.
const OWN_SHARE: f64 = 1e-3;
/// A trial comes as near as another where its fit goes this share of the other's way.
const AS_NEAR: f64 = 0.5;
/// Where clips have numbers of their own, which hide what a candidate closes from the likelihood, one that has more numbers
/// than another must close this much more of the gap.
const MORE: f64 = 0.04;

/// A candidate tried on top of a hypothesis.
#[derive(Debug, Clone)]
pub struct Trial {
    /// What the score test said.
    pub scored: Scored,
    /// Fitted, where that was worth it.
    pub fitted: Option<(Hypothesis, Advantage)>,
    /// [`closes`]: how much of the gap.
    pub closes: f64,
    /// Whether clips have numbers of their own.
    pub own_numbers: bool,
}

impl Trial {
    /// Whether enough of the gap closes with it for a cause, however much better the clips are predicted.
    pub fn is_cause(&self) -> bool {
        self.closes > CLOSES
    }

    /// What it is worth as fitted [nats]; 0 where it was not.
    pub(in crate::diagnose) fn nats(&self) -> f64 {
        self.fitted.as_ref().map_or(0.0, |(_, advantage)| advantage.nats)
    }

    /// Whether another does the same with fewer numbers: what is better about this one is no more than engines differ by.
    pub fn is_outdone_by(&self, other: &Self) -> bool {
        let (Some((_, mine)), Some((_, its))) = (&self.fitted, &other.fitted) else { return false };
        let alike = mine.nats - its.nats < LEAST.max(OWN_SHARE * its.nats);
        other.scored.cost < self.scored.cost && alike && !self.closes_more_than(other)
    }

    /// Whether it closes so much more of the gap that its additional numbers are worth it although clips are predicted as well
    /// without them.
    pub fn closes_more_than(&self, other: &Self) -> bool {
        self.own_numbers && self.closes > other.closes + MORE
    }
}

/// One step of the search.
#[derive(Debug, Clone)]
pub struct Step {
    /// What was extended.
    pub from: Hypothesis,
    /// How it predicts.
    pub predicted: Predicted,
    /// All candidates, best first by the score test.
    pub trials: Vec<Trial>,
    /// Weights of the channels in this step.
    pub weights: Vec<f64>,
    /// How many residuals of the arm the judged clips have.
    pub arm_rows: usize,
    /// What the hypothesis that is extended leaves on all clips but those for confirming.
    pub left: Vec<Typical>,
    /// What the baseline leaves on them.
    pub whole: Vec<Typical>,
}

/// What the search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Every step; the first extends the baseline.
    pub steps: Vec<Step>,
    /// The hypothesis at the end.
    pub last: Hypothesis,
}

impl Found {
    /// For every step, how many times what the search left of an arm's clips exceeds what was taken for noise in it, at least
    /// 1: so many times less do differences between candidates say. Weights come from slopes, with all candidates at once; a
    /// real arm deviates far more under all that is named. Clips with numbers of their own take that up.
    pub fn overdispersion<E: Evidence>(&self, bench: &Bench<'_, E>) -> Vec<f64> {
        let clips: Vec<usize> = self.last.fitted.iter().map(|clip| clip.clip).collect();
        let left = (bench.scatter.count() == 0).then(|| Residuals::at(bench, &self.last, &clips)).flatten();
        let Some(left) = left else { return vec![1.0; self.steps.len()] };
        let weights = floor::weights(bench.evidence, &left.clips);
        let exceeds = |step: &Step| {
            let ratios = step.weights.iter().zip(&weights).map(|(taken, found)| (taken / found).powi(2));
            (ratios.sum::<f64>() / weights.len() as f64).max(1.0)
        };
        self.steps.iter().map(exceeds).collect()
    }

    /// The effects that were kept, each with the step in which it was added.
    pub fn kept(&self) -> impl Iterator<Item = (usize, usize)> {
        self.steps.windows(2).enumerate().filter_map(|(place, pair)| {
            let added = pair[1].from.effects.iter().find(|effect| !pair[0].from.effects.contains(effect))?;
            self.last.effects.contains(added).then_some((place, *added))
        })
    }
}

/// Whether an advantage is enough for `cost` more numbers.
pub fn convincing(advantage: &Advantage, cost: usize) -> bool {
    let price = LEAST.max(cost as f64);
    advantage.nats > price && advantage.nats > 2.0 * advantage.error && advantage.share > 0.5
}

/// Advantage less what numbers gain by chance: what trials are ranked by.
pub fn net(advantage: &Advantage, cost: usize) -> f64 {
    advantage.nats - 0.5 * cost as f64
}

impl Step {
    /// The trial that is worth most among those worth it.
    pub fn best<E: Evidence>(&self, bench: &Bench<'_, E>) -> Option<(&Trial, &Hypothesis, &Advantage)> {
        let convincing_ones: Vec<(&Trial, &Hypothesis, &Advantage)> = (self.trials.iter())
            .filter_map(|trial| trial.fitted.as_ref().map(|(fit, advantage)| (trial, fit, advantage)))
            .filter(|(trial, _, advantage)| {
                let of_arm = bench.library.candidates[trial.scored.candidate].is_of_arm();
                let (much, nearly_all) = (trial.closes > PLAIN, advantage.share > NEARLY_ALL);
                // Strokes of two engines differ by so much anyway that a little gain on most of them shows nothing.
                let rough = !of_arm && !self.object_gap();
                let shown = !rough || (much && self.is_alone(bench.library, trial.scored.candidate));
                // ... and beside a cause that was found before, a gain on nearly all of them neither.
                let plain = much && nearly_all && advantage.nats > LEAST && (shown || self.from.effects.is_empty());
                (convincing(advantage, trial.scored.cost) && shown) || plain
            })
            .filter(|(trial, _, advantage)| {
                let of_arm = bench.library.candidates[trial.scored.candidate].is_of_arm();
                !of_arm || advantage.nats > WORTHWHILE * self.arm_rows as f64
            })
            .filter(|(trial, _, _)| trial.is_cause())
            .filter(|(trial, fit, _)| !bench.negligible(trial.scored.candidate, &fit.full))
            .filter(|(trial, fit, _)| !bench.is_convention(trial.scored.candidate, fit))
            .collect();
        let simplest =
            |(trial, ..): &&(&Trial, _, _)| !convincing_ones.iter().any(|(other, ..)| trial.is_outdone_by(other));
        let worth = |(trial, _, advantage): &(&Trial, _, &Advantage)| net(advantage, trial.scored.cost);
        convincing_ones.iter().filter(simplest).max_by(|a, b| worth(a).total_cmp(&worth(b))).copied()
    }

    /// Notes a fit of a trial with what it predicts and closes.
    pub(in crate::diagnose) fn judge<E: Evidence>(
        &mut self,
        bench: &Bench<'_, E>,
        split: &Split,
        place: usize,
        fit: Hypothesis,
    ) {
        if let Some(ahead) = predict(bench, &fit, &split.choose, &self.weights) {
            let closes = closes(bench, split, &self.whole, [&self.from, &fit]);
            let trial = &mut self.trials[place];
            (trial.closes, trial.fitted) = (closes, Some((fit, ahead.over(&self.predicted))));
        }
    }

    /// Whether the object's gap is larger than in strokes of another engine with nothing wrong.
    fn object_gap(&self) -> bool {
        self.left.iter().any(|group| group.of_object && group.mean_square - group.floor > OBJECT_EXCESS.value)
    }

    /// Whether a trial stands out: nearly all clips speak for it, far beyond chance, and for no other effect half as much.
    pub fn is_clear(&self, library: &Library, candidate: usize) -> bool {
        let own = self.trials.iter().find(|trial| trial.scored.candidate == candidate);
        let advantage = own.and_then(|trial| trial.fitted.as_ref()).map(|(_, advantage)| advantage);
        let clear = |a: &Advantage| a.share > NEARLY_ALL && a.nats > CLEAR * a.error;
        advantage.is_some_and(clear) && self.is_alone(library, candidate)
    }

    /// Whether a trial leads: as clear as one that stands out, and ahead of every other cause that does not look like it, by half of
    /// what it is worth, or by a fifth and clip by clip far beyond chance.
    pub fn leads(&self, library: &Library, candidate: usize) -> bool {
        let Some(trial) = self.trials.iter().find(|trial| trial.scored.candidate == candidate) else { return false };
        let Some((_, own)) = trial.fitted.as_ref() else { return false };
        // Where every clip gains and most of the gap closes, the scatter between gains says how unequal clips are.
        let in_all = own.share == 1.0 && trial.closes > MOST_OF_IT;
        if own.share <= NEARLY_ALL || !in_all && own.nats <= CLEAR * own.error {
            return false;
        }
        let ahead_of = |trial: &Trial| {
            let (beyond, error) = trial.fitted.as_ref().map_or((f64::INFINITY, 0.0), |(_, other)| own.beyond(other));
            beyond > CLEAR * error && beyond > AHEAD * own.nats
        };
        let others = self.trials.iter().filter(|trial| trial.scored.candidate != candidate && trial.is_cause());
        let mut rivals = others
            .filter(|other| !library.look_alike(candidate, other.scored.candidate) && self.comes_as_near(other, trial));
        self.is_alone(library, candidate) || rivals.all(ahead_of)
    }

    /// Whether a trial's fit goes as much of the way from what clips cost without it to what they cost with another, on a
    /// logarithmic scale: an effect after which next to nothing is left of an arm's gap has no equal in one that leaves most of
    /// it, however unequal clips are. Where clips have numbers of their own, these hide it, and it is not asked.
    pub(in crate::diagnose) fn comes_as_near(&self, trial: &Trial, other: &Trial) -> bool {
        let without = self.from.deviance();
        let way = |trial: &Trial| trial.fitted.as_ref().map_or(0.0, |(fit, _)| (without / fit.deviance()).ln());
        trial.own_numbers || way(trial) > AS_NEAR * way(other)
    }

    /// Whether no other effect that could be the cause is worth half as much, but for those that are known to look alike:
    /// that some of them act stands out even where it does not show which.
    fn is_alone(&self, library: &Library, candidate: usize) -> bool {
        let looks_alike = |trial: &&Trial| library.look_alike(candidate, trial.scored.candidate);
        let worth = |trial: &Trial| trial.fitted.as_ref().map(|(_, advantage)| net(advantage, trial.scored.cost));
        let (own, others): (Vec<&Trial>, Vec<&Trial>) =
            self.trials.iter().partition(|trial| trial.scored.candidate == candidate);
        let rivals = others.into_iter().filter(|trial| trial.is_cause() && !looks_alike(trial));
        let next = rivals.filter_map(worth).fold(0.0, f64::max);
        own.into_iter().find_map(worth).is_some_and(|own| next < 0.5 * own)
    }
}
