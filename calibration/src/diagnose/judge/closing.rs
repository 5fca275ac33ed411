//! How much of the gap a fit closes when nothing of a clip's own is fitted.

use super::gap::{Residuals, Typical};

use crate::answer::diagnosis::SensorGap;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use inference::admit::Split;
use inference::likelihood::Group;

/// A cause closes more than this share of the gap: what helps only beside nuisance parameters of clips is none. A gap that widens by less
/// does so by chance, and what leaves more of what the best gains on the arm is not what acts there (a choice).
pub const MIN_SHARE_CLOSED: f64 = 0.1;
/// A gap smaller than this, over its floor, is taken for this size.
const MIN_GAP_RATIO: f64 = 1.2;

/// How much of the way is gone between two hypotheses on the clips of a search, of the group of sensors in which it is
/// largest; 0 where the gap widens on clips that were not fitted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Closed {
    /// With the joints in contact among the groups.
    pub most: f64,
    /// Of the groups that have a gap: how joints yield in contact, any two engines differ by.
    pub of_gap: f64,
}

#[cfg(test)]
impl Closed {
    /// The same with and without the joints in contact.
    pub fn all(share: f64) -> Self {
        Self { most: share, of_gap: share }
    }
}

/// What closes; `whole`: what the baseline leaves.
pub fn closes(bench: &Bench<'_>, split: &Split, whole: &[Typical], hypotheses: [&Hypothesis; 2]) -> Closed {
    let on = |clips: &[usize]| -> Option<Vec<f64>> {
        let [before, after] = hypotheses.map(|hypothesis| Residuals::at(bench, hypothesis, clips));
        let (before, after) = (before?, after?);
        let left = SensorGap::of_groups(&before.typical(), &after.typical());
        let shares = left.iter().zip(whole).map(|(left, whole)| share(left, whole.mean_square));
        let in_contact = before.typical_of(Group::Contact).zip(after.typical_of(Group::Contact));
        let contact = in_contact.map(|(before, after)| way(before.mean_square, after.mean_square, before.floor));
        Some(shares.chain(contact).collect())
    };
    let (Some(all), Some(choose)) = (on(&split.searched()), on(split.elsewhere())) else { return Closed::default() };
    let harmless = |(_, choose): &(&f64, &f64)| **choose > -MIN_SHARE_CLOSED;
    let most = |of: &[f64]| of.iter().zip(&choose).filter(harmless).map(|(all, _)| *all).fold(0.0, f64::max);
    Closed { most: most(&all), of_gap: most(&all[..whole.len().min(all.len())]) }
}

/// How much of the way from the gap down to noise is gone, on a logarithmic scale.
fn way(before: f64, after: f64, floor: f64) -> f64 {
    (before / after).ln() / (before / floor).max(MIN_GAP_RATIO).ln()
}

/// The same of what is left of a gap. A real arm's gap lies so far above the noise that nobody comes down to it: there the plain
/// share of the baseline's gap counts, where that is more.
fn share(left: &SensorGap, whole: f64) -> f64 {
    let way = way(left.before, left.after, left.floor);
    let beyond_numerics = left.before - left.floor > left.numerics();
    if way > 0.0 && beyond_numerics && !left.of_object() {
        way.max((left.before - left.after) / (whole - left.floor))
    } else {
        way
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::diagnosis::Sensors;

    #[test]
    fn far_above_the_noise_the_plain_share_of_the_whole_gap_counts() {
        let left = |before, after| SensorGap { sensors: Sensors::Joints, before, after, floor: 1.0 };
        assert!((share(&left(1e5, 2e4), 1e5) - 0.8).abs() < 1e-3, "four fifths, and 14 % of the way");
        // A fifth of what a first effect left, itself a hundredth: of the whole next to nothing.
        assert!(share(&left(1e3, 8e2), 1e5) < 0.05);
        assert!((share(&left(1e3, 1.0), 1e5) - 1.0).abs() < 1e-9, "all the way down");
        assert!(share(&left(2.0, 3.0), 2.0) < 0.0);
    }
}
