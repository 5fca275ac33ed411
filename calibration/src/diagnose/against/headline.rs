//! The finding in one sentence, and the reason for every candidate.

use super::answer::{Candidate, Smallest, Values};
use super::search::Trial;
use crate::answer::diagnosis::{Kind, Place, Share, Status};
use crate::diagnose::against::change::{MAX_LISTED, between, smallest_in_words};
use crate::diagnose::select::criteria::CHANGES;
use crate::words::{channel_in_words, percent, words};

/// What the sentence is made of.
pub(super) struct Facts {
    /// What changed, with both values.
    changes: Vec<String>,
    /// What would do as well.
    rivals: Vec<String>,
    /// How far B's gap under A's model shrinks, with its interval.
    shrink: String,
    /// How many times as much B leaves as A, and where.
    times: f64,
    place: String,
    /// The smallest changes that would have been seen, those of the parameters that every cell has before those of effects.
    seen: Vec<String>,
    /// What a plausible change would not have been seen of; of parameters with the size from which on it would.
    blind: Vec<String>,
}

impl Facts {
    /// Of what was found.
    pub(super) fn of(candidates: &[Candidate], shrink: Share, times: f64, place: Option<&Place>) -> Self {
        let with = |wanted: &[Status]| {
            candidates.iter().filter(|candidate| wanted.contains(&candidate.status)).collect::<Vec<_>>()
        };
        let open = with(&[Status::Named, Status::Possible]);
        let fitted =
            |candidate: &&&Candidate| !candidate.confusable_with.is_empty() || candidate.status == Status::Named;
        let (changes, rivals): (Vec<&Candidate>, Vec<&Candidate>) =
            open.iter().partition(|candidate| fitted(candidate));
        let of = |status, effects| {
            let all = candidates.iter();
            all.filter(move |candidate| candidate.status == status && candidate.is_effect == effects)
        };
        let smallest = |candidate: &Candidate| said_smallest(candidate);
        let effects = of(Status::RuledOut, true).filter_map(smallest).take(MAX_LISTED);
        let seen = of(Status::RuledOut, false).filter_map(smallest).chain(effects).collect();
        let parameters = of(Status::NotTestable, false).filter_map(smallest);
        let blind = parameters.chain(of(Status::NotTestable, true).map(|candidate| words(&candidate.name))).collect();
        let [low, high] = shrink.ci90.map(percent);
        Self {
            changes: changes.into_iter().map(change).collect(),
            rivals: rivals.into_iter().map(|rival| words(&rival.name)).collect(),
            shrink: format!("{} ({low} to {high})", percent(shrink.value)),
            times,
            place: place.map_or_else(String::new, |place| {
                format!(", most of it in {} ({})", channel_in_words(&place.channel), place.regime)
            }),
            seen,
            blind,
        }
    }
}

pub(super) fn sentence(kind: Kind, facts: &Facts) -> String {
    let changes = facts.changes.join(", and ");
    match kind {
        Kind::Named => format!(
            "From A to B {changes}: with that B's gap under A's model shrinks by {} on held-out clips.",
            facts.shrink
        ),
        Kind::Class => format!(
            "From A to B one of several things changed, and these clips cannot tell which: {changes}, or {} instead. With the first B's gap \
             under A's model shrinks by {} on held-out clips.",
            facts.rivals.join(" or "),
            facts.shrink
        ),
        Kind::Unexplained => format!(
            "B deviates: a model for both leaves {:.1} times the squared residual in B that A's own leaves in A{}, and no parameter or \
             effect that changes explains it.",
            facts.times, facts.place
        ),
        Kind::None => format!(
            "Nothing changed that these clips show; in nine of ten such sessions a change of this size would have been seen: {}{}.",
            facts.seen.join("; "),
            blind(&facts.blind, "; no plausible change would have been of ")
        ),
        Kind::NotTestable if facts.seen.is_empty() => format!(
            "Not testable: no change of a plausible size would have been seen in nine of ten such sessions{}.",
            blind(&facts.blind, ", and none of another before ")
        ),
        Kind::NotTestable => format!(
            "Not testable: of too little a change of a plausible size would have been seen in nine of ten such sessions: {}{}.",
            facts.seen.join("; "),
            blind(&facts.blind, "; not seen before ")
        ),
    }
}

/// `payload changed: mass 0 to 0.52 kg (change 0.52 [0.50, 0.54] kg)`.
fn change(candidate: &Candidate) -> String {
    let name = words(&candidate.name);
    let number = |(parameter, values): (&String, &Values)| {
        let text = between(parameter, values);
        text.strip_prefix(&format!("{name} ")).map_or(text.clone(), str::to_owned)
    };
    let numbers: Vec<String> = candidate.parameters.iter().map(number).collect();
    if numbers.is_empty() { format!("{name} changed") } else { format!("{name} changed: {}", numbers.join("; ")) }
}

/// What is not seen, behind `before`; empty where all is.
fn blind(all: &[String], before: &str) -> String {
    if all.is_empty() { String::new() } else { format!("{before}{}", all.join("; ")) }
}

/// A candidate with the smallest change of each of its numbers.
fn said_smallest(candidate: &Candidate) -> Option<String> {
    let one = |(name, smallest): (&String, &Smallest)| smallest_in_words(name, &candidate.name, smallest);
    let all: Vec<String> = candidate.smallest_seen.iter().map(one).collect();
    (!all.is_empty()).then(|| format!("{} {}", words(&candidate.name), all.join(", ")))
}

/// Why a candidate is what it is.
pub(super) fn reason(status: Status, slopes: Option<(f64, f64)>, trial: Option<&Trial>) -> String {
    let gained = trial.map(|trial| {
        let (nats, error) = (trial.change.nats, trial.change.error);
        format!("predicts the clips by {nats:.1} \u{b1} {error:.1} nats better than the same in both sessions")
    });
    match (status, gained, slopes) {
        (Status::Named | Status::Possible, Some(gained), _) => gained,
        (Status::NotTestable, ..) => "no change of a plausible size would have been seen".into(),
        (_, Some(gained), _) => format!("{gained}: chance, or another change does better"),
        (_, None, Some((p, _))) if p < CHANGES.max_chance => "another change explains far more".into(),
        (_, None, Some((p, _))) => format!("no better than \"nothing changed\" (p = {p:.2})"),
        (_, None, None) => "it was not looked at".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn candidate(name: &str, is_effect: bool, status: Status, sizes: &[Option<f64>]) -> Candidate {
        let smallest = Smallest { values: sizes.to_vec(), unit: "N m/rad".into() };
        Candidate {
            name: name.into(),
            is_effect,
            probability: 0.0,
            parameters: BTreeMap::new(),
            shrink: Share::default(),
            confusable_with: Vec::new(),
            status,
            why: String::new(),
            smallest_seen: BTreeMap::from([(name.to_owned(), smallest)]),
        }
    }

    #[test]
    fn where_nothing_was_learned_the_sentence_says_from_which_size_on_a_change_is_seen() {
        let all = [
            candidate("payload", true, Status::NotTestable, &[None]),
            candidate("stiffness", false, Status::NotTestable, &[Some(535.0)]),
        ];
        let said = |kind, all: &[Candidate]| sentence(kind, &Facts::of(all, Share::default(), 1.0, None));
        let text = said(Kind::NotTestable, &all);
        assert!(text.starts_with("Not testable: ") && text.contains("stiffness 535 N m/rad; payload"), "{text}");
        let seen = [&all[..1], &[candidate("stiffness", false, Status::RuledOut, &[Some(12.0)])]].concat();
        let text = said(Kind::None, &seen);
        assert!(
            text.contains("seen: stiffness 12.0 N m/rad; no plausible change would have been of payload."),
            "{text}"
        );
    }
}
