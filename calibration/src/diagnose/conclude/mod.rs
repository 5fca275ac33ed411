//! From what the search found to an answer: measured on held-out clips, decided, and said, with what to do about it and
//! what to record next.
//!
//! | module | |
//! |---|---|
//! | `measure` | what held-out clips say |
//! | `verdict`, `decide` | which of the five verdicts it is |
//! | `headline` | its sentence |
//! | `advice`, `site` | what to record next, and the commands for it |
//! | `written` | the motion of an arm that no bridge drives, as CSV |
//! | `remedies` | what to do about what was named |
//! | `ranked`, `reason` | what is said of every candidate, and why |
//! | `say` | the answer |
//! | `witnessed` | what single stages say beside the verdict |

pub mod advice;
mod decide;
mod headline;
mod measure;
mod ranked;
mod reason;
mod remedies;
mod say;
pub mod site;
mod verdict;
pub(in crate::diagnose) mod witnessed;
pub mod written;

pub use say::not_testable;

use super::work::{DiagnoseError, Options};
use crate::answer::diagnosis::Diagnosis;
use crate::answer::effect_in_words;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::parameters;
use crate::diagnose::judge::trial::{Found, Step};
use inference::admit::{Admitted, Split};
use shared_mem::recording::Session;

/// A search that came to its end, and all that its answer is drawn from.
pub struct Case<'a> {
    pub bench: &'a Bench<'a>,
    pub split: &'a Split,
    pub found: &'a Found,
    pub session: &'a Session,
    pub admitted: &'a Admitted,
    pub options: &'a Options,
}

impl Case<'_> {
    /// The step that the search began with: it extends the baseline.
    fn first(&self) -> &Step {
        &self.found.steps[0]
    }

    /// Weights of the channels in the last step of the search.
    fn last_weights(&self) -> &[f64] {
        &self.found.steps.last().unwrap_or(self.first()).weights
    }

    fn name(&self, effect: usize) -> &'static str {
        self.bench.library.candidates[effect].effect.name
    }

    /// `command delay (delay 11.9 ms)`.
    fn with_size(&self, hypothesis: &Hypothesis, effect: usize) -> String {
        effect_in_words(self.name(effect), &parameters::of_effect(self.bench, hypothesis, effect))
    }
}

/// Measures and says what was found.
///
/// # Errors
/// [`DiagnoseError`] when the twin has no answer on them.
pub fn conclude(case: &Case<'_>) -> Result<Diagnosis, DiagnoseError> {
    let measures = measure::measure(case)?;
    let decided = decide::decide(case, &measures);
    say::say(case, measures, &decided)
}
