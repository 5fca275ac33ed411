//! A search that came to its end, and all that its answer is drawn from.

use crate::answer::effect_in_words;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::parameters;
use crate::diagnose::judge::trial::{Found, Step};
use crate::diagnose::work::Options;
use inference::admit::{Admitted, Split};
use inference::likelihood::Evidence;
use shared_mem::recording::Session;

/// What an answer is drawn from.
pub struct Case<'a, E> {
    pub bench: &'a Bench<'a, E>,
    pub split: &'a Split,
    pub found: &'a Found,
    pub session: &'a Session,
    pub admitted: &'a Admitted,
    pub options: &'a Options,
}

impl<E: Evidence> Case<'_, E> {
    /// The step that the search began with: it extends the baseline.
    pub(super) fn first(&self) -> &Step {
        &self.found.steps[0]
    }

    /// Weights of the channels in the last step of the search.
    pub(super) fn last_weights(&self) -> &[f64] {
        &self.found.steps.last().unwrap_or(self.first()).weights
    }

    /// Name of a candidate.
    pub(super) fn name(&self, effect: usize) -> &'static str {
        self.bench.library.candidates[effect].effect.name
    }

    /// `command delay (delay 11.9 ms)`.
    pub(super) fn with_size(&self, hypothesis: &Hypothesis, effect: usize) -> String {
        effect_in_words(self.name(effect), &parameters::of_effect(self.bench, hypothesis, effect))
    }
}
