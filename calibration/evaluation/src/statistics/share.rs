//! A share of successes and what another set of trials could have given.

use super::sigmas;
use serde::{Deserialize, Serialize};

/// So many successes of so many trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Share {
    /// Successes, no more than trials.
    pub successes: u64,
    /// Trials.
    pub trials: u64,
}

impl Share {
    /// Of trials one by one.
    pub fn of(trials: impl IntoIterator<Item = bool>) -> Self {
        trials.into_iter().fold(Self::default(), |share, success| Self {
            successes: share.successes + u64::from(success),
            trials: share.trials + 1,
        })
    }

    /// The share; NaN without trials.
    pub fn value(self) -> f64 {
        self.successes as f64 / self.trials as f64
    }

    /// Wilson's interval; from 0 to 1 without trials.
    ///
    /// ```
    /// use evaluation::statistics::Share;
    ///
    /// let share = Share { successes: 18, trials: 20 };
    /// let [lowest, highest] = share.interval(0.95);
    /// assert!((share.value() - 0.9).abs() < 1e-12);
    /// // Wilson's interval leans towards one half, and never leaves 0 to 1.
    /// assert!((lowest - 0.699).abs() < 1e-3 && (highest - 0.972).abs() < 1e-3);
    /// ```
    pub fn interval(self, level: f64) -> [f64; 2] {
        if self.trials == 0 {
            return [0.0, 1.0];
        }
        wilson(self.value(), self.trials as f64, level)
    }
}

/// Wilson's interval of a share that was found with so many trials, which need be no whole number.
pub(super) fn wilson(share: f64, trials: f64, level: f64) -> [f64; 2] {
    let z = sigmas(level);
    let z2 = z * z;
    let middle = (share + z2 / (2.0 * trials)) / (1.0 + z2 / trials);
    let half = z / (1.0 + z2 / trials) * (share * (1.0 - share) / trials + z2 / (4.0 * trials * trials)).sqrt();
    // At the ends exactly, which rounding would miss.
    let low = if share <= 0.0 { 0.0 } else { (middle - half).max(0.0) };
    let high = if share >= 1.0 { 1.0 } else { (middle + half).min(1.0) };
    [low, high]
}

/// How much larger the first of two independent shares is, with Newcombe's interval: `[value, low, high]`.
///
/// ```
/// use evaluation::statistics::{Share, difference};
///
/// let (old, new) = (Share { successes: 12, trials: 20 }, Share { successes: 18, trials: 20 });
/// let [value, lowest, highest] = difference(new, old, 0.95);
/// assert!((value - 0.3).abs() < 1e-12);
/// assert!(lowest > 0.0 && highest < 0.6, "better, and by how much is not known well");
/// ```
pub fn difference(first: Share, second: Share, level: f64) -> [f64; 3] {
    let (p, q) = (first.value(), second.value());
    let ([p_low, p_high], [q_low, q_high]) = (first.interval(level), second.interval(level));
    let low = (p - q) - (p - p_low).hypot(q_high - q);
    let high = (p - q) + (p_high - p).hypot(q - q_low);
    [p - q, low.max(-1.0), high.min(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: &[f64], published: &[f64], digits: i32) {
        for (a, b) in found.iter().zip(published) {
            assert!((a - b).abs() <= 0.5 * 10_f64.powi(-digits), "{found:?} is not {published:?}");
        }
    }

    #[test]
    fn intervals_are_the_published_ones() {
        // Newcombe 1998, Statistics in Medicine 17, 857: table I, Wilson without correction.
        for (successes, trials, published) in [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
        ] {
            near(&Share { successes, trials }.interval(0.95), &published, 4);
        }
        assert_eq!(Share::default().interval(0.95), [0.0, 1.0]);
        assert_eq!(Share { successes: 7, trials: 7 }.interval(0.95)[1], 1.0);
    }

    #[test]
    fn differences_are_the_published_ones() {
        // Newcombe 1998, Statistics in Medicine 17, 873: table II, method 10.
        let of = |successes, trials| Share { successes, trials };
        for (first, second, published) in [
            (of(56, 70), of(48, 80), [0.2, 0.0524, 0.3339]),
            (of(9, 10), of(3, 10), [0.6, 0.1705, 0.8090]),
            (of(6, 7), of(2, 7), [0.5714, 0.0582, 0.8062]),
            (of(5, 56), of(0, 29), [0.0893, -0.0381, 0.1926]),
            (of(0, 10), of(0, 20), [0.0, -0.1611, 0.2775]),
            (of(10, 10), of(0, 20), [1.0, 0.6791, 1.0]),
        ] {
            near(&difference(first, second, 0.95), &published, 4);
        }
    }
}
