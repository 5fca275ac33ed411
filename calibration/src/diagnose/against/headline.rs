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
    /// The smallest changes that would have been seen.
    seen: Vec<String>,
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
        let seen = candidates.iter().filter(|candidate| candidate.status == Status::RuledOut);
        let seen = seen.filter_map(said_smallest).take(MAX_LISTED).collect();
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
        Kind::None | Kind::NotTestable if facts.seen.is_empty() => {
            "Nothing changed that these clips show, and no change of any candidate of a plausible size would have been seen.".into()
        }
        Kind::None | Kind::NotTestable => format!(
            "Nothing changed that these clips show; in nine of ten such sessions a change of this size would have been seen: {}.",
            facts.seen.join("; ")
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

fn said_smallest(candidate: &Candidate) -> Option<String> {
    let (name, smallest): (&String, &Smallest) = candidate.smallest_seen.iter().next()?;
    Some(format!("{} {}", words(&candidate.name), smallest_in_words(name, &candidate.name, smallest)))
}

/// Why a candidate is what it is.
pub(super) fn reason(status: Status, slopes: Option<(f64, f64)>, trial: Option<&Trial>) -> String {
    let gained = trial.map(|trial| {
        let (nats, error) = (trial.change.nats, trial.change.error);
        format!("clips are likelier by {nats:.1} nats (one sigma {error:.1}) than with the same in both sessions")
    });
    match (status, gained, slopes) {
        (Status::Named | Status::Possible, Some(gained), _) => gained,
        (Status::NotTestable, ..) => "no change of a plausible size would have been seen".into(),
        (_, Some(gained), _) => format!("{gained}: chance, or another change does better"),
        (_, None, Some((p, _))) if p < CHANGES.max_chance => "its slopes explain far less than those of others".into(),
        (_, None, Some((p, _))) => format!("its slopes explain no more than chance does (p = {p:.2})"),
        (_, None, None) => "it was not looked at".into(),
    }
}
