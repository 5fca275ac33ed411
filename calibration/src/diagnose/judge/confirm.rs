//! What clips say about what was found by numbers that were fitted to others: whether they speak for it, and how far the gap shrinks.
//!
//! They speak for it where they are predicted better, and where in a clip like most a real part of the gap closes. An object that
//! meets a corner, or misses it, ends elsewhere by more than any cause explains. So how far its path shrinks in the mean of
//! squares is a matter of single clips; the likelihood knows how far objects deviate, and what the joints in contact show.

use super::closing::MIN_SHARE_CLOSED;
use super::gap::{Residuals, Shrunk, explained};
use super::held_out::HeldOut;
use super::score::predict_unseen;
use crate::diagnose::fit::bench::Bench;
use crate::diagnose::select::gain::Gain;
use crate::diagnose::work::DiagnoseError;

/// What they say.
pub(in crate::diagnose) struct Confirmation {
    /// Whether they speak for it.
    pub(in crate::diagnose) holds: bool,
    /// Whether clips with an object are predicted better, however much of the gap closes.
    pub(in crate::diagnose) better: bool,
    /// How far the gap shrinks.
    pub(in crate::diagnose) shrink: Shrunk,
}

/// Compares the baseline and what was found; `weights` of the channels in the step in which the search began.
///
/// # Errors
/// [`DiagnoseError::NoBaseline`] where the twin has no answer.
pub(in crate::diagnose) fn confirm(
    bench: &Bench<'_>,
    weights: &[f64],
    both: [&HeldOut; 2],
    seed: u64,
) -> Result<Confirmation, DiagnoseError> {
    let left = both.map(|held_out| &held_out.left);
    let (shrink, mean) = (left[1].shrunk(left[0], seed), mean(left));
    let (better, holds) = if bench.scatter.count() > 0 {
        let [before, after] = both.map(|held_out| predict_unseen(bench, &held_out.fits, weights));
        let (before, after) = before.zip(after).ok_or(DiagnoseError::NoBaseline)?;
        let gain = after.over(&before);
        (is_better(&gain), speaks_for(&gain, &shrink, mean))
    } else {
        (false, shrinks_in_most(&shrink, mean))
    };
    Ok(Confirmation { holds, better, shrink })
}

/// Whether clips with an object speak for it: more of them are predicted better than worse, in sum by more than its standard error,
/// and enough of the gap closes: in the mean of squares, or in a clip like most.
fn speaks_for(gain: &Gain, shrink: &Shrunk, mean: f64) -> bool {
    is_better(gain) && mean.max(shrink.usual.value).max(shrink.contact.value) > MIN_SHARE_CLOSED
}

fn is_better(gain: &Gain) -> bool {
    gain.share > 0.5 && gain.nats > gain.error
}

/// The same of clips of the arm alone, which have no nuisance parameters. Their likelihood is nothing but their residuals, and weighs
/// these by what the search took for noise before anything was found: the plain residuals count, in more clips than not.
fn shrinks_in_most(shrink: &Shrunk, mean: f64) -> bool {
    let [shrinks, all] = shrink.clips;
    2 * shrinks > all && mean.max(shrink.usual.value) > MIN_SHARE_CLOSED
}

fn mean([before, after]: [&Residuals; 2]) -> f64 {
    explained(before.mean_square(), after.mean_square(), before.floor())
}

#[cfg(test)]
mod tests {
    use super::super::score::Predicted;
    use super::*;
    use crate::answer::diagnosis::Share;

    /// What four clips gain by being predicted with what was found [nats].
    fn gains(gains: [f64; 4]) -> Gain {
        let predicted = |gains: [f64; 4]| {
            let clips = gains.iter().enumerate().map(|(clip, gain)| (clip, 4000.0 - 2.0 * gain)).collect();
            Predicted { clips }
        };
        predicted(gains).over(&predicted([0.0; 4]))
    }

    fn share(value: f64) -> Share {
        Share { value, ci90: [value; 2] }
    }

    fn shrink(usual: f64, contact: f64) -> Shrunk {
        Shrunk { mean: share(-1.0), usual: share(usual), contact: share(contact), clips: [2, 4] }
    }

    #[test]
    fn clips_that_are_predicted_better_confirm_although_the_object_of_one_goes_another_way() {
        let all = gains([98.0, 133.0, 31.0, 50.0]);
        assert!(speaks_for(&all, &shrink(0.0, 0.9), -1.0), "the joints in contact close");
        assert!(speaks_for(&all, &shrink(0.6, 0.0), -1.0), "a clip like most does");
        assert!(!speaks_for(&all, &shrink(0.05, 0.02), -1.0), "nothing closes");
    }

    #[test]
    fn clips_that_are_predicted_worse_do_not_confirm_however_much_closes() {
        let half = gains([98.0, 133.0, -31.0, -50.0]);
        assert!(!speaks_for(&half, &shrink(0.9, 0.9), 0.9));
        let uneven = gains([9.0, 1.0, 1.0, -8.0]);
        assert!(uneven.share == 0.75 && !speaks_for(&uneven, &shrink(0.9, 0.9), 0.9), "{uneven:?}");
        let in_sum = gains([2.0, 3.0, 1.0, -400.0]);
        assert!(in_sum.share == 0.75 && !speaks_for(&in_sum, &shrink(0.9, 0.9), 0.9), "{in_sum:?}");
    }

    #[test]
    fn clips_without_numbers_of_their_own_confirm_by_their_residuals() {
        let shrunk = |clips| Shrunk { clips, usual: share(0.9), ..Shrunk::default() };
        assert!(shrinks_in_most(&shrunk([2, 2]), 0.99) && !shrinks_in_most(&shrunk([1, 2]), 0.99));
        assert!(!shrinks_in_most(&Shrunk { clips: [2, 2], ..Shrunk::default() }, 0.05), "nothing closes");
    }
}
