//! Which effects act together: effects are added while clips are predicted better with them, and dropped or swapped when they are
//! not needed any more.
//!
//! Strokes that another program simulates are looked at around what each step extends (`Anchored`); what is extended, and what is found,
//! is fitted to that program itself.

use super::again::{by_engine, found_by_engine, reconsidered, rivals_refitted, without_the_best};
use super::in_stages;
use super::refit::{fewer, refitted};
use crate::answer::diagnosis::SensorGap;
use crate::diagnose::criteria::{JOINTS_EXCESS_BESIDE_A_CAUSE, OBJECT_EXCESS};
use crate::diagnose::fit::anchored::Anchored;
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::fit::effort::{NEAR_DEVIANCE, PROBE, REFINEMENT, SCREENING};
use crate::diagnose::fit::shortlist::{MAX_FORMS, Scored};
use crate::diagnose::fit::{floor, stages, undetermined};
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::score::predict;
use crate::diagnose::judge::trial::{BesideContact, Found, Step, Trial};
use crate::diagnose::propose::screening::{arm_gap_is_open, overlooked, seen_at_the_least_scatter, to_fit};
use crate::diagnose::propose::starts;
use crate::diagnose::propose::{Around, Search, arm_alone, signatures};
use crate::diagnose::select::criteria::EFFECTS;
use crate::diagnose::select::forward::{Selection, backward, forward};
use inference::likelihood::{Group, Row};
use twin::effects::Stage;

/// So often at most the steps of a search are begun anew from a better fit of what they extend (a choice).
const MAX_RESTARTS: usize = 2;
/// A fit is near the best within [`NEAR_DEVIANCE`] of its deviance, or within this share of what the best gains (a choice).
const NEAR_SHARE: f64 = 0.4;
/// Engines integrate one and the same effect differently by a hundredth of it, so by this share of the squared gap.
const NUMERICS_OF_GAP: f64 = 1e-4;

/// Searches from a baseline.
pub(super) fn search(search: &Search<'_>, baseline: Hypothesis) -> Option<Found> {
    let selected = forward(search, baseline)?;
    let around = Anchored::new(search.bench.evidence, &selected.last.full);
    let anchored = around.bench(search.bench);
    let steps: Vec<Step> = selected.steps.into_iter().map(|tried| tried.step).collect();
    let (near, weights) = (&search.on(&anchored), &steps.last()?.weights);
    let last = undetermined::without(near.bench, &backward(selected.last, |now| fewer(near, now, weights)));
    Some(found_by_engine(search, Found { steps, last }))
}

/// A step, and how often it was begun anew.
pub(in crate::diagnose) struct Attempt {
    step: Step,
    restarts: usize,
}

impl Selection for Search<'_> {
    type Model = Hypothesis;
    type Step = Attempt;

    fn step(&self, now: &Hypothesis, before: &[Attempt]) -> Option<(Attempt, Option<Hypothesis>)> {
        let first = before.first().map(|tried| &tried.step);
        let before_that: usize = before.iter().map(|tried| tried.restarts).sum();
        let mut from = now.clone();
        let mut worse: Vec<usize> = Vec::new();
        for restarts in 0.. {
            let ended = |step| (Attempt { step, restarts }, None);
            let around = Anchored::new(self.bench.evidence, &from.full);
            let bench = around.bench(self.bench);
            let near = &self.on(&bench);
            if first.is_some_and(|first| is_spent(near, first, &from)) {
                return untried(near, &from, first).map(ended);
            }
            if first.is_some() || restarts > 0 {
                self.bar.insert(&stages::OF_A_STEP);
            }
            let Some(step) = tried(near, &from, (first, &worse)) else {
                // Cut short by its budget: what was found before stands.
                let stands = if self.bench.interrupt.spent() { untried(near, &from, first) } else { None };
                return stands.map(ended);
            };
            let step = reconsidered(near, step);
            let better = if before_that + restarts < MAX_RESTARTS { without_the_best(near, &step) } else { None };
            let Some(better) = better else {
                let (step, extended) = extended(near, step)?;
                let extended = extended.map(|fit| by_engine(self, fit, &step.weights));
                return Some((Attempt { step, restarts }, extended));
            };
            worse = step.worse_by_more_than_chance();
            from = by_engine(self, better, &step.weights);
        }
        None
    }

    fn extends(tried: &Attempt) -> &Hypothesis {
        &tried.step.from
    }
}

/// What a step extends with the best of its trials, both fitted to the end beside its nearest rivals; `None` as the second where none is
/// worth it.
fn extended(search: &Search<'_>, step: Step) -> Option<(Step, Option<Hypothesis>)> {
    let best = |step: &Step| step.best(search.bench).map(|(_, fit, _)| fit.clone());
    let Some(fit) = best(&step).filter(|_| step.from.effects.len() < EFFECTS.max_extensions) else {
        return Some((step, None));
    };
    // The best so far, as far as it was fitted.
    if search.bench.interrupt.asked() {
        return Some((step, Some(fit)));
    }
    search.bar.stage(stages::REFINEMENT, 2);
    let to_the_end = refitted(search, &fit, &step.weights)?;
    search.bar.show(1, stages::REFINEMENT);
    let step = rivals_refitted(search, step, &to_the_end);
    let extended = match best(&step) {
        Some(other) if other.effects != to_the_end.effects => Some(refitted(search, &other, &step.weights)?),
        Some(_) => Some(to_the_end),
        // Fitted to the end it predicts clips no better than chance: what it did before was the fit's.
        None => None,
    };
    Some((step, extended))
}

/// Whether the effects found so far leave no more than numerics do: a further one would only name how engines differ. The
/// first effect is never held back by this.
fn is_spent(search: &Search<'_>, first: &Step, now: &Hypothesis) -> bool {
    let typical =
        |hypothesis| Residuals::at(search.bench, hypothesis, search.split.elsewhere()).map(|left| left.typical());
    let (Some(before), Some(after)) = (typical(&first.from), typical(now)) else { return false };
    SensorGap::of_groups(&before, &after).iter().all(|left| {
        let numerics = if left.of_object() { OBJECT_EXCESS } else { JOINTS_EXCESS_BESIDE_A_CAUSE };
        left.after - left.floor <= numerics.value.max(NUMERICS_OF_GAP * (left.before - left.floor))
    }) && in_stages::shown(search, &now.full).is_empty()
}

/// Sweeps around a hypothesis, scores all candidates, fits the best. `first`: the first step, where this is not the first; `worse`:
/// candidates with which clips were predicted worse around a hypothesis that fitted less well than this one.
fn tried(search: &Search<'_>, from: &Hypothesis, (first, worse): (Option<&Step>, &[usize])) -> Option<Step> {
    let bench = search.bench;
    let (weights, mut scored, narrow) = signatures::around(bench, search.split, from, search.bar)?;
    let step = begun(search, from, weights, first)?;
    let mut promising = to_fit(bench, &step.from, &scored, &step.whole, &step.left);
    let closed = !arm_gap_is_open(&step.whole, &step.left);
    for seen in closed.then(|| seen_at_the_least_scatter(bench, &step.from, &narrow)).into_iter().flatten() {
        if !promising.contains(&seen.candidate) {
            promising.push(seen.candidate);
            scored.iter_mut().filter(|s| s.candidate == seen.candidate).for_each(|s| *s = seen.clone());
        }
    }
    promising.retain(|candidate| !worse.contains(candidate));
    let own_numbers = bench.scatter.count() > 0;
    // What a stage shows by itself is fitted whatever slopes of roll-outs say.
    let shown = in_stages::shown(search, &step.from.full);
    promising.extend(shown.iter().map(|shown| shown.candidate));
    promising.sort_unstable();
    promising.dedup();
    let trial = |scored: Scored| {
        let of_camera = own_numbers && bench.library.candidates[scored.candidate].effect.stage == Stage::Camera;
        let beside_contact = BesideContact { of_camera, in_a_stage: false };
        Trial { beside_contact, ..Trial::untried(scored, own_numbers) }
    };
    let trials = scored.into_iter().map(trial).collect();
    let step = in_stages::compared(search, fitted(search, Step { trials, ..step }, &promising, false), &shown);
    if step.best(bench).is_some() {
        return Some(step);
    }
    let rest: Vec<usize> = overlooked(bench, &step).into_iter().filter(|rest| !worse.contains(rest)).collect();
    search.bar.insert(&[stages::FITS, stages::LAST_FITS]);
    Some(fitted(search, step, &rest, true))
}

/// A step in which nothing is tried: the hypothesis with the weights that it leaves itself.
fn untried(search: &Search<'_>, now: &Hypothesis, first: Option<&Step>) -> Option<Step> {
    let left = Residuals::at(search.bench, now, &search.split.train)?;
    begun(search, now, floor::weights(search.bench.evidence, &left.clips), first)
}

/// A step before anything is tried. Under these weights the hypothesis may be printed, so what acts is fitted to the end again.
fn begun(search: &Search<'_>, from: &Hypothesis, weights: Vec<f64>, first: Option<&Step>) -> Option<Step> {
    let (bench, split) = (search.bench, search.split);
    let effort = if from.effects.is_empty() { REFINEMENT } else { search.last_pass() };
    let from = search.onwards(from, &weights, effort)?;
    let predicted = predict(bench, &from, &split.choose, &weights)?;
    let left = Residuals::at(bench, &from, &split.searched()).map(|left| left.typical()).unwrap_or_default();
    let whole = first.map_or_else(|| left.clone(), |first| first.whole.clone());
    let of_arm = |row: &&Row| bench.evidence.channels()[row.channel].group == Group::Arm;
    let arm_rows = split.searched().iter().map(|clip| bench.evidence.rows(*clip).iter().filter(of_arm).count()).sum();
    Some(Step { from, predicted, trials: Vec::new(), weights, arm_rows, left, whole })
}

/// The step with candidates fitted and judged: all a little, those that come near the best to the end. `overlooked` says that the
/// score test did not point to them.
fn fitted(search: &Search<'_>, step: Step, wanted: &[usize], overlooked: bool) -> Step {
    let (bench, split) = (search.bench, search.split);
    let asked = (0..step.trials.len()).filter(|k| wanted.contains(&step.trials[*k].scored.candidate));
    let on_arm = |place: &usize| {
        let trial = &step.trials[*place];
        trial.own_numbers && bench.library.is_of_arm(trial.scored.candidate)
    };
    let (of_arm, others): (Vec<usize>, Vec<usize>) = asked.partition(on_arm);
    // For the bar: one that is looked at and fitted to the end from many places counts as so many.
    let steps = |place: &usize| {
        let candidate = &bench.library.candidates[step.trials[*place].scored.candidate];
        if starts::has_many_minima(candidate) { 2 * MAX_FORMS as u64 } else { 1 }
    };
    let mut fits = arm_alone::fitted(search, &step, &of_arm, overlooked, others.iter().map(steps).sum());
    let mut done = fits.len() as u64;
    for place in others {
        if bench.interrupt.asked() {
            return step;
        }
        let candidate = step.trials[place].scored.candidate;
        let label = stages::of(stages::FITS, bench.library.name(candidate));
        search.bar.show(done, &label);
        done += steps(&place);
        fits.extend(a_little(search, &step, place, overlooked).map(|fit| (place, fit)));
    }
    let best = fits.iter().map(|(_, fit)| fit.deviance()).fold(step.from.deviance(), f64::min);
    let near = best + NEAR_DEVIANCE.max(NEAR_SHARE * (step.from.deviance() - best));
    search.bar.stage(stages::LAST_FITS, fits.len() as u64);
    let to_the_end = |(done, (place, fit)): (usize, (usize, Hypothesis))| {
        search.bar.show(done as u64, stages::LAST_FITS);
        let effort = bench.trying(step.trials[place].scored.candidate, REFINEMENT);
        let nearer = if fit.deviance() < near { search.onwards(&fit, &step.weights, effort) } else { None };
        (place, nearer.unwrap_or(fit))
    };
    let fits: Vec<(usize, Hypothesis)> = fits.into_iter().enumerate().map(to_the_end).collect();
    step.with_fits(bench, split, fits)
}

/// A few steps of a candidate's fit, from wherever it may begin.
fn a_little(search: &Search<'_>, step: &Step, place: usize, overlooked: bool) -> Option<Hypothesis> {
    let (bench, scored) = (search.bench, &step.trials[place].scored);
    let effects = [&step.from.effects[..], &[scored.candidate]].concat();
    let fits = search.fits(&effects, &step.weights, &step.from);
    let starts = starts::kept(&Around { bench, from: &step.from, weights: &step.weights }, scored, overlooked);
    let effort = bench.trying(scored.candidate, SCREENING);
    if !starts::has_many_minima(&bench.library.candidates[scored.candidate]) {
        return fits.best(starts, effort);
    }
    // One look at all, and several to the end.
    fits.best_further(
        starts,
        bench.trying(scored.candidate, PROBE),
        MAX_FORMS,
        bench.trying(scored.candidate, REFINEMENT),
    )
}
