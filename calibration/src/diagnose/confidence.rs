//! How sure a finding is: shares of the evidence among rivals, less what experience with simulated sessions takes off.

use super::combine::{Step, net};

/// Rivals this close cannot be told apart [nats].
const NEAR: f64 = 4.0;
/// ... or within so many standard errors of their difference.
const CHANCE: f64 = 1.5;
/// A rival closes at least this share of the gap that the chosen one closes.
const ALIKE: f64 = 0.5;
/// ... and one that has more numbers for it this much more of the gap: what own numbers of clips hide from the likelihood.
const MORE: f64 = 0.04;
/// What is kept for causes outside the library even where everything fits; from the simulated sessions on which this was
/// measured: of named findings this share was wrong.
const NONE_OF_THESE: f64 = 0.04;
/// Nats count less than they say: twins are never exact. The temperature that made shares agree with frequencies.
const TEMPERATURE: f64 = 4.0;

/// Probability of every candidate of a step that it is the one to add, and what is left for none of them.
#[must_use]
pub fn probabilities(step: &Step, none: bool) -> Vec<(usize, f64)> {
    let fitted: Vec<(usize, f64)> = (step.trials.iter())
        .filter_map(|trial| trial.fitted.as_ref().map(|(_, a)| (trial.scored.candidate, net(a, trial.scored.cost))))
        .collect();
    let best = fitted.iter().map(|(_, worth)| *worth).fold(0.0, f64::max);
    let weight = |worth: f64| ((worth - best) / TEMPERATURE).exp();
    let nothing = if none { 1.0 / NONE_OF_THESE } else { weight(0.0) };
    let total: f64 = fitted.iter().map(|(_, worth)| weight(*worth)).sum::<f64>() + nothing;
    fitted.iter().map(|(candidate, worth)| (*candidate, (1.0 - NONE_OF_THESE) * weight(*worth) / total)).collect()
}

/// Candidates of a step that explain it as well as the chosen one: whose gains, clip by clip, are not less beyond chance, and
/// that close as much of the gap; with more numbers than the chosen one, markedly more of it.
#[must_use]
pub fn rivals(step: &Step, chosen: usize) -> Vec<usize> {
    let of = |candidate: usize| {
        let trial = step.trials.iter().find(|trial| trial.scored.candidate == candidate)?;
        trial.fitted.as_ref().map(|(_, advantage)| (advantage, trial))
    };
    let Some((best, chosen_trial)) = of(chosen) else { return Vec::new() };
    let near = |candidate: &usize| {
        let Some((other, trial)) = of(*candidate).filter(|_| *candidate != chosen) else { return false };
        let (beyond, error) = best.beyond(other);
        let alike = beyond < NEAR.max(CHANCE * error) && other.nats > other.error;
        let dearer = trial.scored.cost > chosen_trial.scored.cost;
        let enough = if dearer { chosen_trial.closes + MORE } else { ALIKE * chosen_trial.closes };
        alike && trial.closes > enough
    };
    step.trials.iter().map(|trial| trial.scored.candidate).filter(near).collect()
}
