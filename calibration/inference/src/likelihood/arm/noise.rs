//! How noisy a logged signal is, from the signal itself, how quiet a sensor can be at best, and how many of neighbouring residuals say
//! the same.

/// Third differences of white noise of one sigma have this variance: 1 + 9 + 9 + 1.
const THIRD_DIFFERENCE: f64 = 20.0;
/// Median of the absolute value of a normal variable, in sigmas.
const MEDIAN_ABSOLUTE: f64 = 0.674_49;

/// Least sigma of a logged position [rad]: the quantisation of an encoder of 21 bits a turn, `2 pi / 2^21 / sqrt(12)`, rounded up.
const POSITION_FLOOR: f64 = 1e-6;
/// Least sigma of a logged velocity [rad/s]: a choice, far below what encoders of that resolution give.
const VELOCITY_FLOOR: f64 = 1e-6;
/// Least sigma of a torque [N m]: an FR3's controller (50 to 600 N m/rad, 15 to 50 N m s/rad) makes 0.8 to 3 mN m of its encoders' floors.
const TORQUE_FLOOR: f64 = 1e-3;

/// Least sigma of what is logged of a joint, in its unit: a log that looks quieter was computed, or stood on one step of its encoder.
pub fn floor(quantity: &str) -> f64 {
    match quantity {
        "q" => POSITION_FLOOR,
        "dq" => VELOCITY_FLOOR,
        _ => TORQUE_FLOOR,
    }
}

/// One sigma of the noise of an evenly sampled signal. Third differences take out the motion; their median takes out
/// events. Never less than what its resolution leaves unknown: slow motion on a coarse encoder stands on one step for most
/// of the time, and that is no certainty.
pub fn sigma(signal: &[f64]) -> f64 {
    let mut thirds: Vec<f64> =
        signal.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).filter(|d| d.is_finite()).collect();
    if thirds.is_empty() {
        return 0.0;
    }
    let middle = thirds.len() / 2;
    let (_, median, _) = thirds.select_nth_unstable_by(middle, f64::total_cmp);
    let white = *median / MEDIAN_ABSOLUTE / THIRD_DIFFERENCE.sqrt();
    white.max(resolution(signal) / 12.0_f64.sqrt())
}

/// One sigma of a sensor from that of its signal in each of several clips: what holds for most. A clip in which the reading
/// never changes has 0 and says nothing: the joint stood still, and what moves it less than a step is not seen.
pub fn of_clips(sigmas: impl Iterator<Item = f64>) -> f64 {
    let mut known: Vec<f64> = sigmas.filter(|sigma| *sigma > 0.0).collect();
    known.sort_unstable_by(f64::total_cmp);
    known.get(known.len() / 2).copied().unwrap_or_default()
}

/// Smallest step between neighbouring samples; 0 where nothing ever changes.
fn resolution(signal: &[f64]) -> f64 {
    let steps = signal.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0);
    let smallest = steps.fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

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
    use rand::{RngExt as _, SeedableRng as _};
    use rand_distr::StandardNormal;

    #[test]
    fn noise_on_a_fast_motion_is_told_from_the_motion() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        let motion = |i: usize| 0.3 * (i as f64 * 1e-3 * 6.0).sin();
        let mut noise = || 4e-6 * random.sample::<f64, _>(StandardNormal);
        let signal: Vec<f64> = (0..4000).map(|i| motion(i) + noise()).collect();
        assert!((sigma(&signal) / 4e-6 - 1.0).abs() < 0.1, "{}", sigma(&signal));
    }

    #[test]
    fn a_coarse_encoder_is_no_better_than_its_steps() {
        let signal: Vec<f64> = (0..1000).map(|i| (i as f64 * 1e-4 / 1.5e-3).round() * 1.5e-3).collect();
        assert!((sigma(&signal) - 1.5e-3 / 12.0_f64.sqrt()).abs() < 1e-6, "{}", sigma(&signal));
    }

    #[test]
    fn clips_in_which_a_joint_stood_still_do_not_hide_its_noise() {
        assert_eq!(of_clips([0.0, 0.0, 4e-4, 0.0, 5e-4, 6e-4, 0.0].into_iter()), 5e-4);
        assert_eq!(of_clips([0.0; 3].into_iter()), 0.0);
    }

    fn white(count: usize) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
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
