//! How much of a logged series is noise, told from the series alone.

/// Sum of the squared coefficients of a third difference, 1 3 3 1.
const THIRD: f64 = 20.0;
/// Median of the absolute value of a standard normal number.
const MEDIAN_ABS: f64 = 0.674_49;

/// One sigma of the white noise of an evenly sampled series, from its third differences: motion as smooth as a robot's
/// leaves little in them. The median forgives single jumps.
#[must_use]
pub fn white_sigma(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    let differences: Vec<f64> = values.windows(4).map(third).collect();
    median(&differences) / MEDIAN_ABS / THIRD.sqrt()
}

/// The middle value; 0 of none.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => 0.0,
        odd if odd % 2 == 1 => sorted[middle],
        _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

/// How many neighbouring residuals say the same: 1 for white ones, `1 + 2 sum rho` up to where `rho` first falls below zero.
#[must_use]
pub fn correlation_length(values: &[f64]) -> f64 {
    let power: f64 = values.iter().map(|v| v * v).sum();
    if power <= 0.0 {
        return 1.0;
    }
    let rho = |lag: usize| values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
    let mut length = 1.0;
    for lag in 1..values.len() / 2 {
        let rho = rho(lag);
        if rho <= 0.0 {
            break;
        }
        length += 2.0 * rho;
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    fn white(count: usize) -> Vec<f64> {
        let mut rng = Pcg64::seed_from_u64(1);
        // A sum of twelve uniform numbers is normal enough, with unit variance.
        (0..count).map(|_| (0..12).map(|_| rng.random_range(-0.5..0.5)).sum()).collect()
    }

    #[test]
    fn noise_is_told_from_smooth_motion() {
        let noisy: Vec<f64> =
            white(4000).iter().enumerate().map(|(i, e)| 1e-3 * e + 0.3 * (i as f64 * 0.006).sin()).collect();
        let sigma = white_sigma(noisy.into_iter());
        assert!((sigma / 1e-3 - 1.0).abs() < 0.05, "{sigma}");
    }

    #[test]
    fn white_residuals_stand_for_themselves_and_smooth_ones_for_each_other() {
        assert!(correlation_length(&white(2000)) < 1.6);
        let smooth: Vec<f64> = (0..2000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        assert!(correlation_length(&smooth) > 50.0);
    }
}
