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
    /// For each clip and group of sensors (arm, object; those that there are) the sum of squares and the number of residuals.
    sums: Vec<Vec<(f64, f64)>>,
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
        let clips: Vec<(usize, Vec<f64>)> = clips.iter().zip(judged).map(one).collect::<Option<_>>()?;
        let sums = clips.iter().map(|(clip, residuals)| sums(bench.evidence, *clip, residuals)).collect();
        Some(Self { clips, sums })
    }

    /// Mean square: the mean over the groups of sensors, so that a thousand encoder rows do not drown the object.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        mean(&self.sums, &(0..self.clips.len()).collect::<Vec<_>>())
    }

    /// Mean square of every group of sensors.
    #[must_use]
    pub fn groups(&self) -> Vec<f64> {
        group_means(&self.sums, &(0..self.clips.len()).collect::<Vec<_>>())
    }

    /// Share by which the mean square shrinks from `before` to this, with an interval from drawing clips anew.
    #[must_use]
    pub fn shrink(&self, before: &Self, seed: u64) -> Share {
        let (before, after) = (&before.sums, &self.sums);
        let of = |drawn: &[usize]| 1.0 - mean(after, drawn) / mean(before, drawn).max(f64::MIN_POSITIVE);
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

fn sums(evidence: &impl Evidence, clip: usize, residuals: &[f64]) -> Vec<(f64, f64)> {
    let mut sums = vec![(0.0, 0.0); 2];
    for (row, residual) in evidence.rows(clip).iter().zip(residuals) {
        let group = &mut sums[usize::from(evidence.channels()[row.channel].joint.is_none())];
        *group = (group.0 + residual * residual, group.1 + 1.0);
    }
    sums
}

fn group_means(sums: &[Vec<(f64, f64)>], drawn: &[usize]) -> Vec<f64> {
    let groups = sums.first().map_or(0, Vec::len);
    let of = |group: usize| {
        let add = |(sum, count): (f64, f64), k: &usize| (sum + sums[*k][group].0, count + sums[*k][group].1);
        let (sum, count) = drawn.iter().fold((0.0, 0.0), add);
        (count > 0.0).then(|| sum / count)
    };
    (0..groups).filter_map(of).collect()
}

fn mean(sums: &[Vec<(f64, f64)>], drawn: &[usize]) -> f64 {
    let means = group_means(sums, drawn);
    means.iter().sum::<f64>() / means.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residuals(sizes: &[f64]) -> Residuals {
        let clips = sizes.iter().enumerate().map(|(clip, size)| (clip, vec![*size; 10])).collect();
        Residuals { clips, sums: sizes.iter().map(|size| vec![(10.0 * size * size, 10.0), (0.0, 0.0)]).collect() }
    }

    #[test]
    fn the_shrink_is_one_less_the_ratio_of_mean_squares_and_lies_in_its_interval() {
        let shrink = residuals(&[1.0, 1.0, 1.2, 0.9]).shrink(&residuals(&[2.0, 2.1, 2.2, 1.9]), 1);
        assert!((shrink.value - (1.0 - (1.0 + 1.0 + 1.44 + 0.81) / (4.0 + 4.41 + 4.84 + 3.61))).abs() < 1e-12);
        assert!(shrink.ci90[0] < shrink.value && shrink.value < shrink.ci90[1], "{shrink:?}");
        assert!(shrink.ci90[1] - shrink.ci90[0] < 0.1, "{shrink:?}");
    }
}
