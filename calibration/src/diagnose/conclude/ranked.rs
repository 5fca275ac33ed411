//! What is said of every candidate: how likely it is, how much it shrinks the gap, and what became of it. `reason.rs`
//! says why.

use super::Case;
use super::decide::Decided;
use super::measure::Measures;
use super::reason::{Judged, reason};
use crate::answer::diagnosis::{Candidate, Kind, Share, Status};
use crate::diagnose::fit::bench::Bench;
use crate::diagnose::fit::shortlist::TESTABLE;
use crate::diagnose::fit::{parameters, time_step};
use crate::diagnose::judge::confidence;
use crate::diagnose::judge::gap::{Residuals, SHRINK_OF_A_DOUBLED_GAP};
use crate::diagnose::judge::held_out::estimated;
use crate::diagnose::judge::trial::{Found, Step, Trial};
use crate::diagnose::propose::screening;

/// Of numbers with which the twin has no answer in clips that they were not fitted to.
const NO_ANSWER: Share = Share { value: SHRINK_OF_A_DOUBLED_GAP, ci90: [SHRINK_OF_A_DOUBLED_GAP; 2] };

/// What is said of every candidate: what was named first, then what is possible, then the likelier.
pub(super) fn candidates(case: &Case<'_>, measures: &Measures, decided: &Decided<'_>, kind: Kind) -> Vec<Candidate> {
    let Case { bench, split, .. } = *case;
    let (found, before) = (decided.found(case), &measures.without.held_out.left);
    let first = &found.steps[0];
    let last = found.steps.last().filter(|_| !found.last.effects.is_empty());
    let of_step = |step: &Step| match step.from.effects.is_empty() {
        true => Some(before.clone()),
        false => estimated(bench, split, &step.from),
    };
    let drawn_from = DrawnFrom {
        case,
        measures,
        decided,
        kind,
        found,
        believed: matches!(kind, Kind::Named | Kind::Class),
        likely: confidence::probabilities(&first.trials, found.last.effects.is_empty()),
        time_step: last
            .and_then(|last| time_step::error(bench, &decided.with(measures).of_all, &last.weights))
            .unwrap_or_default(),
        left: found.steps.iter().map(of_step).collect(),
    };
    let mut all: Vec<Candidate> = first.trials.iter().map(|trial| drawn_from.said_of(trial)).collect();
    all.sort_by(|a, b| {
        let key = |c: &Candidate| (c.status != Status::Named, c.status != Status::Possible, -c.probability);
        key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
    });
    all
}

/// What is said of a candidate is drawn from this.
struct DrawnFrom<'a> {
    case: &'a Case<'a>,
    measures: &'a Measures,
    decided: &'a Decided<'a>,
    kind: Kind,
    found: &'a Found,
    believed: bool,
    /// How likely each candidate is.
    likely: Vec<(usize, f64)>,
    /// How far the twin's time step moves the numbers of the last hypothesis.
    time_step: Vec<f64>,
    /// What every step left: the baseline is known, and others are what their candidates are measured from.
    left: Vec<Option<Residuals>>,
}

impl DrawnFrom<'_> {
    /// `trial`: that of the first step.
    fn said_of(&self, trial: &Trial) -> Candidate {
        let Self { case, measures, found, kind, .. } = *self;
        let (bench, finding) = (case.bench, &self.decided.finding);
        let (before, with) = (&measures.without.held_out.left, self.decided.with(measures));
        let effect = trial.scored.candidate;
        let name = case.name(effect);
        let kept = self.believed && found.last.effects.contains(&effect);
        let place = judged_in(found, effect, self.believed);
        let step = &found.steps[place];
        let trial = step.trial(effect).unwrap_or(trial);
        let left = match &trial.fitted {
            _ if kept => after_keeping(found, &self.left, &with.held_out.left, place),
            Some((fit, _)) => estimated(bench, case.split, fit),
            None => None,
        };
        let closed = left.as_ref().zip(self.left[place].as_ref());
        let shrink = closed.map(|(left, from)| left.shrink_added(from, before, case.options.seed));
        let shrink = shrink.unwrap_or(if trial.fitted.is_some() { NO_ANSWER } else { Share::default() });
        let beside: Vec<&str> = step.from.effects.iter().map(|effect| case.name(*effect)).collect();
        let fit = if kept { Some(&with.of_all) } else { trial.fitted.as_ref().map(|(fit, _)| fit) };
        let time_step = if kept { &self.time_step[..] } else { &[] };
        let probability = self.likely.iter().find(|(candidate, _)| *candidate == effect).map_or(0.0, |(_, p)| *p);
        let hidden = is_hidden_by_the_arm(bench, step, trial);
        let status = match kind {
            Kind::Named if kept => Status::Named,
            Kind::Class if kept || finding.rivals.contains(&name) => Status::Possible,
            _ if hidden || trial.scored.signal < TESTABLE => Status::NotTestable,
            _ => Status::RuledOut,
        };
        let times_noise = left.as_ref().map(|left| (left.mean_square() / left.floor()).sqrt());
        let judged = Judged { trial, place, beside: &beside, status, hidden, times_noise, kind, finding };
        Candidate {
            effect: name.into(),
            probability: if kept { probability.max(finding.confidence) } else { probability },
            parameters: fit.map(|fit| parameters::of_effect_moved(bench, fit, effect, time_step)).unwrap_or_default(),
            shrink,
            confusable_with: confusable(case, &found.steps[0], effect, measures.overdispersion[0]),
            status,
            why: format!("{}{}", reason(bench, found, &judged), carried_over(&shrink)),
        }
    }
}

/// What the hypothesis left once the effect that was added in the step at `place` was in it: what the next step began with,
/// and at the last effect that was kept what the search ended with.
fn after_keeping(found: &Found, left: &[Option<Residuals>], after: &Residuals, place: usize) -> Option<Residuals> {
    match found.kept().map(|(place, _)| place).max() {
        Some(last) if place < last => left.get(place + 1).cloned().flatten(),
        _ => Some(after.clone()),
    }
}

/// Whether an effect on the object was not fitted because the arm's gap was open: where the arm is elsewhere, what it hits
/// says nothing of the object.
fn is_hidden_by_the_arm(bench: &Bench<'_>, step: &Step, trial: &Trial) -> bool {
    let effect = trial.scored.candidate;
    let felt = bench.library.candidates[effect].is_of_arm() || bench.library.arm_may_feel(effect);
    trial.fitted.is_none() && !felt && screening::arm_gap_is_open(&step.whole, &step.left)
}

/// The step that says most about an effect. One that was kept is judged by what those before it left. Another one by its fit
/// to the whole gap; where it was given none, as what an object shows while the arm's gap is open, beside what was believed
/// in the end.
fn judged_in(found: &Found, effect: usize, believed: bool) -> usize {
    let of = |place: &usize| found.steps[*place].trial(effect).map(|trial| trial.fitted.is_some());
    let all_kept =
        |place: &usize| found.steps[*place].from.effects.iter().all(|other| found.last.effects.contains(other));
    let beside = || (0..found.steps.len()).rev().filter(|place| believed && all_kept(place));
    let added = found.kept().find(|(_, added)| believed && *added == effect).map(|(place, _)| place);
    added
        .or_else(|| (of(&0) == Some(true)).then_some(0))
        .or_else(|| beside().find(|place| of(place) == Some(true)))
        .or_else(|| beside().find(|place| of(place).is_some()))
        .unwrap_or(0)
}

fn confusable(case: &Case<'_>, first: &Step, effect: usize, overdispersion: f64) -> Vec<String> {
    let near = confidence::rivals(first, case.bench.library, effect, overdispersion);
    near.iter().map(|other| case.name(*other).to_owned()).collect()
}

/// What is added to the reason where numbers that fit some clips are wrong in the others.
fn carried_over(shrink: &Share) -> &'static str {
    if shrink.value > SHRINK_OF_A_DOUBLED_GAP {
        return "";
    }
    "; its numbers fit the clips they were found on alone: on the others the gap more than doubles"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::fit::bench::Hypothesis;
    use crate::diagnose::fit::shortlist::Scored;
    use crate::diagnose::judge::score::Predicted;

    fn hypothesis(effects: &[usize]) -> Hypothesis {
        Hypothesis { effects: effects.to_vec(), full: Vec::new(), free: Vec::new(), fitted: Vec::new() }
    }

    /// A step from these effects on, with candidates that were fitted in it or only looked at.
    fn step(from: &[usize], candidates: &[(usize, bool)]) -> Step {
        let predicted = Predicted { clips: vec![(0, 1000.0), (1, 1000.0)] };
        let scored = |candidate: usize| Scored {
            candidate,
            alternative: 0,
            units: vec![0.0],
            next: Vec::new(),
            gain: 0.0,
            cost: 1,
            cosine: 0.5,
            signal: 30.0,
            imitated: 0.1,
            p: 0.0,
        };
        let trial = |(candidate, fitted): &(usize, bool)| Trial {
            fitted: fitted.then(|| (hypothesis(&[from, &[*candidate]].concat()), predicted.over(&predicted))),
            ..Trial::untried(scored(*candidate), true)
        };
        Step {
            from: hypothesis(from),
            trials: candidates.iter().map(trial).collect(),
            predicted: predicted.clone(),
            weights: Vec::new(),
            arm_rows: 0,
            left: Vec::new(),
            whole: Vec::new(),
        }
    }

    #[test]
    fn an_effect_is_judged_where_most_was_seen_of_it() {
        // The arm's gap is open at first, and nothing of the object is fitted; 0 is named, then 1 beside it.
        let steps = vec![
            step(&[], &[(0, true), (1, false), (2, true), (3, false), (4, false)]),
            step(&[0], &[(1, true), (2, true), (3, true), (4, false)]),
            step(&[0, 1], &[(2, false), (3, false), (4, false)]),
        ];
        let found = Found { steps, last: hypothesis(&[0, 1]) };
        let judged = |effect, believed| found.steps[judged_in(&found, effect, believed)].from.effects.len();
        let all = |believed| [0, 1, 2, 3, 4].map(|effect| judged(effect, believed));
        assert_eq!(all(true), [0, 1, 0, 1, 2]);
        assert_eq!(all(false), [0; 5], "beside what is not believed nothing is judged");
    }

    #[test]
    fn numbers_that_fit_some_clips_alone_are_named() {
        assert!(carried_over(&NO_ANSWER).contains("more than doubles"));
        assert_eq!(carried_over(&Share { value: -0.4, ci90: [-0.6, 0.1] }), "");
        assert_eq!(carried_over(&Share::default()), "");
    }
}
