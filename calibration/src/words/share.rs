//! Shares and probabilities for people.

use super::quantity::Unit;

/// Above this a share is shown as more than it.
const NEARLY_ALL: f64 = 0.9999;

/// A share as percent: `41 %`, `0.4 %`, `99.97 %`.
pub fn percent(share: f64) -> String {
    if share > NEARLY_ALL && share < 1.0 {
        return "> 99.99 %".into();
    }
    let value = 100.0 * share;
    let rest = (100.0 - value).abs();
    match value.abs() {
        v if !v.is_finite() => "-".into(),
        0.0 => "0 %".into(),
        v if v < 0.05 => "< 0.1 %".into(),
        v if v < 9.95 => format!("{value:.1} %"),
        _ if rest > 0.0 && rest < 0.095 => format!("{value:.2} %"),
        v if v > 99.0 && rest > 0.0 && rest < 0.95 => format!("{value:.1} %"),
        _ => format!("{value:.0} %"),
    }
}

/// A share with its interval: `81 [76, 85] %`.
pub(crate) fn percent_interval(share: f64, interval: [f64; 2]) -> String {
    if interval[0] > NEARLY_ALL && share < 1.0 {
        return percent(share);
    }
    if interval.iter().all(|end| end.is_finite()) && interval[1] > interval[0] {
        Unit::suited("%", share).interval(share, interval)
    } else {
        percent(share)
    }
}

/// A probability. Never 0 or 1, which nothing measured is.
pub(crate) fn probability(value: f64) -> String {
    match value {
        v if !v.is_finite() => "-".into(),
        v if v > 0.995 => "> 99 %".into(),
        v if v < 0.005 => "< 1 %".into(),
        v => format!("{:.0} %", 100.0 * v),
    }
}

/// A probability that is never given beyond `most`: there it is a limit and no estimate.
pub(crate) fn limited(value: f64, most: f64) -> String {
    let words = probability(value);
    if value < most - 0.005 { words } else { format!("{words} (limit)") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_shown_in_percent_with_the_digits_that_matter() {
        assert_eq!(percent(0.4123), "41 %");
        assert_eq!(percent(0.9997), "99.97 %");
        assert_eq!(percent(0.0001), "< 0.1 %");
        assert_eq!((percent(1.0), percent(0.999_99)), ("100 %".into(), "> 99.99 %".into()));
        assert_eq!(percent_interval(0.999_989, [0.999_988, 0.999_99]), "> 99.99 %");
        assert_eq!(percent_interval(0.994, [0.993, 0.995]), "99.40 [99.30, 99.50] %");
        assert_eq!(percent_interval(0.81, [0.76, 0.85]), "81 [76, 85] %");
        assert_eq!((probability(1.0), probability(0.0)), ("> 99 %".into(), "< 1 %".into()));
        assert_eq!((limited(0.96, 0.96), limited(0.8, 0.96)), ("96 % (limit)".into(), "80 %".into()));
    }
}
