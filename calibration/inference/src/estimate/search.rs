//! Search without slopes: whatever asks for points and is given their costs. One loop serves every way of searching, so
//! that budget, threads, interruption and resumption are the same for all.

use super::problem::Unknown;
use rayon::prelude::*;

/// A way of searching, in units of the bounds: every coordinate of a point from 0 to 1.
pub trait Search {
    /// Points whose costs are wanted.
    fn ask(&mut self) -> Vec<Vec<f64>>;
    /// The costs of those points, in their order; infinite where there is no answer.
    fn tell(&mut self, costs: &[f64]);
    /// Whether going on would change nothing any more.
    fn arrived(&self) -> bool;
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The best numbers.
    pub numbers: Vec<f64>,
    pub cost: f64,
    pub evaluations: usize,
    /// Best cost after each round.
    pub history: Vec<f64>,
    /// Whether the search ended by itself.
    pub arrived: bool,
}

/// Searches until `evaluations` costs are known, the search arrives, or `watch` answers `false`.
///
/// `costs_before`: costs of earlier rounds in their order; the search is brought back to where it was
/// with them. `watch` gets every new round's costs and the best so far.
///
/// ```
/// use inference::estimate::{Evolution, Unknown, minimise};
/// use inference::estimate::search::start;
///
/// let unknown = |name: &str| Unknown { name: name.into(), start: 0.5, lower: -2.0, upper: 2.0, step: 1e-4 };
/// let unknowns = [unknown("x"), unknown("y")];
/// let cost = |at: &[f64]| (at[0] - 1.0).powi(2) + (at[1] + 0.3).powi(2);
/// let mut search = Evolution::new(&start(&unknowns), 1);
/// let found = minimise(&mut search, &unknowns, 2000, &[], cost, |_, _| true);
/// assert!((found.numbers[0] - 1.0).abs() < 1e-2 && (found.numbers[1] + 0.3).abs() < 1e-2);
/// ```
pub fn minimise(
    search: &mut impl Search,
    unknowns: &[Unknown],
    evaluations: usize,
    costs_before: &[Vec<f64>],
    cost: impl Fn(&[f64]) -> f64 + Sync,
    mut watch: impl FnMut(&[f64], &Found) -> bool,
) -> Found {
    let start = unknowns.iter().map(|unknown| unknown.start).collect();
    let mut found = Found { numbers: start, cost: f64::INFINITY, evaluations: 0, history: Vec::new(), arrived: false };
    let mut earlier = costs_before.iter();
    loop {
        found.arrived = search.arrived();
        if found.arrived || found.evaluations >= evaluations {
            return found;
        }
        let points: Vec<Vec<f64>> = search.ask().iter().map(|point| numbers(unknowns, point)).collect();
        let known = earlier.next().filter(|costs| costs.len() == points.len());
        let costs = known.cloned().unwrap_or_else(|| points.par_iter().map(|point| finite(cost(point))).collect());
        search.tell(&costs);
        found.evaluations += costs.len();
        for (point, cost) in points.iter().zip(&costs) {
            if *cost < found.cost {
                (found.numbers, found.cost) = (point.clone(), *cost);
            }
        }
        found.history.push(found.cost);
        if known.is_none() && !watch(&costs, &found) {
            return found;
        }
    }
}

/// What an impossible point costs: searches add and compare costs, so it is large, not infinite.
const COST_WITHOUT_ANSWER: f64 = 1e30;

fn finite(cost: f64) -> f64 {
    if cost.is_finite() { cost } else { COST_WITHOUT_ANSWER }
}

fn numbers(unknowns: &[Unknown], point: &[f64]) -> Vec<f64> {
    let number = |(unknown, share): (&Unknown, &f64)| {
        (unknown.lower + share * (unknown.upper - unknown.lower)).clamp(unknown.lower, unknown.upper)
    };
    unknowns.iter().zip(point).map(number).collect()
}

/// Where a search begins, in units of the bounds.
pub fn start(unknowns: &[Unknown]) -> Vec<f64> {
    let share = |u: &Unknown| if u.upper > u.lower { (u.start - u.lower) / (u.upper - u.lower) } else { 0.5 };
    unknowns.iter().map(|unknown| share(unknown).clamp(0.0, 1.0)).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Evolution, Swarm};
    use super::*;

    fn unknowns(n: usize) -> Vec<Unknown> {
        let unknown = |i| Unknown { name: format!("x{i}"), start: 3.0, lower: -5.0, upper: 5.0, step: 1e-3 };
        (0..n).map(unknown).collect()
    }

    /// Rosenbrock's valley; its lowest point is (1, 1).
    fn valley(x: &[f64]) -> f64 {
        100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
    }

    fn lowest(mut search: impl Search, costs_before: &[Vec<f64>], evaluations: usize) -> (Found, Vec<Vec<f64>>) {
        let mut rounds = costs_before.to_vec();
        let found = minimise(&mut search, &unknowns(2), evaluations, costs_before, valley, |costs, _| {
            rounds.push(costs.to_vec());
            true
        });
        (found, rounds)
    }

    #[test]
    fn both_searches_find_the_end_of_a_curved_valley() {
        let start = start(&unknowns(2));
        for found in [lowest(Swarm::new(&start, 1), &[], 6000).0, lowest(Evolution::new(&start, 1), &[], 6000).0] {
            assert!(found.cost < 1e-4, "{found:?}");
            assert!(found.numbers.iter().all(|x| (x - 1.0).abs() < 0.02), "{:?}", found.numbers);
        }
    }

    #[test]
    fn a_search_goes_on_from_what_it_was_told_before_as_if_it_had_never_stopped() {
        let start = start(&unknowns(2));
        let whole = lowest(Evolution::new(&start, 7), &[], 900).0;
        let (_, costs_before) = lowest(Evolution::new(&start, 7), &[], 300);
        assert_eq!(lowest(Evolution::new(&start, 7), &costs_before, 900).0, whole);
        let whole = lowest(Swarm::new(&start, 7), &[], 900).0;
        let (_, costs_before) = lowest(Swarm::new(&start, 7), &[], 300);
        assert_eq!(lowest(Swarm::new(&start, 7), &costs_before, 900).0, whole);
    }
}
