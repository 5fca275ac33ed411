//! The gap: mean square of residuals in sigmas of the sensors, and by how much it shrinks from one hypothesis to another.

use super::answer::Share;
use super::evidence::Evidence;
use super::fit::{Bench, Hypothesis};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Residuals of clips at a hypothesis, each clip's own numbers at their best; not weighted.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Clip and residuals.
    pub clips: Vec<(usize, Vec<f64>)>,
}

impl Residuals {
    /// Of clips that were not fitted.
    #[must_use]
    pub fn at<E: Evidence>(
        bench: &Bench<'_, E>,
        hypothesis: &Hypothesis,
        clips: &[usize],
        weights: &[f64],
    ) -> Option<Self> {
        let judged = bench.judge(hypothesis, clips, weights)?;
        let one = |(clip, (own, _)): (&usize, (Vec<f64>, f64))| {
            let mut out = Vec::new();
            bench.evidence.residuals(*clip, &hypothesis.full, &own, &mut out).ok()?;
            Some((*clip, out))
        };
        clips.iter().zip(judged).map(one).collect::<Option<_>>().map(|clips| Self { clips })
    }

    /// Mean square.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        mean(&self.sums(), &(0..self.clips.len()).collect::<Vec<_>>())
    }

    fn sums(&self) -> Vec<(f64, f64)> {
        self.clips.iter().map(|(_, r)| (r.iter().map(|r| r * r).sum(), r.len() as f64)).collect()
    }

    /// Share by which the mean square shrinks from `before` to this, with an interval from drawing clips anew.
    #[must_use]
    pub fn shrink(&self, before: &Self, seed: u64) -> Share {
        let (before, after) = (before.sums(), self.sums());
        let of = |drawn: &[usize]| 1.0 - mean(&after, drawn) / mean(&before, drawn).max(f64::MIN_POSITIVE);
        let all: Vec<usize> = (0..after.len()).collect();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut drawn: Vec<f64> =
            (0..DRAWS).map(|_| of(&all.iter().map(|_| rng.random_range(0..all.len())).collect::<Vec<_>>())).collect();
        drawn.sort_unstable_by(f64::total_cmp);
        Share { value: of(&all), ci90: [drawn[DRAWS / 20], drawn[DRAWS - 1 - DRAWS / 20]] }
    }
}

/// Draws of the bootstrap.
const DRAWS: usize = 1000;

fn mean(sums: &[(f64, f64)], drawn: &[usize]) -> f64 {
    let (sum, count) = drawn.iter().fold((0.0, 0.0), |(sum, count), k| (sum + sums[*k].0, count + sums[*k].1));
    sum / f64::max(count, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residuals(sizes: &[f64]) -> Residuals {
        Residuals { clips: sizes.iter().enumerate().map(|(clip, size)| (clip, vec![*size; 10])).collect() }
    }

    #[test]
    fn the_shrink_is_one_less_the_ratio_of_mean_squares_and_lies_in_its_interval() {
        let shrink = residuals(&[1.0, 1.0, 1.2, 0.9]).shrink(&residuals(&[2.0, 2.1, 2.2, 1.9]), 1);
        assert!((shrink.value - (1.0 - (1.0 + 1.0 + 1.44 + 0.81) / (4.0 + 4.41 + 4.84 + 3.61))).abs() < 1e-12);
        assert!(shrink.ci90[0] < shrink.value && shrink.value < shrink.ci90[1], "{shrink:?}");
        assert!(shrink.ci90[1] - shrink.ci90[0] < 0.1, "{shrink:?}");
    }
}
