//! How much numbers scatter from clip to clip, estimated from the clips: expectation maximisation, clips as witnesses.
//!
//! With every clip's own numbers at their best `u` and their covariance `C` there, the variance that explains them is the
//! mean of `u^2 + C` (Dempster, Laird & Rubin 1977). It is called between fits, until it changes no more.

use super::linear::ClipFit;
use super::problem::Random;

/// Own numbers that scatter alike: one variance for all of them, a velocity's x and y for instance.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Indices of the own numbers.
    pub members: Vec<usize>,
    /// What is known about their sigma beforehand counts as much as so many clips.
    pub prior_clips: f64,
    /// Sigma known beforehand.
    pub prior_sigma: f64,
    /// Sigma never falls below this: a scatter of exactly zero could not come back.
    pub floor: f64,
}

/// New sigmas for the groups, into `random`; the largest relative change of one. Groups of held numbers stay held.
pub fn reestimate(clips: &[ClipFit], groups: &[Group], random: &mut [Random]) -> f64 {
    let mut change: f64 = 0.0;
    for group in groups {
        let acting: Vec<usize> = group.members.iter().copied().filter(|k| random[*k].sigma > 0.0).collect();
        let Some(before) = acting.first().map(|k| random[*k].sigma) else { continue };
        let squares =
            |clip: &ClipFit| acting.iter().map(|k| clip.own[*k].powi(2) + clip.own_covariance[(*k, *k)]).sum::<f64>();
        let count = (clips.len() * acting.len()) as f64;
        let known = group.prior_clips * acting.len() as f64;
        let sum = clips.iter().map(squares).sum::<f64>() + known * group.prior_sigma.powi(2);
        let sigma = (sum / (count + known)).sqrt().max(group.floor);
        change = change.max((sigma / before).ln().abs());
        acting.into_iter().for_each(|k| random[k].sigma = sigma);
    }
    change
}

#[cfg(test)]
mod tests {
    use super::super::{ClipModel, Impossible, Options, Unknown, fit};
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    /// A level that all clips share, an offset of every clip's own, noise of one sigma.
    struct Levels(Vec<Vec<f64>>);

    impl ClipModel for Levels {
        fn clips(&self) -> usize {
            self.0.len()
        }

        fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            out.clear();
            out.extend(self.0[clip].iter().map(|y| y - shared[0] - own[0]));
            Ok(())
        }
    }

    #[test]
    fn the_scatter_that_clips_were_drawn_with_is_found_whatever_was_assumed() {
        let mut draw = rand_pcg::Pcg64::seed_from_u64(3);
        // Sum of twelve uniform numbers: a normal one to the eye.
        let mut normal = || (0..12).map(|_| draw.random::<f64>()).sum::<f64>() - 6.0;
        let offsets: Vec<f64> = (0..200).map(|_| 2.0 * normal()).collect();
        let clips = offsets.into_iter().map(|offset| (0..5).map(|_| 7.0 + offset + normal()).collect()).collect();
        let model = Levels(clips);
        let level = Unknown { name: "level".into(), start: 0.0, lower: -100.0, upper: 100.0, step: 1e-3 };
        let group = Group { members: vec![0], prior_clips: 0.0, prior_sigma: 0.0, floor: 1e-6 };
        for assumed in [0.1, 30.0] {
            let mut random = [Random { name: "offset".into(), sigma: assumed, step: 1e-3 }];
            for _ in 0..200 {
                let unknowns = std::slice::from_ref(&level);
                let fit = fit(&model, unknowns, &random, &Options::default(), |_, _| true).expect("an answer");
                if reestimate(&fit.clips, std::slice::from_ref(&group), &mut random) < 1e-4 {
                    break;
                }
            }
            assert!((random[0].sigma / 2.0 - 1.0).abs() < 0.15, "from {assumed}: {}", random[0].sigma);
        }
    }
}
