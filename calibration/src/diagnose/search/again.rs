//! Fits that are made once more from elsewhere once it is known what else was found: a likelihood ratio compares two maxima, and over
//! rough hits there are many. Each of them is one more start of the same fit; only where it begins differs.

use crate::diagnose::criteria::MOST_OF_IT;
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::fit::effort::{NEAR_DEVIANCE, REFINEMENT};
use crate::diagnose::judge::closing::MIN_SHARE_CLOSED;
use crate::diagnose::judge::confidence;
use crate::diagnose::judge::trial::{Found, LARGE_SHARE_CLOSED, Step, Trial};
use crate::diagnose::propose::Search;
use crate::diagnose::propose::screening::MAX_FURTHER;
use crate::diagnose::select::criteria::EFFECTS;

/// The step with its best trial, fitted to the end, held against its nearest rivals once more, each with the object found anew under
/// it: with an object that stands in for part of an effect a fit ends somewhere else than with the right one. What acts on the arm the
/// arm's own channels tell apart, so there only those are rivals that still look alike.
pub(super) fn rivals_refitted(search: &Search<'_>, step: Step, best: &Hypothesis) -> Step {
    let bench = search.bench;
    let added = best.effects.last().and_then(|c| step.trials.iter().position(|t| t.scored.candidate == *c));
    let Some(added) = added.filter(|place| step.trials[*place].own_numbers) else { return step };
    let step = step.with_fits(bench, search.split, [(added, best.clone())]);
    let chosen = step.trials[added].scored.candidate;
    if bench.library.is_of_arm(chosen) {
        let alike = confidence::rivals(&step, bench.library, chosen, 1.0);
        with_object_anew(search, step, |_, trial| alike.contains(&trial.scored.candidate))
    } else {
        let least = MOST_OF_IT * step.trials[added].nats();
        with_object_anew(search, step, |k, trial| {
            k != added && trial.nats() > least && !bench.library.is_of_arm(trial.scored.candidate)
        })
    }
}

/// Where no trial is worth it, those that close much of the gap are given the object anew before they are given up: what
/// stands in for a part of them makes them uncertain.
pub(super) fn reconsidered(search: &Search<'_>, step: Step) -> Step {
    let bench = search.bench;
    if step.best(bench).is_some() || bench.scatter.count() == 0 {
        return step;
    }
    let much = |trial: &Trial| trial.nats() > EFFECTS.min_gain_nats && trial.closed.most > LARGE_SHARE_CLOSED;
    with_object_anew(search, step, |_, trial| much(trial) && !bench.library.is_of_arm(trial.scored.candidate))
}

/// The step with the best of the trials that are `wanted` fitted again, with the object found anew under each.
fn with_object_anew(search: &Search<'_>, step: Step, wanted: impl Fn(usize, &Trial) -> bool) -> Step {
    let bench = search.bench;
    let mut places: Vec<usize> = (0..step.trials.len()).filter(|k| wanted(*k, &step.trials[*k])).collect();
    places.sort_by(|a, b| step.trials[*b].nats().total_cmp(&step.trials[*a].nats()));
    let anew = |place: usize| {
        let (fit, _) = step.trials[place].fitted.as_ref().filter(|_| !bench.interrupt.asked())?;
        let effort = bench.trying(step.trials[place].scored.candidate, REFINEMENT);
        let anew = search.fits(&fit.effects, &step.weights, fit).fit((search.refined)(&fit.full)?, effort)?;
        (anew.deviance() < fit.deviance()).then_some((place, anew))
    };
    let fits: Vec<(usize, Hypothesis)> = places.into_iter().take(MAX_FURTHER).filter_map(anew).collect();
    step.with_fits(bench, search.split, fits)
}

/// What a step extends, from the numbers of its best trial without that trial's effect, where it fits better by more than is near and by
/// such a share of what the trial gains as a cause must close: fits with an effect get a start of their own each, and any effect seems
/// to close what a worse place of the fit without leaves. Only clips with nuisance parameters are as rough as that.
pub(super) fn without_the_best(search: &Search<'_>, step: &Step) -> Option<Hypothesis> {
    let bench = search.bench;
    if bench.scatter.count() == 0 || bench.interrupt.asked() {
        return None;
    }
    let from = &step.from;
    let fits = step.trials.iter().filter_map(|trial| Some((trial.scored.candidate, &trial.fitted.as_ref()?.0)));
    let (candidate, best) = fits.min_by(|(_, a), (_, b)| a.deviance().total_cmp(&b.deviance()))?;
    let full = bench.library.with_effects_of(best.full.clone(), &[candidate], &from.full);
    let without = search.fits(&from.effects, &step.weights, from).fit(full, REFINEMENT)?;
    let gain = from.deviance() - best.deviance();
    (from.deviance() - without.deviance() > NEAR_DEVIANCE.max(MIN_SHARE_CLOSED * gain)).then_some(without)
}

/// A hypothesis at its best by another program that simulates; as it is where the twin does, where that program has no answer, or no time
/// is left.
pub(super) fn by_engine(search: &Search<'_>, fit: Hypothesis, weights: &[f64]) -> Hypothesis {
    if search.bench.evidence.engine().is_none() || search.bench.interrupt.asked() {
        return fit;
    }
    search.onwards(&fit, weights, REFINEMENT).unwrap_or(fit)
}

/// What was found, baseline and result at their best by the engine. The baseline is fitted once more from where the result ended.
pub(super) fn found_by_engine(search: &Search<'_>, mut found: Found) -> Found {
    if search.bench.evidence.engine().is_none() || search.bench.interrupt.asked() {
        return found;
    }
    let Some(last_weights) = found.steps.last().map(|step| step.weights.clone()) else { return found };
    let first = &mut found.steps[0];
    let from = by_engine(search, first.from.clone(), &first.weights);
    if found.last.effects == first.from.effects {
        (first.from, found.last) = (from.clone(), from);
        return found;
    }
    found.last = by_engine(search, found.last, &last_weights);
    let last = &found.last;
    let full = search.bench.library.with_effects_of(last.full.clone(), &last.effects, &from.full);
    let other = search.fits(&from.effects, &first.weights, last).fit(full, REFINEMENT);
    first.from = other.filter(|other| other.deviance() < from.deviance()).unwrap_or(from);
    found
}
