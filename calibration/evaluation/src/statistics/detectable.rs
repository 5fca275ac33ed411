//! The smallest difference between two shares that so many trials show.

use super::sigmas;
use statrs::distribution::{ContinuousCDF as _, Normal};

/// How often a difference is to be seen that is as large as the smallest one.
pub const POWER: f64 = 0.8;

/// The smallest difference from a share that a comparison of so many trials each sees four times in five ([`POWER`]), upwards or
/// downwards, whichever is less; `None` where even the largest one is not seen so often.
///
/// ```
/// use evaluation::statistics::smallest_difference;
///
/// let [few, many] = [20, 500].map(|trials| smallest_difference(0.5, [trials; 2], 0.95).expect("one shows"));
/// assert!(few > 0.3 && many < 0.1, "twenty trials a side show only large differences");
/// ```
pub fn smallest_difference(share: f64, [trials, others]: [u64; 2], level: f64) -> Option<f64> {
    let seen = |other: f64| power([share, other], [trials as f64, others as f64], level) >= POWER;
    let towards = |end: f64| {
        if !seen(end) {
            return None;
        }
        let (mut near, mut far) = (share, end);
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            if seen(middle) { far = middle } else { near = middle }
        }
        Some((far - share).abs())
    };
    [towards(1.0), towards(0.0)].into_iter().flatten().min_by(f64::total_cmp)
}

/// How often a comparison sees the difference, by the normal distribution.
fn power([p, q]: [f64; 2], [n, m]: [f64; 2], level: f64) -> f64 {
    let pooled = (n * p + m * q) / (n + m);
    let alike = (pooled * (1.0 - pooled) * (1.0 / n + 1.0 / m)).sqrt();
    let apart = (p * (1.0 - p) / n + q * (1.0 - q) / m).sqrt();
    let beyond = (p - q).abs() - sigmas(level) * alike;
    if apart > 0.0 { Normal::standard().cdf(beyond / apart) } else { f64::from(beyond > 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_tables() {
        // Fleiss, Levin and Paik 2003, table A.4 without correction of continuity: 0.5 against 0.7 takes 93 trials each.
        let found = smallest_difference(0.5, [93, 93], 0.95).expect("a difference");
        assert!((found - 0.2).abs() < 0.001, "{found}");
        let fewer = smallest_difference(0.5, [20, 20], 0.95).expect("a difference");
        assert!((0.37..0.42).contains(&fewer), "{fewer}");
        assert!(smallest_difference(0.95, [50, 50], 0.95) < smallest_difference(0.5, [50, 50], 0.95));
        assert_eq!(smallest_difference(0.5, [4, 4], 0.95), None);
    }
}
