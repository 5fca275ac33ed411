//! Whether groups of trials are of one distribution, by their ranks.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

/// The test's answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Kruskal {
    /// The statistic, corrected for ties.
    pub h: f64,
    /// The chance of a larger one, if all groups are alike; by chi squared.
    pub p: f64,
}

/// Kruskal and Wallis's test; `None` for less than two groups with something in them. Where all values are one, nothing differs.
///
/// ```
/// use evaluation::statistics::kruskal_wallis;
///
/// let found = kruskal_wallis(&[&[1.0, 2.0, 3.0, 4.0], &[5.0, 6.0, 7.0, 8.0]]).expect("two groups");
/// assert!(found.p < 0.05);
/// assert!(kruskal_wallis(&[&[1.0, 2.0]]).is_none(), "one group has nothing to differ from");
/// ```
pub fn kruskal_wallis(groups: &[&[f64]]) -> Option<Kruskal> {
    let groups: Vec<&[f64]> = groups.iter().copied().filter(|group| !group.is_empty()).collect();
    if groups.len() < 2 {
        return None;
    }
    let mut all: Vec<f64> = groups.iter().flat_map(|group| group.iter().copied()).collect();
    all.sort_by(f64::total_cmp);
    let count = all.len() as f64;
    // Equal values share the middle of their ranks.
    let rank = |value: f64| {
        let below = all.partition_point(|other| *other < value);
        let up_to = all.partition_point(|other| *other <= value);
        0.5 * ((below + up_to) as f64 + 1.0)
    };
    let squares: f64 = groups
        .iter()
        .map(|group| group.iter().map(|value| rank(*value)).sum::<f64>().powi(2) / group.len() as f64)
        .sum();
    let ties: f64 = all.chunk_by(|a, b| a == b).map(|same| (same.len() as f64).powi(3) - same.len() as f64).sum();
    let correction = 1.0 - ties / (count.powi(3) - count);
    if correction <= 0.0 {
        return Some(Kruskal { h: 0.0, p: 1.0 });
    }
    let h = (12.0 / (count * (count + 1.0)) * squares - 3.0 * (count + 1.0)) / correction;
    let p = ChiSquared::new((groups.len() - 1) as f64).map_or(f64::NAN, |chi| chi.sf(h.max(0.0)));
    Some(Kruskal { h, p })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_those_of_scipy() {
        // scipy.stats.kruskal of the same lists.
        let trials =
            |successes: usize, count: usize| -> Vec<f64> { (0..count).map(|i| f64::from(i < successes)).collect() };
        let found = kruskal_wallis(&[&trials(17, 20), &trials(11, 20)]).expect("two groups");
        assert!((found.h - 4.178_571_428_571_428).abs() < 1e-9 && (found.p - 0.040_937_9).abs() < 1e-6, "{found:?}");
        let found = kruskal_wallis(&[&[1.0, 3.0, 5.0, 7.0, 9.0], &[2.0, 4.0, 6.0, 8.0, 10.0]]).expect("two groups");
        assert!((found.h - 0.272_727_27).abs() < 1e-8 && (found.p - 0.601_508_13).abs() < 1e-7, "{found:?}");
        let found = kruskal_wallis(&[&[1.0, 1.0, 1.0], &[2.0, 2.0, 2.0], &[2.0, 2.0]]).expect("three groups");
        assert!((found.h - 7.0).abs() < 1e-12 && (found.p - 0.030_197_383_422_318_5).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn nothing_differs_where_all_are_alike_and_one_group_is_no_test() {
        assert_eq!(kruskal_wallis(&[&[1.0, 1.0], &[1.0]]), Some(Kruskal { h: 0.0, p: 1.0 }));
        assert_eq!(kruskal_wallis(&[&[1.0, 2.0], &[]]), None);
    }
}
