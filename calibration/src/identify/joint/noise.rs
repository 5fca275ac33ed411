//! How noisy recorded positions of a joint are, from the rows themselves: what changes from row to row, and what changes while the
//! part rests.

use inference::statistics::robust_sigma;

/// Rows of a window in which a part may rest (a choice: half a second of a tracker).
const ROWS_OF_A_WINDOW: usize = 30;
/// A window is one of rest if its rows scatter by at most so many times what changes from row to row (a choice).
const SCATTER_AT_REST: f64 = 3.0;
/// Degree of a smooth curve through a window in which it moves (a choice).
const DEGREE_OF_A_CURVE: usize = 3;
/// Fewest windows of rest that say something (a choice).
const FEWEST_WINDOWS: usize = 3;
/// Of the third difference of independent rows: the root of 1 + 9 + 9 + 1.
const SIGMA_OF_A_THIRD_DIFFERENCE: f64 = 4.472_136;
/// What lasts keeps at most this share from row to row (a choice).
const LARGEST_SHARE_KEPT: f64 = 0.9;
/// Rounds in which the share that windows lose is found (a choice).
const ROUNDS: usize = 5;

/// Noise of positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Standard deviation [rad or m].
    pub(super) sigma: f64,
    /// So many rows are worth one, since noise lasts; at least 1.
    lasts: f64,
}

impl Noise {
    /// Of the positions of several clips.
    pub(super) fn of<'a>(clips: impl Iterator<Item = &'a [f64]> + Clone) -> Self {
        let thirds = clips.clone().flat_map(|rows| rows.windows(4).map(|w| w[3] - 3.0 * (w[2] - w[1]) - w[0]));
        let white = robust_sigma(thirds).unwrap_or(0.0) / SIGMA_OF_A_THIRD_DIFFERENCE;
        let windows: Vec<&[f64]> = clips.flat_map(|rows| rows.chunks_exact(ROWS_OF_A_WINDOW)).collect();
        let of = |degree: usize| windows.iter().map(move |window| covariances(window, degree)).collect::<Vec<_>>();
        let resting: Vec<[f64; 3]> =
            of(0).into_iter().filter(|[variance, ..]| variance.sqrt() <= SCATTER_AT_REST * white).collect();
        // Where the part hardly ever rests, what is left beside smooth curves.
        let (all, taken) = if resting.len() >= FEWEST_WINDOWS {
            (resting, 1.0)
        } else {
            (of(DEGREE_OF_A_CURVE), DEGREE_OF_A_CURVE as f64 + 1.0)
        };
        if all.is_empty() {
            return Self { sigma: white, lasts: 1.0 };
        }
        // Windows of rest are all of one kind; of curves some are steeper than a polynomial.
        let typical: fn(Vec<f64>) -> f64 = if taken > 1.0 { middle } else { mean };
        let [variance, first, second] = [0, 1, 2].map(|lag| typical(all.iter().map(|window| window[lag]).collect()));
        let mut noise = Self { sigma: white.max(variance.sqrt()), lasts: 1.0 };
        if variance <= 0.0 {
            return noise;
        }
        for _ in 0..ROUNDS {
            // The mean of a window is taken off, and with it this share of every covariance. Of curves the share is that of white noise:
            // how much they take of noise that lasts is not identifiable from a few rows.
            let lost = if taken > 1.0 { taken } else { noise.lasts } / ROWS_OF_A_WINDOW as f64;
            let whole = variance / (1.0 - lost).max(0.5);
            let [first, second] = [first, second].map(|covariance| covariance / whole + lost);
            // A part that is white, and one that dies away by the same share from row to row.
            let keeps = if first > 0.0 { (second / first).clamp(0.0, LARGEST_SHARE_KEPT) } else { 0.0 };
            noise.lasts = (1.0 + 2.0 * first.max(0.0) / (1.0 - keeps)).min(0.5 * ROWS_OF_A_WINDOW as f64);
            noise.sigma = white.max(whole.sqrt());
        }
        noise
    }

    /// So many rows are worth one, since noise lasts.
    pub(super) fn lasts(&self) -> f64 {
        self.lasts
    }

    /// How many independent rows so many rows are worth.
    pub(super) fn independent(&self, rows: usize) -> f64 {
        (rows as f64 / self.lasts).max(1.0)
    }
}

/// Variance about a polynomial, and the covariances with the next row and the one after it.
fn covariances(rows: &[f64], degree: usize) -> [f64; 3] {
    let mut off = rows.to_vec();
    // Gram-Schmidt over the powers of the row.
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for power in 0..=degree {
        let place = |row: usize| 2.0 * row as f64 / (rows.len() as f64 - 1.0) - 1.0;
        let mut next: Vec<f64> = (0..rows.len()).map(|row| place(row).powi(power as i32)).collect();
        basis.iter().for_each(|other| take_off(&mut next, other));
        let norm = next.iter().map(|x| x * x).sum::<f64>().sqrt();
        next.iter_mut().for_each(|x| *x /= norm);
        take_off(&mut off, &next);
        basis.push(next);
    }
    [0, 1, 2].map(|lag| {
        let pairs = off.iter().zip(&off[lag..]).map(|(a, b)| a * b);
        pairs.sum::<f64>() / (rows.len() - lag) as f64
    })
}

fn take_off(rows: &mut [f64], unit: &[f64]) {
    let along: f64 = rows.iter().zip(unit).map(|(a, b)| a * b).sum();
    rows.iter_mut().zip(unit).for_each(|(row, unit)| *row -= along * unit);
}

fn mean(values: Vec<f64>) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean of the middle half.
fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let cut = values.len() / 4;
    mean(values[cut..values.len() - cut].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_distr::StandardNormal;

    /// A part that rests, turns by a radian in half a second, and rests, or swings all the time, at 60 rows a second.
    fn rows(seed: u64, shared: f64, swings: bool) -> Vec<f64> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut last = 0.0;
        let mut noise = || {
            let drawn: f64 = random.sample(StandardNormal);
            last = shared * last + (1.0 - shared * shared).sqrt() * drawn;
            0.003 * last
        };
        let place = |row: i32| {
            if swings { 0.3 * (0.05 * f64::from(row)).sin() } else { ((f64::from(row) - 60.0) / 30.0).clamp(0.0, 1.0) }
        };
        (0..180).map(|row| place(row) + noise()).collect()
    }

    #[test]
    fn noise_is_found_beside_a_motion_whether_it_lasts_or_not() {
        for (shared, swings) in [(0.0, false), (0.6, false), (0.0, true), (0.4, true)] {
            let clips: Vec<Vec<f64>> = (0..6).map(|seed| rows(seed, shared, swings)).collect();
            let found = Noise::of(clips.iter().map(Vec::as_slice));
            let lasts = (1.0 + shared) / (1.0 - shared);
            assert!((0.8..1.2).contains(&(found.sigma / 0.003)), "{shared} {swings}: {found:?}");
            // Beside curves it is known by its order of magnitude alone.
            let most = if swings { 2.5 } else { 1.5 };
            assert!((0.6..most).contains(&(found.lasts / lasts)), "{shared} {swings}: {found:?} {lasts}");
        }
    }
}
