//! Which candidates single stages show by themselves ([`inference::witness`]), and whether a fit agrees: with it most of what they show is gone,
//! in squared standard errors.

use crate::diagnose::criteria::MOST_OF_IT;
use crate::diagnose::judge::trial::Step;
use crate::diagnose::propose::Search;
use inference::witness::Witness;

/// A candidate that single stages show beyond what is in the model.
pub(super) struct ShownInStages {
    pub(super) candidate: usize,
    /// What of it they show, and what would show in the same way.
    witnesses: Vec<Witness>,
}

/// Candidates that single stages show beyond the effects in these numbers, and those that would show alike.
pub(super) fn shown(search: &Search<'_>, full: &[f64]) -> Vec<ShownInStages> {
    let significant: Vec<Witness> = (search.witnessed)(full).into_iter().filter(Witness::is_significant).collect();
    let of = |candidate: usize| {
        let name = search.bench.library.name(candidate);
        let shows = |witness: &&Witness| witness.effect == name || witness.confusable_with.contains(&name);
        ShownInStages { candidate, witnesses: significant.iter().filter(shows).cloned().collect() }
    };
    let all = (0..search.bench.library.candidates.len()).map(of);
    all.filter(|shown| !shown.witnesses.is_empty()).collect()
}

/// The step with what stages say of its trials.
pub(super) fn compared(search: &Search<'_>, mut step: Step, shown: &[ShownInStages]) -> Step {
    for ShownInStages { candidate, witnesses } in shown {
        let Some(trial) = step.trials.iter_mut().find(|trial| trial.scored.candidate == *candidate) else { continue };
        let Some((fit, _)) = &trial.fitted else { continue };
        let after = (search.witnessed)(&fit.full);
        let left = |before: &Witness| {
            let same = |after: &&Witness| (after.effect, after.number) == (before.effect, before.number);
            after.iter().find(same).map_or(before.t, |after| after.t)
        };
        let shown: f64 = witnesses.iter().map(|witness| witness.t.powi(2)).sum();
        let open: f64 = witnesses.iter().map(|witness| left(witness).powi(2)).sum();
        trial.beside_contact.in_a_stage = open < MOST_OF_IT * shown;
    }
    step
}
