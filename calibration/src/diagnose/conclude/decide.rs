//! From what was measured to the verdict: the finding is drawn from the search, and where nothing explains all of the gap, what is
//! proven to explain a part of it.

use super::Case;
use super::measure::Measures;
use super::verdict::{Decision, Finding, Power};
use crate::answer::diagnosis::Kind;
use crate::diagnose::fit::shortlist::TESTABLE;
use crate::diagnose::judge::held_out::Measured;
use crate::diagnose::judge::needed::FinalModel;
use crate::diagnose::judge::partly::{self, Partly};
use crate::diagnose::judge::trial::{Found, Step};
use crate::diagnose::judge::{confidence, drift, remainder};

/// The verdict, and what it rests on.
pub(super) struct Decided<'a> {
    pub(super) finding: Finding<'a>,
    pub(super) decision: Decision,
    /// Causes that are proven although a part of the gap stays.
    pub(super) partly: Option<Partly>,
}

pub(super) fn decide<'a>(case: &Case<'a>, measures: &Measures) -> Decided<'a> {
    let finding = finding(case, measures);
    let decision = finding.decide();
    let partly = if decision.kind == Kind::Unexplained {
        partly::proven(case.bench, case.split, case.found, &measures.without.held_out.left, case.options.seed)
    } else {
        None
    };
    Decided { finding, decision, partly }
}

impl Decided<'_> {
    fn believes(&self) -> bool {
        self.partly.is_some() || matches!(self.decision.kind, Kind::Named | Kind::Class)
    }

    /// The search, as if it had ended with what is proven.
    pub(super) fn found<'b>(&'b self, case: &'b Case<'_>) -> &'b Found {
        self.partly.as_ref().map_or(case.found, |partly| &partly.found)
    }

    /// The effects that were found, believed or not.
    pub(super) fn with<'b>(&'b self, measures: &'b Measures) -> &'b Measured {
        self.partly.as_ref().map_or(&measures.with, |partly| &partly.measured)
    }

    /// What the answer is about: effects that are believed, or the baseline.
    pub(super) fn shown<'b>(&'b self, measures: &'b Measures) -> &'b Measured {
        if self.believes() { self.with(measures) } else { &measures.without }
    }

    /// Whether effects come near to explaining a gap that nothing explains.
    pub(super) fn comes_near(&self) -> bool {
        let unexplained = self.decision.kind == Kind::Unexplained && self.partly.is_none();
        unexplained && self.finding.confirmed && !self.finding.effects.is_empty()
    }
}

fn finding<'a>(case: &Case<'a>, measures: &Measures) -> Finding<'a> {
    let Case { bench, found, .. } = *case;
    let mut rivals = Vec::new();
    let mut clear = true;
    for (place, effect) in found.kept() {
        let step = &found.steps[place];
        clear &= step.is_clear(bench.library, effect);
        let others = confidence::rivals(step, bench.library, effect, measures.overdispersion[place]);
        let others = others.into_iter().filter(|other| !found.last.effects.contains(other));
        rivals.extend(others.filter(|other| stands_in(case, step, effect, *other)).map(|other| case.name(other)));
    }
    Finding {
        effects: found.last.effects.iter().map(|effect| case.name(*effect)).collect(),
        rivals,
        confidence: sureness(found),
        clear,
        beyond_chance: found.is_beyond_chance(),
        of_arm: found.last.effects.iter().all(|effect| bench.library.candidates[*effect].is_of_arm()),
        left: measures.left.sensors.clone(),
        confirmed: measures.confirmation.holds || measures.confirmation.better && found.shows_beside_contact(),
        implausible: !remainder::implausible(bench, &measures.with.of_all).is_empty(),
        within_tolerance: measures.within_tolerance,
        drift: drift::of_friction(&bench.scatter, &measures.with.of_all),
        power: power(case),
    }
}

/// Of how many effects the clips would show anything, by their signatures around the baseline.
fn power(case: &Case<'_>) -> Power {
    let trials = &case.first().trials;
    let blind = trials.iter().filter(|trial| trial.scored.signal < TESTABLE);
    // A signal grows with the size.
    let mut not_shown: Vec<(&'static str, f64)> = blind
        .map(|trial| (case.name(trial.scored.candidate), TESTABLE / trial.scored.signal.max(f64::MIN_POSITIVE)))
        .collect();
    not_shown.sort_by(|a, b| a.1.total_cmp(&b.1));
    Power { shown: trials.len() - not_shown.len(), all: trials.len(), not_shown }
}

/// How sure the weakest of the effects that were found is.
pub(super) fn sureness(found: &Found) -> f64 {
    found.kept().fold(1.0, |least, (place, effect)| {
        let all = confidence::probabilities(&found.steps[place].trials, false);
        all.iter().find(|(candidate, _)| *candidate == effect).map_or(0.5, |(_, p)| *p).min(least)
    })
}

/// Whether a rival of an effect does as well in its place beside all the others that were found: where several act, what one
/// of them left unexplained makes rivals of it look alike that are separated once the others are there.
fn stands_in(case: &Case<'_>, step: &Step, effect: usize, rival: usize) -> bool {
    let Case { bench, split, found, .. } = *case;
    let (last, weights) = (&found.last, &found.steps[found.steps.len() - 1].weights);
    let fitted = step.trial(rival).and_then(|trial| trial.fitted.as_ref());
    let Some((fit, _)) = fitted.filter(|_| last.effects.len() > 1) else {
        return true;
    };
    let model = FinalModel::new(bench, split, last, weights);
    let ahead = model.and_then(|model| model.over_instead(effect, rival, fit, bench.last_pass()));
    ahead.is_none_or(|ahead| ahead.may_be_none(1.0))
}
