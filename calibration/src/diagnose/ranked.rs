//! What is said of every candidate: how likely it is, how much it closes, and why it is or is not the cause.

use super::answer::{Candidate, Share, Status};
use super::combine::{Found, Step, Trial};
use super::evidence::Evidence;
use super::fit::Bench;
use super::gap::{DOUBLED, Residuals};
use super::shortlist::{Scored, TESTABLE};
use super::split::Split;
use super::verdict::Finding;
use super::{Kind, confidence, parameters};

/// What nobody fitted closes nothing.
const NOT_FITTED: Share = Share { value: 0.0, ci90: [0.0; 2] };
/// Of numbers with which the twin has no answer in the clips kept for confirming.
const FLOWN: Share = Share { value: DOUBLED, ci90: [DOUBLED; 2] };

/// What is said of every candidate: what was named first, then what is possible, then the likelier.
pub(super) fn candidates<E: Evidence>(
    bench: &Bench<'_, E>,
    (found, unforeseen): (&Found, f64),
    split: &Split,
    (before, finding): (&Residuals, &Finding<'_>),
    kind: Kind,
    seed: u64,
) -> Vec<Candidate> {
    let first = &found.steps[0];
    let believed = matches!(kind, Kind::Named | Kind::Class);
    let likely = confidence::probabilities(&first.trials, found.last.effects.is_empty());
    let one = |trial: &Trial| {
        let effect = trial.scored.candidate;
        let name = bench.library.candidates[effect].effect.name;
        let kept = believed && found.last.effects.contains(&effect);
        let step = judged_in(found, effect, believed);
        let trial = step.trials.iter().find(|trial| trial.scored.candidate == effect).unwrap_or(trial);
        let on_confirm = |fit| Residuals::at(bench, fit, &split.confirm);
        let beneath = match &step.from.effects[..] {
            [] => None,
            _ => on_confirm(&step.from),
        };
        let from = beneath.as_ref().unwrap_or(before);
        let shrink = match &trial.fitted {
            None => NOT_FITTED,
            Some((fit, _)) => on_confirm(fit).map_or(FLOWN, |fitted| fitted.shrink(from, seed)),
        };
        let beside: Vec<&str> = step.from.effects.iter().map(|k| bench.library.candidates[*k].effect.name).collect();
        let fit = if kept { Some(&found.last) } else { trial.fitted.as_ref().map(|(fit, _)| fit) };
        let probability = likely.iter().find(|(candidate, _)| *candidate == effect).map_or(0.0, |(_, p)| *p);
        let status = status(&trial.scored, kept, finding.rivals.contains(&name), kind);
        Candidate {
            effect: name.into(),
            probability: if kept { probability.max(finding.confidence) } else { probability },
            parameters: fit.map(|fit| parameters::of_effect(bench, fit, effect)).unwrap_or_default(),
            shrink,
            confusable_with: confusable(first, effect, unforeseen, bench),
            status,
            why: format!("{}{}", why(trial, &beside, status), carried_over(&shrink)),
        }
    };
    let mut all: Vec<Candidate> = first.trials.iter().map(one).collect();
    all.sort_by(|a, b| {
        let key = |c: &Candidate| (c.status != Status::Named, c.status != Status::Possible, -c.probability);
        key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
    });
    all
}

/// The step that tells most about an effect. One that was kept is judged by what those before it left. Another one by its fit
/// to the whole gap; where it was given none, as what an object shows while the arm strays, beside what was believed in the
/// end.
fn judged_in(found: &Found, effect: usize, believed: bool) -> &Step {
    let of =
        |step: &Step| step.trials.iter().find(|trial| trial.scored.candidate == effect).map(|t| t.fitted.is_some());
    let all_kept = |step: &&Step| step.from.effects.iter().all(|other| found.last.effects.contains(other));
    let beside = || found.steps.iter().rev().filter(|step| believed && all_kept(step));
    let added = found.kept().find(|(_, added)| believed && *added == effect).map(|(place, _)| &found.steps[place]);
    let first = &found.steps[0];
    added
        .or_else(|| (of(first) == Some(true)).then_some(first))
        .or_else(|| beside().find(|step| of(step) == Some(true)))
        .or_else(|| beside().find(|step| of(step).is_some()))
        .unwrap_or(first)
}

fn status(scored: &Scored, kept: bool, rival: bool, kind: Kind) -> Status {
    match kind {
        Kind::Named if kept => Status::Named,
        Kind::Class if kept || rival => Status::Possible,
        _ if scored.signal < TESTABLE => Status::NotTestable,
        _ => Status::RuledOut,
    }
}

fn confusable<E: Evidence>(first: &Step, effect: usize, unforeseen: f64, bench: &Bench<'_, E>) -> Vec<String> {
    let near = confidence::rivals(first, effect, unforeseen);
    near.iter().map(|other| bench.library.candidates[*other].effect.name.to_owned()).collect()
}

/// What is added to the reason where numbers that fit some clips are wrong in the others.
fn carried_over(shrink: &Share) -> &'static str {
    if shrink.value > DOUBLED {
        return "";
    }
    "; its numbers fit the clips they were found on alone: on those kept for confirming the gap more than doubles"
}

fn why(trial: &Trial, beside: &[&str], status: Status) -> String {
    let scored = &trial.scored;
    match (&trial.fitted, status) {
        (_, Status::NotTestable) => format!(
            "even at its largest it would show by {:.1} sigma beyond what the other parameters can imitate",
            scored.signal
        ),
        (Some((_, advantage)), _) => format!(
            "{}foretells the clips better by {:.0} ± {:.0} nats, in {:.0} % of them, for {} numbers; {} {:.0} % of {}",
            if beside.is_empty() { String::new() } else { format!("beside {} it ", beside.join(" and ")) },
            advantage.nats,
            advantage.error,
            100.0 * advantage.share,
            scored.cost,
            if beside.is_empty() { "alone it closes" } else { "there it closes" },
            100.0 * trial.closes.clamp(0.0, 1.0),
            if beside.is_empty() { "the gap" } else { "what is left" },
        ),
        (None, _) => format!(
            "its signature explains {:.1} % of what {} leaves; other parameters imitate {:.0} % of that signature",
            100.0 * scored.cosine.powi(2),
            if beside.is_empty() { "the baseline".to_owned() } else { beside.join(" and ") },
            100.0 * scored.imitated
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::fit::Hypothesis;
    use super::super::score::Foretold;
    use super::*;

    fn hypothesis(effects: &[usize]) -> Hypothesis {
        Hypothesis { effects: effects.to_vec(), full: Vec::new(), free: Vec::new(), fitted: Vec::new() }
    }

    /// A step from these effects on, with candidates that were fitted in it or only looked at.
    fn step(from: &[usize], candidates: &[(usize, bool)]) -> Step {
        let foretold = Foretold { clips: vec![(0, 1000.0), (1, 1000.0)] };
        let trial = |(candidate, fitted): &(usize, bool)| Trial {
            scored: Scored {
                candidate: *candidate,
                alternative: 0,
                units: vec![0.0],
                next: Vec::new(),
                gain: 0.0,
                cost: 1,
                cosine: 0.5,
                signal: 30.0,
                imitated: 0.1,
                p: 0.0,
            },
            fitted: fitted.then(|| (hypothesis(&[from, &[*candidate]].concat()), foretold.over(&foretold))),
            closes: 0.0,
            own_numbers: true,
        };
        Step {
            from: hypothesis(from),
            trials: candidates.iter().map(trial).collect(),
            foretold: foretold.clone(),
            weights: Vec::new(),
            arm_rows: 0,
            left: Vec::new(),
            whole: Vec::new(),
        }
    }

    #[test]
    fn an_effect_is_judged_where_most_was_seen_of_it() {
        // The arm strays at first, and nothing of the object is fitted; 0 is named, then 1 beside it.
        let steps = vec![
            step(&[], &[(0, true), (1, false), (2, true), (3, false), (4, false)]),
            step(&[0], &[(1, true), (2, true), (3, true), (4, false)]),
            step(&[0, 1], &[(2, false), (3, false), (4, false)]),
        ];
        let found = Found { steps, last: hypothesis(&[0, 1]) };
        let judged = |effect, believed| judged_in(&found, effect, believed).from.effects.len();
        let all = |believed| [0, 1, 2, 3, 4].map(|effect| judged(effect, believed));
        assert_eq!(all(true), [0, 1, 0, 1, 2]);
        assert_eq!(all(false), [0; 5], "beside what is not believed nothing is judged");
    }

    #[test]
    fn numbers_that_fit_some_clips_alone_are_told() {
        assert!(carried_over(&FLOWN).contains("more than doubles"));
        assert_eq!(carried_over(&Share { value: -0.4, ci90: [-0.6, 0.1] }), "");
        assert_eq!(carried_over(&NOT_FITTED), "");
    }

    #[test]
    fn reasons_tell_beside_what_they_hold() {
        let of = |from, fitted| step(from, &[(3, fitted)]).trials.remove(0);
        let told = |trial: &Trial, beside: &[&str]| why(trial, beside, Status::RuledOut);
        assert!(told(&of(&[], false), &[]).contains("25.0 % of what the baseline leaves"));
        assert!(told(&of(&[0], false), &["command_delay"]).contains("25.0 % of what command_delay leaves"));
        assert!(told(&of(&[0], true), &["command_delay"]).starts_with("beside command_delay it foretells"));
    }
}
