//! Which group of columns is the measured positions: the one that most speaks for. Where as much speaks for another, it is asked.

use super::Notes;
use super::judged::Judged;
use super::members;
use crate::naming::{self, Quantity};
use std::cmp::Reverse;

/// Groups that are listed in a sentence.
const LISTED: usize = 8;
/// Line of import.toml.
const LINE: &str = "measured.q";

/// Why no group was taken.
#[derive(Debug)]
pub(super) enum Untaken {
    /// It was asked which.
    Asked,
    /// All there is belongs to another arm than the one that is known: a sentence.
    OtherArm(String),
}

/// The measured positions. `wanted`: joints of the arm, where it is known; `refused`: groups that are no
/// positions, with the reason.
pub(super) fn choose<'a>(
    all: &[Judged<'a>],
    wanted: &[String],
    mut refused: Vec<String>,
    notes: &mut Notes,
) -> Result<Judged<'a>, Untaken> {
    let some_move = all.iter().any(|judged| !judged.is_constant);
    let mut fitting: Vec<&Judged<'a>> = Vec::new();
    let mut misfits: Vec<&Judged<'a>> = Vec::new();
    for judged in all.iter().filter(|judged| judged.candidate.is(Quantity::Position, false)) {
        if some_move && judged.is_constant {
            refused.push(format!("{}: the same in every row", judged.candidate.named()));
        } else if fits(judged, wanted) {
            fitting.push(judged);
        } else {
            misfits.push(judged);
        }
    }
    fitting.sort_by_key(|judged| Reverse((judged.rank(), judged.candidate.table.rows())));
    let Some(mut best) = fitting.first().copied() else {
        return Err(no_positions(&misfits, wanted, &refused, notes));
    };
    let first = best;
    best = later(best, &fitting);
    let is_later = !best.candidate.is_same(&first.candidate);
    let tied: Vec<&Judged<'a>> = fitting
        .iter()
        .filter(|other| !other.candidate.is_same(&best.candidate) && other.rank() == best.rank())
        .filter(|other| other.differs(best) && !other.leads(best))
        .copied()
        .collect();
    let arm = only_commanded(all, best, &tied);
    best = arm.unwrap_or(best);
    if arm.is_none() && !tied.is_empty() {
        let rivals =
            fitting.iter().skip(1).filter(|other| other.rank() == first.rank() && other.differs(first)).copied();
        let names: Vec<String> = std::iter::once(fitting[0]).chain(rivals).map(|j| j.candidate.named()).collect();
        let what = format!(
            "as much speaks for {}: which are the arm's positions? One name a joint, and the table above",
            listed(&names, " as for ")
        );
        notes.ask(
            LINE,
            what + &not_taken(&refused),
            fitting.iter().take(LISTED).map(|j| j.candidate.line("q")).collect(),
        );
        return Err(Untaken::Asked);
    }
    let others: Vec<&Judged<'a>> =
        fitting.into_iter().filter(|other| !other.candidate.is_same(&best.candidate)).take(LISTED).collect();
    let reason = if arm.is_some() {
        "commands for the same joints stand beside it"
    } else if is_later {
        "the later one of those that go the same way"
    } else {
        best.why(&others)
    };
    let mut why = format!("{}: {reason}", best.candidate.named());
    if !others.is_empty() {
        let there: Vec<String> = others.iter().map(|other| other.candidate.named()).collect();
        why += &format!("; also there: {}", there.join(", "));
    }
    refused.extend(
        misfits.into_iter().map(|misfit| format!("{}, which the arm of the cell has not", with_joints(misfit))),
    );
    notes.chosen(LINE, why + &not_taken(&refused), others.iter().map(|other| other.candidate.line("q")).collect());
    Ok(best.clone())
}

/// Of those that go the same way the latest, which is what the arm did: whatever it is called, unless it says that it comes of the other.
fn later<'a, 'b>(best: &'b Judged<'a>, fitting: &[&'b Judged<'a>]) -> &'b Judged<'a> {
    let is_derived = |judged: &Judged<'_>| naming::is_derived(&judged.candidate.group.base);
    let mut latest = best;
    for other in fitting.iter().skip(1) {
        if (is_derived(latest) || !is_derived(other)) && latest.leads(other) {
            latest = other;
        }
    }
    latest
}

/// The only one of those for which as much speaks beside which commands for the same joints stand: they name the arm.
fn only_commanded<'a, 'b>(all: &[Judged<'a>], best: &'b Judged<'a>, tied: &[&'b Judged<'a>]) -> Option<&'b Judged<'a>> {
    let is_commanded = |judged: &Judged<'a>| {
        let beside = |told: &&Judged<'a>| std::ptr::eq(told.candidate.table, judged.candidate.table);
        let mut told = all.iter().filter(|told| told.candidate.role.desired).filter(beside);
        judged.candidate.joints().is_some_and(|joints| told.any(|told| told.candidate.joints() == Some(joints)))
    };
    let mut commanded = std::iter::once(best).chain(tied.iter().copied()).filter(|judged| is_commanded(judged));
    commanded.next().filter(|_| !tied.is_empty() && commanded.next().is_none())
}

/// What there is to say where no group is positions of the arm: a question, or that the log is of another arm.
fn no_positions(misfits: &[&Judged<'_>], wanted: &[String], refused: &[String], notes: &mut Notes) -> Untaken {
    let there: Vec<String> = misfits.iter().map(|misfit| with_joints(misfit)).collect();
    let known = format!("the arm of the cell has {} joints ({})", wanted.len(), wanted.join(", "));
    // Among more columns than the arm has joints, its own may be.
    let may_hold_it =
        |misfit: &&Judged<'_>| misfit.candidate.joints().is_none() && misfit.candidate.size() > wanted.len();
    let what = if misfits.is_empty() {
        "which columns are the measured positions? One name a joint, of those at the end of this file".to_owned()
    } else if let Some(several) = misfits.iter().find(|misfit| holds_several(misfit, wanted)) {
        format!("{known}, and {} has them more than once: which columns are those of one arm?", with_joints(several))
    } else if misfits.iter().any(may_hold_it) {
        format!(
            "{known}, and the log has {}: which of these columns are its joints, in their order?",
            listed(&there, " and ")
        )
    } else {
        let what =
            format!("{known}, and the log has {}: give the cell of the arm that was logged", listed(&there, " and "));
        return Untaken::OtherArm(what);
    };
    notes.open(LINE, what + &not_taken(refused));
    Untaken::Asked
}

/// Whether a group may be the joints of the arm that is known.
fn fits(judged: &Judged<'_>, wanted: &[String]) -> bool {
    wanted.is_empty()
        || match judged.candidate.joints() {
            Some(names) => members::places(names, wanted).is_some(),
            None => judged.candidate.size() == wanted.len(),
        }
}

/// Whether each of the arm's joints is there more than once, under the names of several arms.
fn holds_several(judged: &Judged<'_>, wanted: &[String]) -> bool {
    let count = |joint: &String| {
        judged.candidate.joints().into_iter().flatten().filter(|own| own.ends_with(joint.as_str())).count()
    };
    wanted.iter().all(|joint| count(joint) > 1)
}

fn with_joints(judged: &Judged<'_>) -> String {
    let name = judged.candidate.named();
    match judged.candidate.joints() {
        Some(names) => format!("{name} with {} ({})", names.len(), listed(names, ", ")),
        None => format!("{name} with {} columns", judged.candidate.size()),
    }
}

fn listed(all: &[String], between: &str) -> String {
    let some = all.iter().take(LISTED).cloned().collect::<Vec<_>>().join(between);
    if all.len() > LISTED { format!("{some} and {} more", all.len() - LISTED) } else { some }
}

fn not_taken(refused: &[String]) -> String {
    if refused.is_empty() { String::new() } else { format!(". Not taken: {}", listed(refused, "; ")) }
}
