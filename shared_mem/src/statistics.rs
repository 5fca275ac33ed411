//! Numbers of many values that outliers hardly change: the one place of each.

/// Sigmas of a normal distribution in a median of absolute deviations (1 / 0.6745).
const SIGMAS_PER_MEDIAN: f64 = 1.4826;

/// The middle value, of two the mean; `None` of none. Values that are no numbers count as the largest.
///
/// ```
/// use shared_mem::statistics::median;
/// assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
/// assert_eq!(median([4.0, 1.0, 3.0, 2.0]), Some(2.5));
/// assert_eq!(median([]), None);
/// ```
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let even = values.len().is_multiple_of(2);
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().max_by(f64::total_cmp).filter(|_| even);
    Some(lower.map_or(*upper, |lower| 0.5 * (lower + *upper)))
}

/// The median of steps between stamps that rise, whole nanoseconds; `None` of fewer than two stamps.
///
/// ```
/// assert_eq!(shared_mem::statistics::usual_step_ns(&[0, 10, 20, 90]), Some(10));
/// ```
pub fn usual_step_ns(stamps_ns: &[u64]) -> Option<u64> {
    let steps = stamps_ns.iter().zip(stamps_ns.iter().skip(1)).map(|(a, b)| b.saturating_sub(*a) as f64);
    median(steps).map(|step| step as u64)
}

/// Standard deviation of normal residuals about 0, out of the median of their sizes; `None` of none.
///
/// ```
/// assert_eq!(shared_mem::statistics::robust_sigma([1.0, -2.0, 100.0]), Some(2.0 * 1.4826));
/// ```
pub fn robust_sigma(residuals: impl IntoIterator<Item = f64>) -> Option<f64> {
    median(residuals.into_iter().map(f64::abs)).map(|median| SIGMAS_PER_MEDIAN * median)
}
