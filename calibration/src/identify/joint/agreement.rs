//! Whether what is left of a motion is what noise leaves.

use super::model::Motion;
use super::noise::Noise;

/// Stretches whose mean residual must be that of noise, and by how many standard deviations it may be off, as the mean square may
/// (choices).
const STRETCHES: usize = 6;
const SIGMAS_OF_DISAGREEMENT: f64 = 3.5;

/// How far residuals are beyond those of noise, as a share of what is allowed: at most 1 where they agree.
pub(super) fn disagreement(motion: &Motion, numbers: [f64; 2], own: &[f64], noise: &Noise) -> f64 {
    let predicted = motion.predicted(numbers, own);
    let off: Vec<f64> = (motion.positions.iter().zip(&predicted))
        .map(|(measured, predicted)| (measured - predicted) / motion.sigma)
        .collect();
    let rows = off.len();
    let square = off.iter().map(|x| x * x).sum::<f64>() / rows as f64;
    let in_all = square / (1.0 + SIGMAS_OF_DISAGREEMENT * (2.0 / noise.independent(rows)).sqrt());
    let stretches = STRETCHES.min(rows / 3).max(1);
    off.chunks(rows.div_ceil(stretches)).fold(in_all, |most, stretch| {
        let mean = stretch.iter().sum::<f64>() / stretch.len() as f64;
        most.max(mean.abs() * noise.independent(stretch.len()).sqrt() / SIGMAS_OF_DISAGREEMENT)
    })
}
