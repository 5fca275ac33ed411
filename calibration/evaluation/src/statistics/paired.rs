//! Two policies, or one policy in two worlds, on the same starts: what differs is seen start by start.

use super::share::Share;
use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF as _};

/// Pairs of trials from the same starts.
///
/// ```
/// use evaluation::statistics::Pairs;
///
/// // Both policies from the same twenty starts: success of the first, of the second.
/// let trials = (0..20).map(|start| [start < 16, start < 9]);
/// let pairs = Pairs::of(trials);
/// assert_eq!((pairs.both, pairs.first_only, pairs.second_only, pairs.neither), (9, 7, 0, 4));
/// // McNemar's exact test: seven of seven for the first.
/// assert!((pairs.p_value() - 2.0 * 0.5f64.powi(7)).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Pairs {
    /// Both succeed.
    pub both: u64,
    /// The first one alone does.
    pub first_only: u64,
    /// The second one alone does.
    pub second_only: u64,
    /// Neither does.
    pub neither: u64,
}

impl Pairs {
    /// Of pairs one by one.
    pub fn of(pairs: impl IntoIterator<Item = [bool; 2]>) -> Self {
        let mut counted = Self::default();
        for pair in pairs {
            match pair {
                [true, true] => counted.both += 1,
                [true, false] => counted.first_only += 1,
                [false, true] => counted.second_only += 1,
                [false, false] => counted.neither += 1,
            }
        }
        counted
    }

    /// How many.
    pub fn count(&self) -> u64 {
        self.both + self.first_only + self.second_only + self.neither
    }

    /// McNemar's exact test: the chance of so one-sided a parting, if neither is better than the other. 1 without any parting.
    pub fn p_value(&self) -> f64 {
        let apart = self.first_only + self.second_only;
        let fewer = self.first_only.min(self.second_only);
        Binomial::new(0.5, apart).map_or(1.0, |coin| (2.0 * coin.cdf(fewer)).min(1.0))
    }

    /// How much more often the first succeeds, with Newcombe's interval for pairs: `[value, low, high]`.
    pub fn difference(&self, level: f64) -> [f64; 3] {
        let trials = self.count();
        let first = Share { successes: self.both + self.first_only, trials };
        let second = Share { successes: self.both + self.second_only, trials };
        let (p, q) = (first.value(), second.value());
        let ([p_low, p_high], [q_low, q_high]) = (first.interval(level), second.interval(level));
        let phi = self.correlation();
        let hypotenuse = |a: f64, b: f64| (a * a - 2.0 * phi * a * b + b * b).max(0.0).sqrt();
        let low = (p - q) - hypotenuse(p - p_low, q_high - q);
        let high = (p - q) + hypotenuse(p_high - p, q - q_low);
        [p - q, low.max(-1.0), high.min(1.0)]
    }

    /// Phi of the two, drawn towards zero where it is positive.
    fn correlation(&self) -> f64 {
        let [a, b, c, d] = [self.both, self.first_only, self.second_only, self.neither].map(|n| n as f64);
        let scale = ((a + b) * (c + d) * (a + c) * (b + d)).sqrt();
        if scale <= 0.0 {
            return 0.0;
        }
        let product = a * d - b * c;
        let corrected = if product > 0.0 { (product - 0.5 * (a + b + c + d)).max(0.0) } else { product };
        corrected / scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs([both, first_only, second_only, neither]: [u64; 4]) -> Pairs {
        Pairs { both, first_only, second_only, neither }
    }

    #[test]
    fn differences_of_pairs_are_the_published_ones() {
        // Newcombe 1998, Statistics in Medicine 17, 2635: table III, method 10.
        for (counts, published) in [([36, 12, 2, 0], [0.2, 0.0569, 0.3404]), ([20, 12, 2, 16], [0.2, 0.0562, 0.3292])] {
            let found = pairs(counts).difference(0.95);
            for (a, b) in found.iter().zip(published) {
                assert!((a - b).abs() < 5.1e-5, "{counts:?}: {found:?} is not {published:?}");
            }
        }
    }

    #[test]
    fn pairs_that_agree_say_more_than_two_groups_and_the_order_turns_the_sign() {
        let [value, low, high] = pairs([30, 6, 2, 22]).difference(0.95);
        let [other, below, above] = pairs([30, 2, 6, 22]).difference(0.95);
        assert!((value + other).abs() < 1e-12 && (low + above).abs() < 1e-12 && (high + below).abs() < 1e-12);
        let share = |successes| Share { successes, trials: 60 };
        let [_, wide_low, wide_high] = crate::statistics::difference(share(36), share(32), 0.95);
        assert!(high - low < 0.7 * (wide_high - wide_low), "{low} {high} {wide_low} {wide_high}");
    }

    #[test]
    fn chances_are_those_of_a_coin() {
        assert!((pairs([5, 6, 0, 9]).p_value() - 2.0 / 64.0).abs() < 1e-12);
        assert!((pairs([0, 8, 2, 0]).p_value() - 0.109_375).abs() < 1e-12);
        assert_eq!(pairs([5, 3, 3, 1]).p_value(), 1.0);
        assert_eq!(pairs([5, 0, 0, 1]).p_value(), 1.0);
        assert_eq!(Pairs::of([[true, false], [true, true], [false, false]]), pairs([1, 1, 0, 1]));
    }
}
