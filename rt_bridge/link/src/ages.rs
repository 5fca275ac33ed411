//! How long messages took from one shared memory to the other.

use hdrhistogram::Histogram;
use serde::Serialize;

/// Longest age that is distinguished: ten minutes; longer ones count as this [ns].
const LONGEST_NS: u64 = 600_000_000_000;

/// A distribution of ages [ns], exact to 0.1 %.
#[derive(Debug, Clone)]
pub struct Ages(Histogram<u64>);

impl Default for Ages {
    fn default() -> Self {
        Self::new()
    }
}

impl Ages {
    /// Nothing counted yet.
    ///
    /// # Panics
    /// Never: the bounds are constants that the histogram accepts.
    pub fn new() -> Self {
        Self(Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("constant bounds are valid"))
    }

    /// Counts one age [ns].
    pub fn record(&mut self, ns: u64) {
        self.0.saturating_record(ns);
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.0.reset();
    }

    /// Percentiles; `None` where nothing was counted.
    pub fn percentiles(&self) -> Option<Percentiles> {
        let at = |quantile: f64| self.0.value_at_quantile(quantile) as f64 * 1e-3;
        let max = self.0.max() as f64 * 1e-3;
        (!self.0.is_empty()).then(|| Percentiles { p50: at(0.5), p99: at(0.99), p999: at(0.999), max })
    }
}

/// Percentiles of a distribution of times [us].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    /// Half of all are shorter.
    pub p50: f64,
    /// 99 % are shorter.
    pub p99: f64,
    /// 99.9 % are shorter.
    pub p999: f64,
    /// The longest.
    pub max: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_what_was_counted() {
        let mut ages = Ages::new();
        assert_eq!(ages.percentiles(), None);
        (1..=1000).for_each(|us| ages.record(us * 1000));
        let p = ages.percentiles().expect("ages");
        assert!((p.p50 - 500.0).abs() < 1.0 && (p.p99 - 990.0).abs() < 1.0 && (p.max - 1000.0).abs() < 2.0, "{p:?}");
        ages.clear();
        assert_eq!(ages.percentiles(), None);
    }
}
