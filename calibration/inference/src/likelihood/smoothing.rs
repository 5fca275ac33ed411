//! Logged series smoothed by local cubics, with their slopes and curvatures.

use nalgebra::{Matrix4, Vector4};
use shared_mem::recording::JointSeries;

/// Half the time over which motion is smoothed [ns], rows counting less the farther away they are: as a cubic over 80 ms alone
/// would, that passes 10 Hz, and no arm is driven faster.
pub const HALF_NS: u64 = 80_000_000;
/// The same where stamps are uneven: what arrives a millisecond late at 1 rad/s is 1 mrad off, hundreds of times the encoder's
/// noise.
const UNEVEN_HALF_NS: u64 = 160_000_000;
/// Stamps are uneven where more than this share of the steps differs from the usual one by more than a quarter of it [1]: a choice.
const UNEVEN_SHARE: f64 = 0.02;
/// Slow logs are smoothed over at least so many rows to either side [1]: a cubic has four coefficients.
const MIN_ROWS: u64 = 4;

/// Half the time over which a log is smoothed [ns]; `None` of fewer than two rows.
pub fn half_width(stamps: &[u64]) -> Option<u64> {
    let (first, last) = (*stamps.first()?, *stamps.last()?);
    let usual = (last - first) / (stamps.len() as u64 - 1).max(1);
    (last > first).then(|| if uneven(stamps) { UNEVEN_HALF_NS } else { HALF_NS }.max(MIN_ROWS * usual))
}

fn uneven(stamps: &[u64]) -> bool {
    let mut steps: Vec<u64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1);
    let odd = steps.iter().filter(|step| 4 * step.abs_diff(usual) > usual).count();
    odd as f64 > UNEVEN_SHARE * steps.len() as f64
}

/// Positions and velocities at stamps, each from a cubic through the rows of positions around it.
pub fn motion(series: &JointSeries, at_ns: &[u64], half: u64) -> JointSeries {
    let [q, dq, _] = derivatives((&series.stamps_ns, &series.q, series.dof), at_ns, half);
    JointSeries { dof: series.dof, stamps_ns: at_ns.to_vec(), q, dq, ..JointSeries::default() }
}

/// Values, slopes [1/s] and curvatures [1/s²] at stamps, each from a cubic through the rows within `half` ns of it. Of `logged`: the
/// stamps [ns], `dof` values a row, and `dof`; rows of the answer likewise.
pub fn derivatives((stamps, values, dof): (&[u64], &[f64], usize), at_ns: &[u64], half: u64) -> [Vec<f64>; 3] {
    let unit = half as f64 * 1e-9;
    let mut out: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(at_ns.len() * dof));
    let (mut begin, mut end) = (0, 0);
    for at in at_ns {
        begin += stamps[begin..].partition_point(|stamp| stamp + half < *at);
        end = end.max(begin);
        end += stamps[end..].partition_point(|stamp| *stamp <= at + half);
        let times: Vec<f64> =
            stamps[begin..end].iter().map(|stamp| (*stamp as f64 - *at as f64) / half as f64).collect();
        let shares = cubic(&times);
        for joint in 0..dof {
            // Values far from 0 would cost digits.
            let middle = values.get(begin * dof + joint).copied().unwrap_or(0.0);
            let mut sums = [0.0; 3];
            for (row, shares) in (begin..end).zip(&shares) {
                let away = values[row * dof + joint] - middle;
                sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share * away);
            }
            out[0].push(middle + sums[0]);
            out[1].push(sums[1] / unit);
            out[2].push(2.0 * sums[2] / unit.powi(2));
        }
    }
    out
}

/// What each row adds to the first three coefficients at 0 of the cubic that fits best, rows weighted by the tricube of their
/// distance (Cleveland 1979): with full weight those that come and go at the ends would make the motion jerk.
fn cubic(times: &[f64]) -> Vec<[f64; 3]> {
    let powers = |t: f64| Vector4::new(1.0, t, t * t, t * t * t);
    let weight = |t: f64| (1.0 - t.abs().powi(3)).max(0.0).powi(3);
    let normal: Matrix4<f64> = times.iter().map(|t| weight(*t) * powers(*t) * powers(*t).transpose()).sum();
    let inverse = normal.cholesky().map_or_else(Matrix4::zeros, |normal| normal.inverse());
    let share = |t: &f64| {
        let fit = weight(*t) * inverse * powers(*t);
        [fit[0], fit[1], fit[2]]
    };
    times.iter().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_motion_is_followed_exactly_and_noise_averages_out() {
        let stamps: Vec<u64> = (0..500).map(|row| row * 2_000_000).collect();
        let position = |t: f64| 1.5 + 0.3 * t - 2.0 * t * t + 4.0 * t * t * t;
        let noise = |row: usize| if row.is_multiple_of(2) { 1e-5 } else { -1e-5 };
        let values = |noisy: bool| -> Vec<f64> {
            let at =
                |(row, stamp): (usize, &u64)| position(*stamp as f64 * 1e-9) + if noisy { noise(row) } else { 0.0 };
            stamps.iter().enumerate().map(at).collect()
        };
        let expected = [position(0.5), 0.3 - 4.0 * 0.5 + 12.0 * 0.25, -4.0 + 24.0 * 0.5];
        for (noisy, close) in [(false, [1e-10, 1e-8, 1e-6]), (true, [3e-6, 1e-3, 0.1])] {
            let found = derivatives((&stamps, &values(noisy), 1), &[500_000_000], HALF_NS);
            for k in 0..3 {
                assert!((found[k][0] - expected[k]).abs() < close[k], "{k}: {} and {}", found[k][0], expected[k]);
            }
        }
    }
}
