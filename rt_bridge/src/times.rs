//! Distributions of times: set up in advance, so that recording one costs some nanoseconds and no memory. Used by the
//! control thread, the pump and `doctor`.

use hdrhistogram::Histogram;
use serde::Serialize;

/// Longest time resolved: 10 s; longer ones count as this [ns].
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
    pub fn new() -> Self {
        Self(Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("constant bounds are valid"))
    }

    /// Counts one time [ns].
    pub fn record(&mut self, ns: u64) {
        self.0.saturating_record(ns);
    }

    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Percentiles in microseconds; all `None` when nothing was counted.
    pub fn percentiles(&self) -> Percentiles {
        let counted = |ns: u64| (!self.0.is_empty()).then_some(ns as f64 * 1e-3);
        let at = |quantile: f64| counted(self.0.value_at_quantile(quantile));
        Percentiles { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: counted(self.0.max()) }
    }
}

/// Percentiles of a distribution of times [us]; `None` (`null`) where nothing was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    /// Half of all are shorter.
    pub p50: Option<f64>,
    /// 99 % are shorter.
    pub p99: Option<f64>,
    /// 99.9 % are shorter.
    pub p999: Option<f64>,
    pub max: Option<f64>,
}

/// A time [us] for people.
pub fn in_words(time_us: Option<f64>) -> String {
    time_us.map_or_else(|| "not measured".to_owned(), |us| format!("{us:.1} us"))
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
        let near = |time: Option<f64>, us: f64| time.is_some_and(|time| (time - us).abs() < 2.0);
        assert!(near(p.p50, 500.0) && near(p.p99, 990.0) && near(p.max, 1000.0) && times.count() == 1000, "{p:?}");
    }

    #[test]
    fn what_was_not_measured_is_null_and_no_zero() {
        let json = serde_json::to_value(Times::new().percentiles()).expect("JSON");
        assert_eq!(json, serde_json::json!({ "p50": null, "p99": null, "p999": null, "max": null }));
        assert_eq!((in_words(None), in_words(Some(12.34))), ("not measured".into(), "12.3 us".into()));
    }

    #[test]
    fn a_time_beyond_the_longest_counts_as_the_longest() {
        let mut times = Times::new();
        times.record(u64::MAX);
        assert!(times.percentiles().max >= Some(1e7));
    }
}
