//! Quantiles of distributions and the extent of values, the one place of each; medians and what follows from them are those
//! of [`shared_mem::statistics`].

pub use shared_mem::statistics::{median, robust_sigma};

use statrs::distribution::{ChiSquared, ContinuousCDF as _, FisherSnedecor, Normal, StudentsT};

/// The lowest and the highest of some values; of none the lowest is infinite.
pub fn extent(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Half the interval that holds `level` of a normal distribution [sigmas].
pub fn normal(level: f64) -> f64 {
    Normal::standard().inverse_cdf(0.5 + 0.5 * level)
}

/// What an interval of so many sigmas to either side holds of a normal distribution: the inverse of [`normal`].
pub fn level(sigmas: f64) -> f64 {
    2.0 * Normal::standard().cdf(sigmas) - 1.0
}

/// Half the interval that holds `level` of Student's distribution with `free` degrees of freedom; infinite for none.
///
/// ```
/// use inference::statistics::{normal, student};
///
/// assert!((normal(0.95) - 1.960).abs() < 1e-3);
/// assert!((student(0.95, 4) - 2.776).abs() < 1e-3, "of five clips");
/// assert!(student(0.95, 0).is_infinite(), "one clip says nothing of its scatter");
/// ```
pub fn student(level: f64, free: usize) -> f64 {
    StudentsT::new(0.0, 1.0, free as f64).map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 + 0.5 * level))
}

/// How many standard errors of an estimate with `free` degrees of freedom, at least 1, are as rare as `sigmas` of a normal one.
pub fn student_sigmas(sigmas: f64, free: usize) -> f64 {
    student(level(sigmas), free.max(1))
}

/// The chance of more than `value` in a chi-square of so many degrees of freedom, at least 1.
pub fn beyond_chi_square(value: f64, free: usize) -> f64 {
    ChiSquared::new(free.max(1) as f64).map_or(1.0, |chi| chi.sf(value.max(0.0)))
}

/// The chance of more than `value` in Fisher's distribution; 1 where there are no degrees of freedom.
pub fn beyond_f(value: f64, above: usize, below: usize) -> f64 {
    FisherSnedecor::new(above as f64, below as f64).map_or(1.0, |f| f.sf(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        assert!((normal(0.95) - 1.959_964).abs() < 1e-6);
        for (free, table) in [(1, 12.706), (2, 4.303), (4, 2.776), (10, 2.228), (60, 2.000)] {
            assert!((student(0.95, free) - table).abs() < 1e-3, "{free}: {}", student(0.95, free));
        }
        assert!((student_sigmas(normal(0.95), 4) - student(0.95, 4)).abs() < 1e-9);
        assert!((student(0.9, 10) - 1.8125).abs() < 1e-3 && student(0.9, 0).is_infinite());
        for (value, free, chance) in [(3.841, 1, 0.05), (6.635, 1, 0.01), (14.067, 7, 0.05), (29.141, 14, 0.01)] {
            assert!((beyond_chi_square(value, free) / chance - 1.0).abs() < 1e-3, "{value} {free}");
        }
        assert!(beyond_chi_square(-1.0, 3) == 1.0 && beyond_chi_square(1e5, 1) < 1e-9);
        assert!((beyond_f(3.2172, 6, 10) - 0.05).abs() < 1e-3 && beyond_f(1.0, 6, 0) == 1.0);
    }
}
