//! An effect that predicts clips better and closes a real part of the gap, but not in enough clips to be no chance: what more
//! clips would prove.

use super::trial::{Found, LARGE_SHARE_CLOSED, Trial};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::select::criteria::EFFECTS;

/// An effect that is likely, and not proven.
pub(in crate::diagnose) struct Unproven<'a> {
    /// The trial of it.
    pub(in crate::diagnose) trial: &'a Trial,
    pub(in crate::diagnose) fit: &'a Hypothesis,
    /// How many clips judged.
    pub(in crate::diagnose) clips: usize,
    /// How many clips more would prove it, if they gained as those at hand do.
    pub(in crate::diagnose) more: usize,
}

impl Unproven<'_> {
    pub(in crate::diagnose) fn effect(&self, bench: &Bench<'_>) -> &'static str {
        bench.library.name(self.trial.scored.candidate)
    }
}

/// The likeliest such effect; `None` where something was found, or where none closes a real part of the gap. `cut`: how many
/// clips there are, where parts of them judge.
pub(in crate::diagnose) fn unproven<'a>(
    bench: &Bench<'_>,
    found: &'a Found,
    cut: Option<usize>,
) -> Option<Unproven<'a>> {
    let step = found.steps.first().filter(|_| found.last.effects.is_empty())?;
    let one = |trial: &'a Trial| {
        let (fit, gain) = trial.fitted.as_ref()?;
        let open = trial.closed.most > LARGE_SHARE_CLOSED && !EFFECTS.proves(gain, trial.scored.cost);
        let more = gain.clips_more().filter(|_| open)?;
        let real =
            !bench.negligible(trial.scored.candidate, &fit.full) && !bench.is_convention(trial.scored.candidate, fit);
        let clips = cut.unwrap_or(gain.clips());
        real.then(|| Unproven { trial, fit, clips, more: (more * clips).div_ceil(gain.clips()) })
    };
    step.trials.iter().filter_map(one).max_by(|a, b| a.trial.nats().total_cmp(&b.trial.nats()))
}
