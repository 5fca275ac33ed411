//! How far shares of success in one world predict those in another, policy by policy: linearly, and by their order.

use super::share::Share;
use rand_distr::{Binomial, Distribution as _};
use rand_pcg::Pcg64;
use serde::Serialize;

/// Drawings of other sets of trials.
const DRAWINGS: usize = 500;
/// Scatter never counts for more than the rest of a variance.
const LEAST: f64 = 0.2;
/// Stream of what is drawn here.
const STREAM: u128 = 0x0061_6772_6565;

/// Pearson's correlation; 1 where both differ from their means alike, NaN where one of them does not vary.
pub fn pearson(first: &[f64], second: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (a, b) = (mean(first), mean(second));
    let sum = |of: fn(f64, f64) -> f64| first.iter().zip(second).map(|(x, y)| of(x - a, y - b)).sum::<f64>();
    let (both, own, other) = (sum(|x, y| x * y), sum(|x, _| x * x), sum(|_, y| y * y));
    if first.iter().zip(second).all(|(x, y)| x - a == y - b) { 1.0 } else { both / (own * other).sqrt() }
}

/// Mean over policies of the largest difference in `real` to a policy that `simulated` ranks the other way (SIMPLER, eq. 2).
pub fn mean_maximum_rank_violation(simulated: &[f64], real: &[f64]) -> f64 {
    let largest = |i: usize| {
        let wrong = |j: &usize| (simulated[i] > simulated[*j]) != (real[i] > real[*j]);
        (0..real.len()).filter(wrong).map(|j| (real[i] - real[j]).abs()).fold(0.0, f64::max)
    };
    (0..real.len()).map(largest).sum::<f64>() / real.len() as f64
}

/// A policy on a task in two worlds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// In the world that is to predict.
    pub simulated: Share,
    /// In the one that is predicted.
    pub real: Share,
}

/// How two worlds agree; intervals are what other trials of the same policies on the same tasks could have given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agreement {
    /// Policies and tasks.
    pub cells: usize,
    /// Pearson's correlation of the shares.
    pub pearson: f64,
    /// Interval of the correlation that the shares would have after trials without end.
    pub pearson_interval: [f64; 2],
    /// Mean maximum rank violation.
    pub rank_violation: f64,
    /// Its interval.
    pub rank_violation_interval: [f64; 2],
}

/// How two worlds agree about cells; `None` for less than three of them. Rank violations are counted within `groups`, which name
/// the task of each cell: shares on different tasks are in no order. `seed` draws the bootstrap.
///
/// Trials scatter shares more widely than the policies differ, which lowers a correlation. So trials are drawn again from shares that
/// are drawn in towards their mean by what scatter explains, and each correlation is divided by what scatter leaves of it
/// (Spearman 1904); the interval is the middle part of what comes of that.
pub fn agreement(cells: &[Cell], groups: &[usize], level: f64, seed: u64) -> Option<Agreement> {
    if cells.len() < 3 {
        return None;
    }
    let mut generator = Pcg64::new(u128::from(seed), STREAM);
    let side = |of: fn(&Cell) -> Share| -> Vec<Share> { cells.iter().map(of).collect() };
    let [simulated, real] = [side(|cell| cell.simulated), side(|cell| cell.real)];
    let [probable, true_ones] = [drawn_in(&simulated), drawn_in(&real)];
    let (mut correlations, mut violations) = (Vec::new(), Vec::new());
    for _ in 0..DRAWINGS {
        let again = [redrawn(&simulated, &probable, &mut generator), redrawn(&real, &true_ones, &mut generator)];
        let [first, second] = [values(&again[0]), values(&again[1])];
        let left = (reliability(&again[0]) * reliability(&again[1])).sqrt();
        correlations.push((pearson(&first, &second) / left).clamp(-1.0, 1.0));
        violations.push(violation(&first, &second, groups));
    }
    let [first, second] = [values(&simulated), values(&real)];
    Some(Agreement {
        cells: cells.len(),
        pearson: pearson(&first, &second),
        pearson_interval: percentiles(correlations, level),
        rank_violation: violation(&first, &second, groups),
        rank_violation_interval: percentiles(violations, level),
    })
}

fn values(shares: &[Share]) -> Vec<f64> {
    shares.iter().map(|share| share.value()).collect()
}

/// Mean over all cells of the largest violation within their groups.
fn violation(simulated: &[f64], real: &[f64], groups: &[usize]) -> f64 {
    let mut named: Vec<usize> = groups.to_vec();
    named.sort_unstable();
    named.dedup();
    let of = |group: usize| {
        let within = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(groups).filter(|(_, other)| **other == group).map(|(value, _)| *value).collect()
        };
        let (simulated, real) = (within(simulated), within(real));
        mean_maximum_rank_violation(&simulated, &real) * real.len() as f64
    };
    named.into_iter().map(of).sum::<f64>() / real.len() as f64
}

/// How much of the variance of shares is no scatter of trials; no less than [`LEAST`], below which it is not known.
fn reliability(shares: &[Share]) -> f64 {
    let values = values(shares);
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let of = |share: &Share| share.value() * (1.0 - share.value()) / (share.trials.max(2) - 1) as f64;
    let scatter = shares.iter().map(of).sum::<f64>() / count;
    if variance > 0.0 { (1.0 - scatter / variance).max(LEAST) } else { LEAST }
}

/// Shares as far from their mean as they would be without scatter, none of them certain.
fn drawn_in(shares: &[Share]) -> Vec<f64> {
    let (values, narrower) = (values(shares), reliability(shares).sqrt());
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let of = |(value, share): (&f64, &Share)| {
        let end = 0.5 / (share.trials as f64 + 1.0);
        (mean + narrower * (value - mean)).clamp(end, 1.0 - end)
    };
    values.iter().zip(shares).map(of).collect()
}

/// As many trials again.
fn redrawn(shares: &[Share], chances: &[f64], generator: &mut Pcg64) -> Vec<Share> {
    let of = |(share, chance): (&Share, &f64)| {
        let successes = Binomial::new(share.trials, *chance).map_or(0, |trials| trials.sample(generator));
        Share { successes, ..*share }
    };
    shares.iter().zip(chances).map(of).collect()
}

/// The ends of the middle part of what was drawn.
fn percentiles(mut drawn: Vec<f64>, level: f64) -> [f64; 2] {
    drawn.retain(|value| value.is_finite());
    drawn.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = (share * (drawn.len().max(1) - 1) as f64).round() as usize;
        drawn.get(place).copied().unwrap_or(f64::NAN)
    };
    [at(0.5 - 0.5 * level), at(0.5 + 0.5 * level)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shares of success on the robot and in the simulation, policies in one order (SIMPLER, Li et al. 2024: its tables).
    const PUBLISHED: [(&[f64], &[f64], f64, f64); 9] = [
        (&[0.907, 0.853, 0.920, 0.760, 0.133, 0.293], &[0.787, 0.857, 0.710, 0.567, 0.027, 0.170], 0.975, 0.031),
        (&[0.733, 0.633, 0.583, 0.450, 0.017, 0.350], &[0.779, 0.442, 0.354, 0.317, 0.050, 0.042], 0.856, 0.111),
        (&[0.333, 0.815, 0.704, 0.519, 0.000, 0.148], &[0.157, 0.601, 0.463, 0.296, 0.000, 0.009], 0.983, 0.000),
        (&[0.630, 0.926, 0.889, 0.741, 0.000, 0.519], &[0.343, 0.861, 0.667, 0.891, 0.278, 0.444], 0.771, 0.123),
        (&[0.074, 0.185, 0.185, 0.407, 0.000, 0.000], &[0.037, 0.065, 0.130, 0.213, 0.000, 0.000], 0.969, 0.000),
        (&[0.000, 0.333, 0.417], &[0.000, 0.125, 0.472], 0.827, 0.000),
        (&[0.000, 0.250, 0.083], &[0.042, 0.083, 0.097], 0.571, 0.111),
        (&[0.000, 0.000, 0.125], &[0.000, 0.000, 0.042], 1.000, 0.000),
        (&[0.000, 0.250, 0.400], &[0.000, 0.431, 0.569], 0.989, 0.000),
    ];

    #[test]
    fn published_pairs_are_met_to_the_digit() {
        for (real, simulated, r, violation) in PUBLISHED {
            let found = [pearson(simulated, real), mean_maximum_rank_violation(simulated, real)];
            assert!(
                found.iter().zip([r, violation]).all(|(found, published)| (found - published).abs() <= 0.0005 + 1e-9),
                "{found:?} is not {r}, {violation}"
            );
        }
    }

    #[test]
    fn what_does_not_vary_correlates_with_nothing() {
        assert!(pearson(&[0.5, 0.5, 0.5], &[0.1, 0.2, 0.4]).is_nan());
        assert_eq!(pearson(&[0.5, 0.5], &[0.1, 0.1]), 1.0);
    }

    #[test]
    fn ranks_count_within_a_task_alone_and_the_seed_draws_the_interval() {
        let cell = |simulated, real| Cell {
            simulated: Share { successes: simulated, trials: 100 },
            real: Share { successes: real, trials: 50 },
        };
        let cells = [cell(90, 20), cell(70, 10), cell(60, 45), cell(30, 40)];
        let within = agreement(&cells, &[0, 0, 1, 1], 0.95, 7).expect("cells");
        let across = agreement(&cells, &[0; 4], 0.95, 7).expect("cells");
        assert_eq!((within.rank_violation, across.pearson), (0.0, within.pearson));
        assert!(across.rank_violation > 0.4);
        let [low, high] = within.pearson_interval;
        assert!(low < within.pearson && within.pearson < high, "{within:?}");
        assert_eq!(agreement(&cells, &[0; 4], 0.95, 7), Some(across));
        assert_eq!(agreement(&cells[..2], &[0; 2], 0.95, 7), None);
    }
}
