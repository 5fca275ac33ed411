//! Which effects act together: effects are added while that foretells clips better, and dropped or swapped when they are
//! not needed any more.

use super::evidence::Evidence;
use super::fit::{Bench, Effort, Hypothesis};
use super::floor;
use super::gap::Residuals;
use super::leftovers::NUMERICS;
use super::score::{Advantage, Foretold, foretell};
use super::shortlist::{self, Scored};
use super::split::Split;
use super::sweep::{Point, Precision, Swept, sweep};
use crate::progress::Progress;
use nalgebra::DMatrix;
use std::sync::atomic::{AtomicUsize, Ordering};

/// At most so many effects are named.
pub const MOST: usize = 4;
/// So many candidates are fitted at each step.
const FITTED: usize = 5;
/// A fit from a candidate's signature gets so many linearisations, and the winner so many more.
const FIRST_PASS: Effort = Effort { iterations: 6, precision: Precision::Joints };
const LAST_PASS: Effort = Effort { iterations: 6, precision: Precision::Exact };
/// A new effect must be worth at least this [nats], more than twice its error, and more than its numbers cost.
const LEAST: f64 = 4.0;
/// ... and explain this share of what is left.
const WORTHWHILE: f64 = 0.005;
/// Candidates whose signature explains less than this share of what the best one does are not fitted.
const CLOSE: f64 = 0.1;

/// Engines integrate one and the same effect differently by a hundredth of it, so by this share of the squared gap.
const NUMERICS_SHARE: f64 = 1e-4;

/// A candidate tried on top of a hypothesis.
#[derive(Debug, Clone)]
pub struct Trial {
    /// What the score test said.
    pub scored: Scored,
    /// Fitted, where that was worth it.
    pub fitted: Option<(Hypothesis, Advantage)>,
}

/// One step of the search.
#[derive(Debug, Clone)]
pub struct Step {
    /// What was extended.
    pub from: Hypothesis,
    /// How it foretells.
    pub foretold: Foretold,
    /// All candidates, best first by the score test.
    pub trials: Vec<Trial>,
    /// Weights of the channels in this step.
    pub weights: Vec<f64>,
}

/// What the search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Every step; the first extends the baseline.
    pub steps: Vec<Step>,
    /// The hypothesis at the end.
    pub last: Hypothesis,
}

/// Whether an advantage is enough for `cost` more numbers.
#[must_use]
pub fn convincing(advantage: &Advantage, cost: usize) -> bool {
    let price = LEAST.max(cost as f64);
    advantage.nats > price && advantage.nats > 2.0 * advantage.error
}

/// Advantage less what numbers gain by chance: what trials are ranked by.
#[must_use]
pub fn net(advantage: &Advantage, cost: usize) -> f64 {
    advantage.nats - 0.5 * cost as f64
}

/// Searches from a baseline.
pub fn search<E: Evidence>(bench: &Bench<'_, E>, split: &Split, baseline: Hypothesis, bar: &Progress) -> Option<Found> {
    let mut steps: Vec<Step> = Vec::new();
    let mut now = baseline;
    loop {
        let step = step(bench, split, &now, bar)?;
        let best = step.best(bench).map(|(_, fit, _)| fit.clone());
        now = step.from.clone();
        let weights = step.weights.clone();
        steps.push(step);
        match best {
            Some(best) if now.effects.len() < MOST && !bench.interrupt.asked() && !spent(bench, split, &steps) => {
                now = bench.fit(
                    (&best.effects, best.full.clone()),
                    &split.train,
                    &weights,
                    Some(&best),
                    last_pass(bench),
                )?;
            }
            _ => break,
        }
    }
    let last = without_superfluous(bench, split, now, &steps.last()?.weights);
    Some(Found { steps, last })
}

/// Whether the effects found so far leave no more than numerics do: a further one would only name how engines differ. The
/// first effect is never held back by this.
fn spent<E: Evidence>(bench: &Bench<'_, E>, split: &Split, steps: &[Step]) -> bool {
    let [first, .., now] = steps else { return false };
    let groups = |step: &Step| Residuals::at(bench, &step.from, &split.choose, &now.weights).map(|left| left.groups());
    let (Some(before), Some(after)) = (groups(first), groups(now)) else { return false };
    before.iter().zip(&after).all(|(before, after)| after - 1.0 <= NUMERICS.max(NUMERICS_SHARE * (before - 1.0)))
}

impl Step {
    /// The trial that is worth most among those worth it.
    #[must_use]
    pub fn best<E: Evidence>(&self, bench: &Bench<'_, E>) -> Option<(&Trial, &Hypothesis, &Advantage)> {
        (self.trials.iter())
            .filter_map(|trial| trial.fitted.as_ref().map(|(fit, advantage)| (trial, fit, advantage)))
            .filter(|(trial, _, advantage)| convincing(advantage, trial.scored.cost))
            .filter(|(_, _, advantage)| 2.0 * advantage.nats > WORTHWHILE * self.foretold.deviance())
            .filter(|(trial, fit, _)| !bench.negligible(trial.scored.candidate, &fit.full))
            .max_by(|a, b| net(a.2, a.0.scored.cost).total_cmp(&net(b.2, b.0.scored.cost)))
    }
}

/// Clips with an object take a simulation for each number of their own; joints one by one besides would take too long.
fn last_pass<E: Evidence>(bench: &Bench<'_, E>) -> Effort {
    if bench.random.is_empty() { LAST_PASS } else { Effort { precision: Precision::Joints, ..LAST_PASS } }
}

/// Drops effects that the others make superfluous, one after the other.
fn without_superfluous<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    mut now: Hypothesis,
    weights: &[f64],
) -> Hypothesis {
    while now.effects.len() > 1 && !bench.interrupt.asked() {
        let Some(whole) = foretell(bench, &now, &split.choose, weights) else { break };
        let dropped = now.effects.iter().find_map(|effect| {
            let others: Vec<usize> = now.effects.iter().copied().filter(|other| other != effect).collect();
            let mut full = now.full.clone();
            let candidate = &bench.library.candidates[*effect];
            candidate.numbers.clone().for_each(|k| full[k] = bench.library.unknowns[k].start);
            let fit = bench.fit((&others, full), &split.train, weights, Some(&now), FIRST_PASS)?;
            let less = foretell(bench, &fit, &split.choose, weights)?;
            let cost = candidate.alternatives[0].probes.len();
            (!convincing(&whole.over(&less), cost)).then_some(fit)
        });
        match dropped {
            Some(fit) => now = fit,
            None => break,
        }
    }
    now
}

/// Sweeps around a hypothesis, scores all candidates, fits the best.
fn step<E: Evidence>(bench: &Bench<'_, E>, split: &Split, from: &Hypothesis, bar: &Progress) -> Option<Step> {
    let swept = swept(bench, split, from, bar)?;
    let mut weights = vec![1.0; bench.evidence.channels().len()];
    // Weights depend on what the richest hypothesis leaves, and that on the weights: twice is enough.
    for _ in 0..2 {
        let left = floor::richest_residuals(&swept, bench.evidence, bench.library, &weights);
        weights = floor::weights(bench.evidence, &left);
    }
    let size = 1 + swept.columns.len();
    let sum =
        swept.reduced(bench.evidence, &weights).iter().fold(DMatrix::zeros(size, size), |sum, clip| sum + &clip.form);
    let scored = shortlist::score(&swept, &sum, bench.library);
    drop(swept);
    let from = bench.fit((&from.effects, from.full.clone()), &split.train, &weights, Some(from), FIRST_PASS)?;
    let foretold = foretell(bench, &from, &split.choose, &weights)?;
    let worthy = worthy(bench, &from, &scored);
    let mut trials = Vec::with_capacity(scored.len());
    for scored in scored {
        bar.show(50 + (trials.len() as u64 * 5).min(45), bench.library.candidates[scored.candidate].effect.name);
        let wanted = worthy.contains(&scored.candidate) && !bench.interrupt.asked();
        let fit = if wanted { bench.extend(&from, &scored, &split.train, &weights, FIRST_PASS) } else { None };
        let judged = fit.and_then(|fit| {
            let ahead = foretell(bench, &fit, &split.choose, &weights)?;
            Some((fit, ahead.over(&foretold)))
        });
        trials.push(Trial { scored, fitted: judged });
    }
    Some(Step { from, foretold, trials, weights })
}

/// Candidates worth a fit: those that the score test cannot rule out, the best first; of the others only partners that the
/// best is easily taken for.
fn worthy<E: Evidence>(bench: &Bench<'_, E>, from: &Hypothesis, scored: &[Scored]) -> Vec<usize> {
    let Some(best) = scored.first() else { return Vec::new() };
    let likely = |s: &&Scored| {
        let visible = !bench.negligible(s.candidate, &bench.begun(from.full.clone(), s));
        s.p < 0.2 && s.gain > CLOSE * best.gain && visible
    };
    let partners = bench.library.candidates[best.candidate].effect.confusable_with;
    let name = |s: &Scored| bench.library.candidates[s.candidate].effect.name;
    let first = scored.iter().filter(likely).take(FITTED);
    let confusable =
        scored.iter().filter(|s| partners.contains(&name(s)) && s.p < 0.2 && s.gain > 0.5 * CLOSE * best.gain);
    first.chain(confusable).map(|s| s.candidate).collect()
}

fn swept<E: Evidence>(bench: &Bench<'_, E>, split: &Split, from: &Hypothesis, bar: &Progress) -> Option<Swept> {
    let count = bench.random.len();
    let clips: Vec<(usize, Vec<f64>)> = split.train.iter().map(|clip| (*clip, from.own(*clip, count))).collect();
    let probed: Vec<usize> = (0..bench.library.candidates.len()).filter(|k| !from.effects.contains(k)).collect();
    let point =
        Point { full: &from.full, free: &from.free, probed: &probed, clips: &clips, precision: Precision::Joints };
    let done = AtomicUsize::new(0);
    let told = || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        bar.show((50 * done / clips.len()) as u64, "signatures");
    };
    sweep(bench.evidence, bench.library, &point, &bench.random, &told).ok()
}
