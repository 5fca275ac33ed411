//! From what the search found to an answer: measured on the clips kept for confirming, decided, and said, with what to do about it and
//! what to record next.
//!
//! | module | |
//! |---|---|
//! | [`case`] | what an answer is drawn from |
//! | `measure` | what the confirm clips say |
//! | `verdict`, `decide` | which of the five verdicts it is |
//! | `headline` | its sentence |
//! | `advice`, `site` | what to record next, and the commands for it |
//! | `written` | the motion of an arm that no bridge drives, as CSV |
//! | `remedies` | what to do about what was named |
//! | `ranked`, `reason` | what is said of every candidate, and why |
//! | `say` | the answer |

pub mod advice;
pub mod case;
mod decide;
mod headline;
mod measure;
mod ranked;
mod reason;
mod remedies;
mod say;
pub mod site;
mod verdict;
pub mod written;

pub use say::not_testable;

use super::work::DiagnoseError;
use crate::answer::diagnosis::Diagnosis;
use case::Case;
use inference::likelihood::Evidence;

/// Opens the confirm clips and says what was found.
///
/// # Errors
/// [`DiagnoseError`] when the twin has no answer on them.
pub fn conclude<E: Evidence>(case: &Case<'_, E>) -> Result<Diagnosis, DiagnoseError> {
    let measures = measure::measure(case)?;
    let decided = decide::decide(case, &measures);
    say::say(case, measures, &decided)
}
