//! Trials that are fitted once more with the object found anew: its parameters were identified without the effect, and
//! stand in for a part of it.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::FIRST_PASS;
use crate::diagnose::judge::confidence;
use crate::diagnose::judge::trial::{LEAST, PLAIN, Step, Trial};
use inference::admit::Split;
use inference::likelihood::Evidence;

/// Rivals of the best that are worth this share of it are fitted again.
const RIVAL: f64 = 0.5;
/// So many trials of a step are.
const TRIED_AGAIN: usize = 2;

impl Step {
    /// Compares the best trial, fitted to the end, with its nearest rivals once more, each with the object found anew under
    /// it: with an object that stands in for part of an effect a fit ends somewhere else than with the right one. What acts on
    /// the arm the arm's own channels tell apart, so there only those are rivals that still look alike.
    pub(in crate::diagnose) fn reidentify_rivals<E: Evidence>(
        &mut self,
        bench: &Bench<'_, E>,
        split: &Split,
        best: &Hypothesis,
        refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
    ) {
        let added = best.effects.last().and_then(|c| self.trials.iter().position(|t| t.scored.candidate == *c));
        let Some(added) = added.filter(|place| self.trials[*place].own_numbers) else { return };
        self.judge(bench, split, added, best.clone());
        let chosen = self.trials[added].scored.candidate;
        if bench.library.candidates[chosen].is_of_arm() {
            let alike = confidence::rivals(self, bench.library, chosen, 1.0);
            self.with_object_anew(bench, split, |_, trial| alike.contains(&trial.scored.candidate), refined);
        } else {
            let least = RIVAL * self.trials[added].nats();
            let near = |k, trial: &Trial| k != added && trial.nats() > least && !of_arm(bench, trial);
            self.with_object_anew(bench, split, near, refined);
        }
    }

    /// Where no trial is worth it, those that close much of the gap are given the object anew before they are given up: what
    /// stands in for a part of them makes them uncertain.
    pub(in crate::diagnose) fn reconsider<E: Evidence>(
        &mut self,
        bench: &Bench<'_, E>,
        split: &Split,
        refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
    ) {
        if self.best(bench).is_none() && bench.scatter.count() > 0 {
            let much = |_, trial: &Trial| trial.nats() > LEAST && trial.closes > PLAIN && !of_arm(bench, trial);
            self.with_object_anew(bench, split, much, refined);
        }
    }

    /// Fits the best of the trials that are `wanted` again, with the object found anew under each.
    fn with_object_anew<E: Evidence>(
        &mut self,
        bench: &Bench<'_, E>,
        split: &Split,
        wanted: impl Fn(usize, &Trial) -> bool,
        refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
    ) {
        let mut places: Vec<usize> = (0..self.trials.len()).filter(|k| wanted(*k, &self.trials[*k])).collect();
        places.sort_by(|a, b| self.trials[*b].nats().total_cmp(&self.trials[*a].nats()));
        for place in places.into_iter().take(TRIED_AGAIN) {
            if bench.interrupt.asked() {
                return;
            }
            let Some((fit, _)) = self.trials[place].fitted.clone() else { continue };
            let effort = bench.trying(self.trials[place].scored.candidate, FIRST_PASS);
            let from = |full| bench.fit((&fit.effects, full), &split.train, &self.weights, Some(&fit), effort);
            let anew = refined(&fit.full).and_then(from).filter(|anew| anew.deviance() < fit.deviance());
            if let Some(anew) = anew {
                self.judge(bench, split, place, anew);
            }
        }
    }
}

fn of_arm<E>(bench: &Bench<'_, E>, trial: &Trial) -> bool {
    bench.library.candidates[trial.scored.candidate].is_of_arm()
}
