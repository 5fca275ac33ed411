//! Quantiles of Student's and of Fisher's distribution.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor, StudentsT};

/// Half the interval that holds `level` of Student's distribution with `free` degrees of freedom; infinite for none.
#[must_use]
pub(super) fn student(level: f64, free: usize) -> f64 {
    StudentsT::new(0.0, 1.0, free as f64).map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 + 0.5 * level))
}

/// The chance of more than `value` in Fisher's distribution; 1 where there are no degrees of freedom.
#[must_use]
pub(super) fn beyond_f(value: f64, above: usize, below: usize) -> f64 {
    FisherSnedecor::new(above as f64, below as f64).map_or(1.0, |f| f.sf(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        assert!((student(0.9, 10) - 1.8125).abs() < 1e-3 && (student(0.95, 3) - 3.1824).abs() < 1e-3);
        assert!(student(0.9, 0).is_infinite());
        assert!((beyond_f(3.2172, 6, 10) - 0.05).abs() < 1e-3 && beyond_f(1.0, 6, 0) == 1.0);
    }
}
