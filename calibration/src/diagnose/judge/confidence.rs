//! How sure a finding is: shares of the evidence among rivals, less what experience with simulated sessions takes off.

use super::trial::{Step, Trial};
use crate::diagnose::criteria::{MOST_OF_IT, NAMED_IS_WRONG};
use crate::diagnose::library::Library;
use crate::diagnose::select::gain::SAME_WORTH_NATS;

/// The largest probability of a candidate: its limit, whatever the clips say.
pub const MAX_PROBABILITY: f64 = 1.0 - NAMED_IS_WRONG.value;

/// Probability of every candidate tried in a step that could be the cause, and what is left for none of them.
pub fn probabilities(trials: &[Trial], none: bool) -> Vec<(usize, f64)> {
    let fitted: Vec<(usize, f64)> = (trials.iter())
        .filter(|trial| trial.is_cause() && !trials.iter().any(|other| other.is_cause() && trial.is_outdone_by(other)))
        .filter_map(|trial| Some((trial.scored.candidate, trial.gain()?.net(trial.scored.cost))))
        .collect();
    let best = fitted.iter().map(|(_, worth)| *worth).fold(0.0, f64::max);
    let weight = |worth: f64| ((worth - best) / SAME_WORTH_NATS).exp();
    let nothing = if none { 1.0 / NAMED_IS_WRONG.value } else { weight(0.0) };
    let total: f64 = fitted.iter().map(|(_, worth)| weight(*worth)).sum::<f64>() + nothing;
    fitted.iter().map(|(candidate, worth)| (*candidate, MAX_PROBABILITY * weight(*worth) / total)).collect()
}

/// Candidates of a step that explain it as well as the chosen one: whose gains, clip by clip, are not less beyond chance, and
/// that close as much of the gap; with more numbers than the chosen one, markedly more of it. Of one that is known to look alike
/// it is enough that it closes a cause's share: how much any of the two closes depends on how far their fits have come.
/// Differences count `overdispersion` times less.
pub fn rivals(step: &Step, library: &Library, chosen: usize, overdispersion: f64) -> Vec<usize> {
    let Some((chosen_trial, best)) = step.trial(chosen).and_then(|trial| Some((trial, trial.gain()?))) else {
        return Vec::new();
    };
    let near = |trial: &&Trial| {
        let candidate = trial.scored.candidate;
        let Some(other) = trial.gain().filter(|_| candidate != chosen) else { return false };
        // What a stage shows by itself has no equal in what it does not show.
        let in_no_stage = chosen_trial.beside_contact.in_a_stage && !trial.beside_contact.in_a_stage;
        let alike = !in_no_stage && best.beyond(other).may_be_none(overdispersion) && other.nats > other.error;
        let dearer = trial.scored.cost > chosen_trial.scored.cost;
        let enough = match dearer {
            true => trial.closes_more_than(chosen_trial),
            false if library.look_alike(candidate, chosen) => trial.is_cause(),
            false => trial.closed.most > MOST_OF_IT * chosen_trial.closed.most,
        };
        alike && enough && step.comes_as_near(trial, chosen_trial)
    };
    step.trials.iter().filter(near).map(|trial| trial.scored.candidate).collect()
}

#[cfg(test)]
mod tests {
    use super::super::closing::Closed;
    use super::super::score::Predicted;
    use super::*;

    use crate::diagnose::fit::bench::{FittedClip, Hypothesis};
    use crate::diagnose::fit::shortlist::Scored;
    use crate::diagnose::fit::sweep::Reduced;
    use crate::diagnose::ground::Ground;
    use crate::diagnose::test_bench::shipped;
    use inference::likelihood::random_effects_scale::Around;
    use inference::likelihood::setting;
    use nalgebra::DMatrix;
    use shared_mem::msg::MAX_JOINTS;
    use std::marker::PhantomData;

    fn trial(candidate: usize, nats: f64, closes: f64) -> Trial {
        let predicted =
            |gain: f64| Predicted { clips: (0..12).map(|clip| (clip, 1000.0 - 2.0 * gain / 12.0)).collect() };
        let (units, next) = (vec![1.0], Vec::new());
        let scored = Scored {
            candidate,
            alternative: 0,
            units,
            next,
            gain: 2.0 * nats,
            cost: 1,
            cosine: 0.5,
            signal: 30.0,
            imitated: 0.1,
            p: 0.0,
        };
        let fit = Hypothesis { effects: vec![candidate], full: Vec::new(), free: Vec::new(), fitted: Vec::new() };
        let fitted = Some((fit, predicted(nats).over(&predicted(0.0))));
        Trial { fitted, closed: Closed::all(closes), ..Trial::untried(scored, true) }
    }

    #[test]
    fn a_candidate_that_closes_nothing_takes_no_probability_however_well_it_predicts() {
        let sure = |trials: &[Trial]| {
            let all = probabilities(trials, false);
            all.iter().find(|(candidate, _)| *candidate == 0).map_or(0.0, |(_, p)| *p)
        };
        let cause = trial(0, 100.0, 0.4);
        assert!((sure(&[cause.clone(), trial(1, 150.0, 0.05)]) - MAX_PROBABILITY).abs() < 1e-6);
        assert!(sure(&[cause.clone(), trial(1, 150.0, 0.4)]) < 0.1, "one that closes as much does");
        let mut dearer = trial(1, 103.0, 0.41);
        dearer.scored.cost = 8;
        assert!(
            (sure(&[cause.clone(), dearer.clone()]) - MAX_PROBABILITY).abs() < 1e-6,
            "one with more numbers does not"
        );
        // ... unless it closes markedly more, where nuisance parameters of clips could hide that from the likelihood.
        dearer.closed = Closed::all(0.5);
        assert!(sure(&[cause.clone(), dearer.clone()]) < 0.6, "one that closes markedly more does");
        dearer.own_numbers = false;
        assert!((sure(&[cause, dearer]) - MAX_PROBABILITY).abs() < 1e-6);
    }

    #[test]
    fn what_is_known_to_look_alike_is_a_rival_however_much_less_its_fit_closes() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let ground = Ground { middle: [0.5, 0.0], spread: 0.1 };
        let library = Library::new(&cell, &base, Some(&ground), &[87.0; MAX_JOINTS]);
        let named = |name| library.find(name).expect("a candidate");
        let [tool, camera, friction] = ["tool_offset", "camera_extrinsic_translation", "table_tilt"].map(named);
        // On every other clip the second predicts better, so that the difference is within chance.
        let as_good = |candidate, closes| {
            let mut other = trial(candidate, 1500.0, closes);
            let gain = |clip: usize| if clip.is_multiple_of(2) { 85.0 } else { 165.0 };
            let predicted = |gain: &dyn Fn(usize) -> f64| Predicted {
                clips: (0..12).map(|c| (c, 1000.0 - 2.0 * gain(c))).collect(),
            };
            if let Some((_, advantage)) = &mut other.fitted {
                *advantage = predicted(&gain).over(&predicted(&|_| 0.0));
            }
            other
        };
        let mut trials = vec![trial(tool, 1530.0, 0.5), as_good(camera, 0.15), as_good(friction, 0.15)];
        assert_eq!(rivals(&step(trials.clone()), &library, tool, 1.0), [camera]);
        trials[0].beside_contact.in_a_stage = true;
        assert!(rivals(&step(trials.clone()), &library, tool, 1.0).is_empty(), "a stage shows the first alone");
        trials[1].beside_contact.in_a_stage = true;
        assert_eq!(rivals(&step(trials), &library, tool, 1.0), [camera]);
    }

    /// A step from what the first trial's fit is.
    fn step(trials: Vec<Trial>) -> Step {
        Step {
            from: trials[0].fitted.as_ref().expect("it is").0.clone(),
            predicted: Predicted { clips: Vec::new() },
            trials,
            weights: Vec::new(),
            arm_rows: 0,
            left: Vec::new(),
            whole: Vec::new(),
        }
    }

    #[test]
    fn what_leaves_most_of_an_arm_s_gap_is_no_equal_of_what_leaves_next_to_nothing() {
        let leaves = |candidate: usize, deviance: f64, own_numbers| {
            let around = Around { gram: DMatrix::zeros(1, 1), own: Vec::new() };
            let reduced = Reduced { form: DMatrix::from_element(1, 1, deviance), volume: 0.0, around };
            let mut leaves = trial(candidate, 100.0, 0.9);
            leaves.own_numbers = own_numbers;
            if let Some((fit, _)) = &mut leaves.fitted {
                fit.fitted = vec![FittedClip { clip: 0, own: Vec::new(), reduced, kind: PhantomData }];
            }
            leaves
        };
        let before = step(vec![leaves(0, 1e6, false)]);
        let all_but_noise = leaves(0, 1e3, false);
        assert!(!before.comes_as_near(&leaves(1, 4e5, false), &all_but_noise), "60 % of the gap, a seventh of the way");
        assert!(before.comes_as_near(&leaves(1, 5e3, false), &all_but_noise));
        assert!(
            before.comes_as_near(&leaves(1, 4e5, true), &all_but_noise),
            "nuisance parameters of clips may hide it"
        );
    }
}
