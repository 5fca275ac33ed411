//! Few real trials and many simulated ones together: the share of success in reality, better known the better the simulation
//! predicts it, and never biased by it.
//!
//! With real outcomes `y`, simulated outcomes `f` of the same starts, and simulated outcomes `F` of other starts, all mean
//! values: `y + lambda (F - f)` has the mean of `y` for any `lambda`. The one with the least variance is
//! `lambda = cov(y, f) / (var(f) (1 + n / N))`, estimated from the pairs and kept between 0 and 1. The interval is Wilson's of
//! as many trials as would have had that variance.

use super::share::wilson;
use serde::Serialize;

/// The estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Powered {
    /// Share of success in reality.
    pub value: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// How far the simulation counts, from 0 to 1.
    pub lambda: f64,
    /// How many real trials alone would be worth as much.
    pub worth_trials: f64,
}

/// The estimate from `pairs` of one real and one simulated outcome from the same start, and `more` simulated outcomes of other
/// starts; `None` without pairs.
///
/// ```
/// use evaluation::statistics::powered;
///
/// // Twenty starts tried in both worlds, which agree in eighteen, and five hundred more simulated ones.
/// let pairs: Vec<[bool; 2]> = (0..20).map(|i| [i % 10 < 6, i % 10 < if i < 2 { 0 } else { 6 }]).collect();
/// let more: Vec<bool> = (0..500).map(|i| i % 10 < 6).collect();
/// let found = powered(&pairs, &more, 0.95).expect("enough trials");
/// assert!(found.worth_trials > 20.0, "worth more real trials than were made: {found:?}");
/// ```
pub fn powered(pairs: &[[bool; 2]], more: &[bool], level: f64) -> Option<Powered> {
    let (n, others) = (pairs.len() as f64, more.len() as f64);
    if pairs.is_empty() {
        return None;
    }
    let number = |success: bool| f64::from(u8::from(success));
    let mean = |values: &mut dyn Iterator<Item = f64>, count: f64| values.sum::<f64>() / count;
    let real = mean(&mut pairs.iter().map(|pair| number(pair[0])), n);
    let simulated = mean(&mut pairs.iter().map(|pair| number(pair[1])), n);
    let both = mean(&mut pairs.iter().map(|pair| number(pair[0]) * number(pair[1])), n);
    let (covariance, spread, own) = (both - real * simulated, simulated * (1.0 - simulated), real * (1.0 - real));
    let lambda = if more.is_empty() || spread <= 0.0 {
        0.0
    } else {
        (covariance / (spread * (1.0 + n / others))).clamp(0.0, 1.0)
    };
    let shift =
        if lambda > 0.0 { mean(&mut more.iter().map(|success| number(*success)), others) - simulated } else { 0.0 };
    let value = (real + lambda * shift).clamp(0.0, 1.0);
    // In units of one real trial's variance; without any the real trials alone count.
    let left = own - 2.0 * lambda * covariance + lambda * lambda * spread * (1.0 + n / others);
    let gain = if lambda > 0.0 && own > 0.0 && left > 0.0 { own / left } else { 1.0 };
    // No better than if every simulated trial had been a real one.
    let worth_trials = (n * gain).min(n + others);
    Some(Powered { value, interval: wilson(value, worth_trials, level), lambda, worth_trials })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Share;

    #[test]
    fn a_simulation_that_says_nothing_leaves_the_real_trials_alone() {
        let pairs: Vec<[bool; 2]> = (0..40).map(|i| [i % 4 != 0, i % 2 == 0]).collect();
        let found = powered(&pairs, &[], 0.95).expect("pairs");
        let alone = Share { successes: 30, trials: 40 };
        assert_eq!((found.value, found.interval, found.lambda), (0.75, alone.interval(0.95), 0.0));
        let opposite = powered(&pairs.iter().map(|p| [p[0], !p[0]]).collect::<Vec<_>>(), &[true; 99], 0.95);
        assert_eq!(opposite.expect("pairs").lambda, 0.0);
        assert_eq!(powered(&[], &[true], 0.95), None);
    }

    #[test]
    fn a_simulation_that_is_always_right_counts_as_reality_does() {
        let outcome = |i: usize| i % 10 < 7;
        let pairs: Vec<[bool; 2]> = (0..20).map(|i| [outcome(i); 2]).collect();
        let more: Vec<bool> = (0..980).map(outcome).collect();
        let found = powered(&pairs, &more, 0.95).expect("pairs");
        assert!((found.value - 0.7).abs() < 1e-12 && (found.worth_trials - 1000.0).abs() < 1e-6, "{found:?}");
    }
}
