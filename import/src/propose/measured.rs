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
    let rivals: Vec<&Judged<'a>> =
        fitting.iter().skip(1).filter(|other| other.rank() == best.rank() && other.differs(best)).copied().collect();
    // Of two that go the same way, the later one is what the arm did: whatever it is called, unless it says that it comes of the other.
    for other in fitting.iter().skip(1) {
        let derived =
            naming::is_derived(&other.candidate.group.base) && !naming::is_derived(&best.candidate.group.base);
        if !derived && best.leads(other) {
            best = other;
        }
    }
    let is_later = !best.candidate.is_same(&first.candidate);
    let ties = |best: &Judged<'a>| -> Vec<&Judged<'a>> {
        let equal =
            fitting.iter().filter(|other| !other.candidate.is_same(&best.candidate) && other.rank() == best.rank());
        equal.filter(|other| other.differs(best) && !other.leads(best)).copied().collect()
    };
    // Commands beside one of them, for the same joints, name the arm.
    let is_commanded = |judged: &Judged<'a>| {
        let beside = |told: &&Judged<'a>| std::ptr::eq(told.candidate.table, judged.candidate.table);
        let mut told = all.iter().filter(|told| told.candidate.role.desired).filter(beside);
        judged.candidate.joints().is_some_and(|joints| told.any(|told| told.candidate.joints() == Some(joints)))
    };
    let tied = ties(best);
    let commanded: Vec<&Judged<'a>> =
        std::iter::once(best).chain(tied.iter().copied()).filter(|j| is_commanded(j)).collect();
    let is_arm = !tied.is_empty() && commanded.len() == 1;
    if is_arm {
        best = commanded[0];
    }
    if !is_arm && !tied.is_empty() {
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
    let reason = if is_arm {
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

/// What there is to say where no group is positions of the arm: a question, or that the log is of another arm.
fn no_positions(misfits: &[&Judged<'_>], wanted: &[String], refused: &[String], notes: &mut Notes) -> Untaken {
    let there: Vec<String> = misfits.iter().map(|misfit| with_joints(misfit)).collect();
    let known = format!("the arm of the cell has {} joints ({})", wanted.len(), wanted.join(", "));
    // Among more columns than the arm has joints, its own may be.
    let may_hold_it =
        |misfit: &&Judged<'_>| misfit.candidate.joints().is_none() && misfit.candidate.size() > wanted.len();
    let what = if misfits.is_empty() {
        "which columns are the measured positions? One name a joint, of those at the end of this file".to_owned()
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
