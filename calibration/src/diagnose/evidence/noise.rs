//! How many of neighbouring residuals say the same.

/// How many neighbouring residuals say the same: 1 for white ones, `1 + 2 sum rho` up to where `rho` first falls below zero.
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
    fn white_residuals_stand_for_themselves_and_smooth_ones_for_each_other() {
        assert!(correlation_length(&white(2000)) < 1.6);
        let smooth: Vec<f64> = (0..2000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        assert!(correlation_length(&smooth) > 50.0);
    }
}
