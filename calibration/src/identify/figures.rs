//! How far the twin is off over sets of clips, and which clips are unlike the others, for every identification alike.

use crate::answer::identification::{ClipGap, Figures, Gap};
use inference::statistics::median;

/// Use of a clip that was fitted.
pub(super) const USE_FITTED: &str = "fitted";
/// Use of a clip that was not.
pub(super) const USE_HELD_OUT: &str = "held out";

/// Means over the clips of each use.
pub(super) fn gap(clips: &[ClipGap]) -> Gap {
    let mean = |used: &str, of: fn(&ClipGap) -> Figures| {
        Figures::mean(&clips.iter().filter(|clip| clip.used == used).map(of).collect::<Vec<_>>())
    };
    Gap {
        train: mean(USE_FITTED, |clip| clip.after),
        holdout: mean(USE_HELD_OUT, |clip| clip.after),
        train_before: mean(USE_FITTED, |clip| clip.before),
        holdout_before: mean(USE_HELD_OUT, |clip| clip.before),
    }
}

/// A clip whose error is far from that of the middle clip.
pub(super) struct Odd<'a> {
    pub(super) clip: &'a ClipGap,
    pub(super) error: f64,
    /// That of the middle clip.
    pub(super) usual: f64,
}

/// A clip whose error is so many times the usual one is odd (a choice): a clock that jumped, a hand on the arm, an object hit on an edge.
const TIMES_THE_USUAL_ERROR: f64 = 5.0;

/// Clips whose error is far beyond that of the middle clip, and more than `least`.
pub(super) fn odd(clips: &[ClipGap], error: impl Fn(&ClipGap) -> f64, least: f64) -> Vec<Odd<'_>> {
    let usual = median(clips.iter().map(&error)).unwrap_or(0.0);
    let all = clips.iter().map(|clip| Odd { clip, error: error(clip), usual });
    all.filter(|odd| clips.len() > 2 && odd.error > (TIMES_THE_USUAL_ERROR * usual).max(least)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(used: &str, rad: f64) -> ClipGap {
        let figures = |rad| Figures { joint_rms_rad: Some(rad), ..Figures::default() };
        ClipGap {
            file: format!("{rad}"),
            used: used.into(),
            after: figures(rad),
            before: figures(2.0 * rad),
            ..ClipGap::default()
        }
    }

    #[test]
    fn means_are_over_the_clips_of_one_use_whatever_their_order() {
        let mut clips = vec![clip(USE_FITTED, 0.3), clip(USE_HELD_OUT, 0.1), clip(USE_FITTED, 0.4)];
        let first = gap(&clips);
        assert!((first.train.joint_rms_rad.expect("fitted") - 0.125_f64.sqrt()).abs() < 1e-12);
        assert_eq!((first.holdout.joint_rms_rad, first.holdout_before.joint_rms_rad), (Some(0.1), Some(0.2)));
        clips.reverse();
        assert_eq!(gap(&clips), first);
        assert_eq!(gap(&clips[..1]).holdout, Figures::default());
    }

    #[test]
    fn a_clip_unlike_the_others_is_odd_and_of_two_none_is() {
        let clips: Vec<ClipGap> = [0.01, 0.012, 0.09, 0.011].map(|rad| clip(USE_FITTED, rad)).into();
        let error = |clip: &ClipGap| clip.after.joint_rms_rad.unwrap_or_default();
        let files = |least| odd(&clips, error, least).iter().map(|odd| odd.clip.file.clone()).collect::<Vec<_>>();
        assert_eq!((files(0.0), files(0.1).len()), (vec!["0.09".to_owned()], 0));
        assert!(odd(&clips[1..3], error, 0.0).is_empty());
    }
}
