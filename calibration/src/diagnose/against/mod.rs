//! Two sessions of one robot, everything shared but one or two effects: what changed from the first to the second.
//!
//! What acts in the first session, A, is found as in any diagnosis. Then the clips of both sessions are explained together: the
//! parameters and the effects of A's model are shared, and one after the other each of them, and each further effect, may have
//! another value in the second session, B. A change counts where it predicts clips that it was not fitted to better than the
//! same thing in both sessions does. What A does not tell well is refitted with every change, so that its uncertainty is no
//! change.
//!
//! | module | step |
//! |---|---|
//! | [`pair`] | whether two sessions can be compared, and their clips as those of one cell |
//! | `turned` | numbers that both sessions share and numbers that each has of its own |
//! | `subjects` | what may have changed |
//! | `scores` | what the slopes say of every change, and how small a change they would show |
//! | `power` | how small a change would have been seen |
//! | `fits` | models of both sessions fitted, and what one is worth over another |
//! | `search` | changes added while they are worth it |
//! | `changes`, [`change`] | values in A and B, and the change with its interval; the same in words |
//! | `conclude`, `headline`, [`answer`] | the answer |

pub mod answer;
pub mod change;
mod changes;
mod conclude;
mod fits;
mod headline;
pub mod pair;
mod power;
mod scores;
mod search;
mod subjects;
mod turned;

pub use answer::{Candidate, Comparison, Smallest, Values, Verdict};
pub use pair::{Pair, Unlike};

use super::work::{self, DiagnoseError, Options, Question, Work};

use crate::answer::diagnosis::SensorGap;
use crate::diagnose::criteria::{DOUBTFUL_EXCESS, MOST_OF_IT};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::stages;
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::search::baseline::{self, Baseline};
use fits::PairBench;
use inference::admit::{COMMANDS_TO_CHOOSE_BY, Refused, Split, torques};
use inference::interrupt::Interrupt;
use inference::kept::{Fingerprint, Kept};
use shared_mem::progress::Progress;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use std::sync::Arc;
use std::time::Instant;
use turned::{SIDES, Side, side_of};

/// Two sessions cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum AgainstError {
    /// They are not alike enough.
    #[error(transparent)]
    Unlike(#[from] Unlike),
    /// The work on them.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
}

/// What changed from the first session to the second, with what was found on the way: to be given up ([`Kept::done`]) once the
/// answer is where it belongs.
///
/// # Errors
/// [`AgainstError`].
pub fn compare_kept(
    sessions: [&Session; 2],
    options: &Options,
    interrupt: &Interrupt,
) -> Result<(Comparison, Arc<Kept>), AgainstError> {
    let tracking =
        |session: &Session| torques::tracking_cell(&session.cell).map(|cell| Session { cell, ..session.clone() });
    let owned: Option<Vec<Session>> = if options.torques { sessions.into_iter().map(tracking).collect() } else { None };
    let sessions = match &owned {
        Some(both) => [&both[0], &both[1]],
        None if options.torques => return Err(DiagnoseError::from(Refused::NoModel).into()),
        None => sessions,
    };
    let pair = pair::pair(sessions)?;
    let question = Fingerprint::of("diagnose against")
        .with(&(options.theta.as_ref().map(Theta::to_toml), options.seed, options.torques, pair.first_of_b))
        .with_cell(&sessions[0].cell)
        .with_cell(&sessions[1].cell)
        .with_clips(&pair.admitted.clips);
    let work = |work: Work<'_>| compared(sessions, &pair, options, work);
    Ok(work::kept("against", options, &sessions[1].folder, &question, interrupt, work)?)
}

/// The same of clips that were admitted already; of the sessions only cells and names count.
///
/// # Errors
/// [`DiagnoseError`].
pub fn compare_clips(
    sessions: [&Session; 2],
    pair: &Pair,
    options: &Options,
    interrupt: &Interrupt,
) -> Result<Comparison, DiagnoseError> {
    work::passing(interrupt, |work| compared(sessions, pair, options, work))
}

fn compared(
    sessions: [&Session; 2],
    pair: &Pair,
    options: &Options,
    work: Work<'_>,
) -> Result<Comparison, DiagnoseError> {
    let (began, cell) = (Instant::now(), &sessions[0].cell);
    let mut comparison = work::ask(&Changed { sessions, pair, options }, cell, &pair.admitted, options, work)?;
    if torques::is_tracking(cell) {
        comparison.theta = torques::without_law(comparison.theta, options.theta.as_ref());
    }
    comparison.seconds = began.elapsed().as_secs_f64();
    Ok(comparison)
}

/// What changed between two sessions.
struct Changed<'a> {
    sessions: [&'a Session; 2],
    pair: &'a Pair,
    options: &'a Options,
}

impl Question for Changed<'_> {
    type Answer = Comparison;

    fn examine(&self, bench: &Bench<'_>) -> Result<Comparison, DiagnoseError> {
        let Self { sessions, pair, options } = self;
        let (admitted, cell) = (&pair.admitted, &sessions[0].cell);
        let split = split_of(&admitted.groups, pair.first_of_b, options.seed);
        let of_a = of_a(&split, pair.first_of_b);
        let (slopes, changes) = (stages::SLOPES, stages::CHANGES);
        let of_pair = [slopes, changes, slopes, changes, stages::CONCLUSION];
        let expected = [&stages::expected(admitted.with_object)[..], &of_pair].concat();
        let bar = Progress::searching("diagnose", &expected, baseline::steps(admitted.with_object));
        let baseline = Baseline { bench, split: &of_a, cell, admitted };
        let begun = baseline.identified(&bar).ok_or(DiagnoseError::NoBaseline)?;
        let on_a = if is_explained(bench, &of_a, &begun) {
            begun
        } else {
            baseline.with_effects(begun, &bar).ok_or(DiagnoseError::NoBaseline)?.last
        };
        let pair_bench = PairBench { bench, first_of_b: pair.first_of_b, split: &split };
        let subjects = subjects::all(bench.library);
        let found = search::search(&pair_bench, &subjects, &on_a, &bar).ok_or(DiagnoseError::NoBaseline)?;
        bar.stage(stages::CONCLUSION, 1);
        let case = conclude::Case { sessions: *sessions, pair, of_a: &on_a, subjects: &subjects, found: &found };
        conclude::conclude(&pair_bench, &case, options)
    }
}

/// Whether the parameters alone leave of A so little beyond the noise that an effect has nothing to explain: as far below doubt as where
/// sessions in which no cause is seen have none ([`crate::diagnose::criteria::NONE_IS_RIGHT`]).
fn is_explained(bench: &Bench<'_>, of_a: &Split, baseline: &Hypothesis) -> bool {
    let Some(left) = Residuals::at(bench, baseline, &of_a.searched()) else { return false };
    SensorGap::of_groups(&left.typical(), &left.typical())
        .iter()
        .all(|left| left.gaps() < MOST_OF_IT * DOUBTFUL_EXCESS.value)
}

/// Which clips of both are for what: as of one session where each has enough commands; else each command of A is left out in
/// turn, together with one of B.
fn split_of(groups: &[Vec<usize>], first_of_b: usize, seed: u64) -> Split {
    let of = |side: Side| -> Vec<Vec<usize>> {
        let own = |group: &Vec<usize>| -> Vec<usize> {
            group.iter().copied().filter(|clip| side_of(*clip, first_of_b) == side).collect()
        };
        groups.iter().map(own).filter(|group| !group.is_empty()).collect()
    };
    let [of_a, of_b] = SIDES.map(of);
    if of_a.len().min(of_b.len()) >= COMMANDS_TO_CHOOSE_BY {
        return Split::new(groups, seed);
    }
    let nothing = Vec::new();
    let both = |k: usize| [of_a.get(k).unwrap_or(&nothing).clone(), of_b.get(k).unwrap_or(&nothing).clone()].concat();
    let in_turn: Vec<Vec<usize>> = (0..of_a.len().max(of_b.len())).map(both).collect();
    let mut all = groups.concat();
    all.sort_unstable();
    Split { train: all.clone(), choose: Vec::new(), confirm: all, in_turn }
}

/// The part of a split that belongs to A.
fn of_a(split: &Split, first_of_b: usize) -> Split {
    let of = |clips: &[usize]| clips.iter().copied().filter(|clip| *clip < first_of_b).collect::<Vec<_>>();
    let in_turn = split.in_turn.iter().map(|group| of(group)).filter(|group| !group.is_empty()).collect();
    Split { train: of(&split.train), choose: of(&split.choose), confirm: of(&split.confirm), in_turn }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(of_a: usize, of_b: usize) -> Split {
        let groups: Vec<Vec<usize>> = (0..of_a + of_b).map(|clip| vec![clip]).collect();
        split_of(&groups, of_a, 0)
    }

    #[test]
    fn of_few_commands_one_of_each_session_is_left_out_in_turn_and_of_many_some_are_not_fitted() {
        let few = split(4, 5);
        assert_eq!(few.in_turn, [vec![0, 4], vec![1, 5], vec![2, 6], vec![3, 7], vec![8]]);
        assert_eq!(of_a(&few, 4).in_turn, [[0], [1], [2], [3]]);
        let many = split(8, 8);
        assert!(!many.is_of_few() && many.confirm.iter().any(|clip| *clip >= 8));
        assert!(of_a(&many, 8).confirm.iter().all(|clip| *clip < 8));
    }
}
