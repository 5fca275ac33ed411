//! Distributions of times: set up in advance, so that recording one costs some nanoseconds and no memory. Used by the
//! control thread, the pump and `doctor`.

use hdrhistogram::Histogram;
use serde::Serialize;

/// Longest time told apart: 10 s; longer ones count as this [ns].
const LONGEST_NS: u64 = 10_000_000_000;

/// A distribution of times [ns], exact to 0.1 %.
#[derive(Debug, Clone)]
pub struct Times(Histogram<u64>);

impl Default for Times {
    fn default() -> Self {
        Self::new()
    }
}

impl Times {
    /// Nothing recorded yet. Allocates; `record` does not.
    ///
    /// # Panics
    /// Never: the bounds are constants that the histogram accepts.
    #[must_use]
    pub fn new() -> Self {
        Self(Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("constant bounds are valid"))
    }

    /// Counts one time [ns].
    pub fn record(&mut self, ns: u64) {
        self.0.saturating_record(ns);
    }

    /// Times counted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Percentiles in microseconds; all 0 when nothing was counted.
    #[must_use]
    pub fn percentiles(&self) -> Percentiles {
        let at = |quantile: f64| self.0.value_at_quantile(quantile) as f64 * 1e-3;
        Percentiles { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: self.0.max() as f64 * 1e-3 }
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
    fn percentiles_are_those_of_what_was_recorded() {
        let mut times = Times::new();
        for us in 1..=1000_u64 {
            times.record(us * 1000);
        }
        let p = times.percentiles();
        assert!((p.p50 - 500.0).abs() < 1.0 && (p.p99 - 990.0).abs() < 2.0, "{p:?}");
        assert!((p.max - 1000.0).abs() < 1.0 && times.count() == 1000);
    }

    #[test]
    fn a_time_beyond_the_longest_counts_as_the_longest() {
        let mut times = Times::new();
        times.record(u64::MAX);
        assert!(times.percentiles().max >= 1e7);
    }
}
