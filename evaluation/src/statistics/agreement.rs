//! How far shares of success in one world predict those in another, policy by policy: linearly, and by their order.

use super::share::Share;
use rand::RngExt as _;
use rand_pcg::Pcg64;
use serde::Serialize;

/// Drawings of other sets of trials.
const DRAWINGS: usize = 2000;
/// Stream of what is drawn here.
const STREAM: u128 = 0x6167_7265_65;

/// Pearson's correlation; 1 where both differ from their means alike, NaN where one of them does not vary.
#[must_use]
pub fn pearson(first: &[f64], second: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (a, b) = (mean(first), mean(second));
    let sum = |of: fn(f64, f64) -> f64| first.iter().zip(second).map(|(x, y)| of(x - a, y - b)).sum::<f64>();
    let (both, own, other) = (sum(|x, y| x * y), sum(|x, _| x * x), sum(|_, y| y * y));
    if first.iter().zip(second).all(|(x, y)| x - a == y - b) { 1.0 } else { both / (own * other).sqrt() }
}

/// Mean over policies of the largest difference in `real` to a policy that `simulated` ranks the other way (SIMPLER, eq. 2).
#[must_use]
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
    /// Its interval.
    pub pearson_interval: [f64; 2],
    /// Mean maximum rank violation.
    pub rank_violation: f64,
    /// Its interval.
    pub rank_violation_interval: [f64; 2],
}

/// How two worlds agree about cells; `None` for less than three of them. Rank violations are counted within `groups`, which name
/// the task of each cell: shares on different tasks are in no order. `seed` draws the bootstrap.
#[must_use]
pub fn agreement(cells: &[Cell], groups: &[usize], level: f64, seed: u64) -> Option<Agreement> {
    if cells.len() < 3 {
        return None;
    }
    let mut generator = Pcg64::new(u128::from(seed), STREAM);
    let values = |cells: &[Cell]| -> [Vec<f64>; 2] {
        [cells.iter().map(|cell| cell.simulated.value()).collect(), cells.iter().map(|cell| cell.real.value()).collect()]
    };
    let [simulated, real] = values(cells);
    let (r, violation) = (pearson(&simulated, &real), violation(&simulated, &real, groups));
    let (mut correlations, mut violations) = (Vec::new(), Vec::new());
    for _ in 0..DRAWINGS {
        let again: Vec<Cell> = cells
            .iter()
            .map(|cell| Cell { simulated: redrawn(cell.simulated, &mut generator), real: redrawn(cell.real, &mut generator) })
            .collect();
        let [simulated, real] = values(&again);
        correlations.push(pearson(&simulated, &real));
        violations.push(self::violation(&simulated, &real, groups));
    }
    Some(Agreement {
        cells: cells.len(),
        pearson: r,
        pearson_interval: turned_over(r, correlations, level),
        rank_violation: violation,
        rank_violation_interval: percentiles(violations, level),
    })
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

/// As many trials again, with the share that Jeffreys's prior expects behind it, so that none is certain.
fn redrawn(share: Share, generator: &mut Pcg64) -> Share {
    let p = (share.successes as f64 + 0.5) / (share.trials as f64 + 1.0);
    Share::of((0..share.trials).map(|_| generator.random_bool(p)))
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

/// The interval of a correlation: what was drawn scatters about `r` as `r` does about the truth, on Fisher's scale.
fn turned_over(r: f64, drawn: Vec<f64>, level: f64) -> [f64; 2] {
    let fisher = |r: f64| r.clamp(-0.999_999, 0.999_999).atanh();
    let [low, high] = percentiles(drawn.into_iter().map(fisher).collect(), level);
    [(2.0 * fisher(r) - high).tanh(), (2.0 * fisher(r) - low).tanh()]
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
