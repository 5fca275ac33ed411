//! What a step extends, fitted once more from where its best trial ended.
//!
//! A likelihood ratio compares two maxima. Over rough hits a fit without an effect may end in another place than the fits
//! with one, which each get a start of their own; any effect then seems to close what that place leaves.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{FIRST_PASS, NEAR};
use crate::diagnose::judge::trial::{CLOSES, Step};
use inference::admit::Split;
use inference::likelihood::Evidence;

impl Step {
    /// What this step extends, from the numbers of its best trial without that trial's effect, where it fits better by more
    /// than is near and by such a share of what the trial gains as a cause must close. Only clips with numbers of their own are as
    /// rough as that.
    pub(super) fn nearer_without<E: Evidence>(&self, bench: &Bench<'_, E>, split: &Split) -> Option<Hypothesis> {
        if bench.scatter.count() == 0 || bench.interrupt.asked() {
            return None;
        }
        let fits = self.trials.iter().filter_map(|trial| Some((trial.scored.candidate, &trial.fitted.as_ref()?.0)));
        let (candidate, best) = fits.min_by(|(_, a), (_, b)| a.deviance().total_cmp(&b.deviance()))?;
        let mut full = best.full.clone();
        for k in bench.library.candidates[candidate].numbers.clone() {
            full[k] = self.from.full[k];
        }
        let gain = self.from.deviance() - best.deviance();
        let without =
            bench.fit((&self.from.effects, full), &split.train, &self.weights, Some(&self.from), FIRST_PASS)?;
        (self.from.deviance() - without.deviance() > NEAR.max(CLOSES * gain)).then_some(without)
    }
}
