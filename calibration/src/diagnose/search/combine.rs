//! Which effects act together: effects are added while clips are predicted better with them, and dropped or swapped when they are
//! not needed any more.

use super::by_engine::by_engine;
use super::refit::{last_pass, refitted, without_superfluous};
use crate::diagnose::criteria::JOINTS_EXCESS_BESIDE_A_CAUSE;
use crate::diagnose::fit::anchored::Anchored;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{FIRST_PASS, HEAT, NEAR};
use crate::diagnose::fit::floor;
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::fit::stages;
use crate::diagnose::fit::undetermined;
use crate::diagnose::judge::gap::{Residuals, Typical};
use crate::diagnose::judge::remainder::Left;
use crate::diagnose::judge::score::predict;
use crate::diagnose::judge::trial::{Found, Step, Trial};
use crate::diagnose::propose::screening::{arm_gap_is_open, overlooked, seen_at_the_least_scatter, to_fit};
use crate::diagnose::propose::signatures;
use crate::diagnose::propose::starts;
use crate::words::words;
use inference::admit::Split;
use inference::likelihood::{Evidence, Group, Row};
use shared_mem::progress::Progress;

/// At most so many effects are named.
pub const MOST: usize = 4;
/// So many places of a patch are fitted to the end.
const LAST_PLACES: usize = 3;
/// So often at most a search begins anew from a better fit of what its step extends.
const ANEW: usize = 2;
/// Near the best deviance is within [`NEAR`] of it, or within this share of what the best gains.
const NEAR_SHARE: f64 = 0.4;
/// Engines integrate one and the same effect differently by a hundredth of it, so by this share of the squared gap.
const NUMERICS_SHARE: f64 = 1e-4;

/// Searches from a baseline; `refined` gives numbers whose object is found anew under the effects in them, where there is
/// one. Strokes that another program simulates are looked at around what each step extends; what is extended, and what
/// is found, is fitted to that program itself.
pub fn search<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    baseline: Hypothesis,
    refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
    bar: &Progress,
) -> Option<Found> {
    let mut steps: Vec<Step> = Vec::new();
    let mut now = baseline;
    let mut begun_anew = 0;
    loop {
        let around = Anchored::new(bench.evidence, &now.full);
        let near = &around.bench(bench);
        if let Some(first) = steps.first().filter(|first| spent(near, split, first, &now)) {
            let last = untried(near, split, &now, Some(first))?;
            now = last.from.clone();
            steps.push(last);
            break;
        }
        let step = step(near, split, (&now, steps.first().map(|first| &first.left)), refined, bar);
        let Some(mut step) = step else {
            // Cut short by its budget: what was found before stands.
            let stands = if bench.interrupt.spent() { untried(near, split, &now, steps.first()) } else { None };
            let last = stands?;
            now = last.from.clone();
            steps.push(last);
            break;
        };
        step.reconsider(near, split, refined);
        if begun_anew < ANEW
            && let Some(nearer) = step.nearer_without(near, split)
        {
            bar.insert(&stages::FURTHER);
            begun_anew += 1;
            now = by_engine(bench, split, nearer, &step.weights);
            continue;
        }
        let best = step.best(near).map(|(_, fit, _)| fit.clone());
        now = step.from.clone();
        let weights = step.weights.clone();
        steps.push(step);
        match best {
            Some(best) if now.effects.len() < MOST && !bench.interrupt.asked() => {
                bar.stage(stages::REFINEMENT, 2);
                if steps.len() > 1 {
                    bar.insert(&stages::FURTHER);
                }
                now = refitted(near, split, (&best, &weights), refined)?;
                bar.show(1, stages::REFINEMENT);
                let step = steps.last_mut()?;
                step.reidentify_rivals(near, split, &now, refined);
                match step.best(near).map(|(_, fit, _)| fit.clone()) {
                    Some(other) if other.effects != now.effects => {
                        now = refitted(near, split, (&other, &weights), refined)?;
                    }
                    Some(_) => {}
                    // Fitted to the end it predicts clips no better than chance: what it did before was the fit's.
                    None => {
                        now = step.from.clone();
                        break;
                    }
                }
                now = by_engine(bench, split, now, &weights);
            }
            // The best so far, as far as it was fitted.
            Some(best) if bench.interrupt.spent() && now.effects.len() < MOST => {
                let last = untried(near, split, &best, steps.first())?;
                now = last.from.clone();
                steps.push(last);
                break;
            }
            _ => break,
        }
    }
    let around = Anchored::new(bench.evidence, &now.full);
    let near = &around.bench(bench);
    let last = undetermined::without(near, &without_superfluous(near, split, now, &steps.last()?.weights));
    Some(Found { steps, last }.by_engine(bench, split))
}

/// Whether the effects found so far leave no more than numerics do: a further one would only name how engines differ. The
/// first effect is never held back by this.
fn spent<E: Evidence>(bench: &Bench<'_, E>, split: &Split, first: &Step, now: &Hypothesis) -> bool {
    let typical = |hypothesis| Residuals::at(bench, hypothesis, split.elsewhere()).map(|left| left.typical());
    let (Some(before), Some(after)) = (typical(&first.from), typical(now)) else { return false };
    Left::of_groups(&before, &after).iter().all(|left| {
        left.after - left.floor <= JOINTS_EXCESS_BESIDE_A_CAUSE.value.max(NUMERICS_SHARE * (left.before - left.floor))
    })
}

/// Sweeps around a hypothesis, scores all candidates, fits the best.
/// `whole`: what the baseline leaves, where `from` is not the baseline itself.
fn step<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    (from, whole): (&Hypothesis, Option<&Vec<Typical>>),
    refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
    bar: &Progress,
) -> Option<Step> {
    let (weights, mut scored, narrow) = signatures::around(bench, split, from, bar)?;
    let from = weighed_anew(bench, split, from, &weights)?;
    let predicted = predict(bench, &from, &split.choose, &weights)?;
    let left = Residuals::at(bench, &from, &split.open()).map(|left| left.typical()).unwrap_or_default();
    let whole = whole.unwrap_or(&left).clone();
    let mut promising = to_fit(bench, &from, &scored, (&whole, &left));
    let seen =
        if arm_gap_is_open(&whole, &left) { Vec::new() } else { seen_at_the_least_scatter(bench, &from, &narrow) };
    for seen in seen {
        if !promising.contains(&seen.candidate) {
            promising.push(seen.candidate);
            scored.iter_mut().filter(|s| s.candidate == seen.candidate).for_each(|s| *s = seen.clone());
        }
    }
    let own_numbers = bench.scatter.count() > 0;
    let trial = |scored: &Scored| Trial { scored: scored.clone(), fitted: None, closes: 0.0, own_numbers };
    let trials = scored.iter().map(trial).collect();
    let mut step = Step { from, predicted, trials, weights, arm_rows: arm_rows(bench, split), left, whole };
    step.fit(bench, split, (&promising, false), refined, bar);
    if step.best(bench).is_none() {
        let rest = overlooked(bench, &step);
        bar.insert(&stages::MORE_FITS);
        step.fit(bench, split, (&rest, true), refined, bar);
    }
    Some(step)
}

/// A step in which nothing is tried: the hypothesis with the weights that it leaves itself. `first`: the first step, where this
/// is not the first.
fn untried<E: Evidence>(bench: &Bench<'_, E>, split: &Split, now: &Hypothesis, first: Option<&Step>) -> Option<Step> {
    let left = Residuals::at(bench, now, &split.train)?;
    let weights = floor::weights(bench.evidence, &left.clips);
    let from = weighed_anew(bench, split, now, &weights)?;
    let predicted = predict(bench, &from, &split.choose, &weights)?;
    let left = Residuals::at(bench, &from, &split.open())?.typical();
    let whole = first.map_or_else(|| left.clone(), |first| first.whole.clone());
    Some(Step { from, predicted, trials: Vec::new(), weights, arm_rows: arm_rows(bench, split), left, whole })
}

/// A hypothesis under other weights: these are numbers that may be printed, so what acts is fitted to the end again.
fn weighed_anew<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    from: &Hypothesis,
    weights: &[f64],
) -> Option<Hypothesis> {
    let effort = if from.effects.is_empty() { FIRST_PASS } else { last_pass(bench) };
    bench.fit((&from.effects, from.full.clone()), &split.train, weights, Some(from), effort)
}

/// How many residuals of the arm the judged clips have.
fn arm_rows<E: Evidence>(bench: &Bench<'_, E>, split: &Split) -> usize {
    let of_arm = |row: &&Row| bench.evidence.channels()[row.channel].group == Group::Arm;
    split.open().iter().map(|clip| bench.evidence.rows(*clip).iter().filter(of_arm).count()).sum()
}

impl Step {
    /// Fits candidates and judges them: all a little, those that come near the best to the end. `overlooked` says that the
    /// score test did not point to them.
    fn fit<E: Evidence>(
        &mut self,
        bench: &Bench<'_, E>,
        split: &Split,
        (wanted, overlooked): (&[usize], bool),
        refined: &impl Fn(&[f64]) -> Option<Vec<f64>>,
        bar: &Progress,
    ) {
        let asked: Vec<usize> =
            (0..self.trials.len()).filter(|k| wanted.contains(&self.trials[*k].scored.candidate)).collect();
        let on_arm = |place: &usize| {
            self.trials[*place].own_numbers
                && bench.library.candidates[self.trials[*place].scored.candidate].is_of_arm()
        };
        let (of_arm, others): (Vec<usize>, Vec<usize>) = asked.into_iter().partition(on_arm);
        let mut fits = self.fitted_to_the_arm_first(bench, split, (&of_arm, overlooked), refined, (bar, others.len()));
        let before = fits.len();
        for (done, place) in others.into_iter().enumerate() {
            if bench.interrupt.asked() {
                return;
            }
            let scored = &self.trials[place].scored;
            let name = words(bench.library.candidates[scored.candidate].effect.name);
            bar.show((before + done) as u64, &format!("{}: {name}", stages::FITS));
            let starts = starts::kept(bench, (&self.from, &self.weights), scored, overlooked);
            let effort = bench.trying(scored.candidate, HEAT);
            let heat = |start| bench.extend(&self.from, (scored.candidate, start), &split.train, &self.weights, effort);
            let mut heats: Vec<Hypothesis> = starts.into_iter().filter_map(heat).collect();
            heats.sort_by(|a, b| a.deviance().total_cmp(&b.deviance()));
            if starts::has_places(bench, scored.candidate) {
                // What lies in the right place may come down later than what stands in for it elsewhere.
                let effort = bench.trying(scored.candidate, FIRST_PASS);
                let to_the_end = |fit: Hypothesis| {
                    let full = fit.full.clone();
                    bench.fit((&fit.effects, full), &split.train, &self.weights, Some(&fit), effort)
                };
                heats = heats.into_iter().take(LAST_PLACES).filter_map(to_the_end).collect();
            }
            fits.extend(heats.into_iter().min_by(|a, b| a.deviance().total_cmp(&b.deviance())).map(|fit| (place, fit)));
        }
        let best = fits.iter().map(|(_, fit)| fit.deviance()).fold(self.from.deviance(), f64::min);
        let near = best + NEAR.max(NEAR_SHARE * (self.from.deviance() - best));
        bar.stage(stages::LAST_FITS, fits.len() as u64);
        for (done, (place, fit)) in fits.into_iter().enumerate() {
            bar.show(done as u64, stages::LAST_FITS);
            let effort = bench.trying(self.trials[place].scored.candidate, FIRST_PASS);
            let more = || bench.fit((&fit.effects, fit.full.clone()), &split.train, &self.weights, Some(&fit), effort);
            let nearer = if fit.deviance() < near { more() } else { None };
            self.judge(bench, split, place, nearer.unwrap_or(fit));
        }
    }
}
