//! What clips tell about themselves once the fit no longer leans on them. A clip on which the fit rests alone leaves no
//! residual whatever is wrong, so its score says that all is well. Had it been left out, its score would be larger: the
//! jackknife's correction of a sandwich (CR3, Bell & McCaffrey 2002).

use super::least_squares::Fit;
use nalgebra::{DMatrix, DVector};

/// Directions that a clip tells alone keep this share of its own information.
const MIN_SHARE_OF_OTHERS: f64 = 1e-9;

/// Makes each score of a fit's clips that of a fit without the clip. Numbers in `held` were not free.
pub fn without_leaning(fit: &mut Fit, held: &[bool]) {
    let information = fit.information();
    let free: Vec<usize> = (0..held.len()).filter(|k| !held[*k] && information[(*k, *k)] > 0.0).collect();
    let n = free.len();
    let scale: Vec<f64> = free.iter().map(|k| information[(*k, *k)].sqrt()).collect();
    let part = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(free[i], free[j])] / (scale[i] * scale[j]));
    let all = part(&information);
    for clip in &mut fit.clips {
        let own = part(&clip.information);
        let others = &all - &own * (1.0 - MIN_SHARE_OF_OTHERS);
        let Some(factor) = others.cholesky() else { continue };
        for score in &mut clip.scores {
            let scaled = DVector::from_fn(n, |i, _| score[free[i]] / scale[i]);
            let corrected = &all * factor.solve(&scaled);
            free.iter().enumerate().for_each(|(i, k)| score[*k] = corrected[i] * scale[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::interval::LEVEL;
    use super::super::{ClipModel, Impossible, Intervals, Schedule, Unknown, fit};
    use super::*;

    /// Means of four clips of one row each: three of sigma 1, and one that is held for a thousand times more exact.
    struct Means([f64; 4]);

    impl ClipModel for Means {
        fn clips(&self) -> usize {
            4
        }

        fn residuals(&self, clip: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            let sigma = if clip == 3 { 1e-3 } else { 1.0 };
            out.clear();
            out.push((self.0[clip] - shared[0]) / sigma);
            Ok(())
        }
    }

    #[test]
    fn a_clip_that_the_fit_rests_on_alone_does_not_vouch_for_itself() {
        let unknown = Unknown { name: "a".into(), start: 0.0, lower: -100.0, upper: 100.0, step: 1e-4 };
        let mut found =
            fit(&Means([1.0, -2.0, 1.5, 6.0]), &[unknown], &[], &Schedule::default(), |_, _| true).expect("one");
        assert!((found.shared[0] - 6.0).abs() < 1e-3);
        let before = Intervals::new(&found, &[false], LEVEL).half_width[0];
        without_leaning(&mut found, &[false]);
        let after = Intervals::new(&found, &[false], LEVEL).half_width[0];
        // The other three say 0.2; the interval has to reach there.
        assert!(before < 0.01 && after > 5.8, "{before} {after}");
    }
}
