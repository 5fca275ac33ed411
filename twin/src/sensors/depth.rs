//! From surfaces to what a stereo depth camera reports: millimetres in 16 bits, noise that grows with the square of
//! the distance, nothing too near or too far.

use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};

/// Metres per count.
pub(super) const SCALE: f64 = 0.001;
/// Nearest and farthest reported depth of a D455 [m] (data sheet: 0.4 m at 1280 columns, 6 m with a 2 % error).
const RANGE: [f32; 2] = [0.4, 6.0];
/// Distance between the two imagers of a D455 [m].
const BASELINE: f32 = 0.095;
/// Noise of the disparity, one sigma [pixel]: a textured surface in good light.
const DISPARITY_NOISE: f32 = 0.08;
/// Focal length of the depth imagers at 1280 columns [pixel].
const FOCAL_AT_1280: f32 = 640.0;
/// Draws are made once and read from a random place a row: a draw a pixel would cost more than the picture.
const DRAWS: usize = 1 << 14;

/// Turns inverse depth into counts.
#[derive(Debug, Clone)]
pub(super) struct DepthSensor {
    draws: Vec<f32>,
    /// Standard deviation over depth squared [1/mm].
    noise: f32,
    generator: rand_pcg::Pcg64,
}

impl DepthSensor {
    /// For a picture of this size; `noisy` false gives the exact distance, rounded to counts.
    pub(super) fn new(width: u32, height: u32, noisy: bool, mut generator: rand_pcg::Pcg64) -> Self {
        let draws = (0..DRAWS).map(|_| StandardNormal.sample(&mut generator)).collect();
        let zoom = (width as f32 / 1280.0).max(height as f32 / 720.0);
        // sigma_z = z^2 sigma_disparity / (f baseline), here with z in millimetres.
        let noise = if noisy { DISPARITY_NOISE / (FOCAL_AT_1280 * zoom * BASELINE) * SCALE as f32 } else { 0.0 };
        Self { draws, noise, generator }
    }

    /// Writes one row: little-endian counts, 0 where nothing is measured.
    pub(super) fn row(&mut self, inverse_depth: &[f32], out: &mut [u8]) {
        let offset = self.generator.random_range(0..DRAWS - inverse_depth.len().min(DRAWS - 1));
        let [near, far] = RANGE;
        let per_metre = (1.0 / SCALE) as f32;
        let draws = &self.draws[offset..];
        for ((out, inverse), draw) in out.chunks_exact_mut(2).zip(inverse_depth).zip(draws) {
            let millimetres = per_metre / inverse.max(1e-6);
            let noisy = millimetres + millimetres * millimetres * self.noise * draw;
            let seen = *inverse <= 1.0 / near && *inverse >= 1.0 / far;
            let counts = if seen { (noisy + 0.5) as i32 as u16 } else { 0 };
            out.copy_from_slice(&counts.to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(noisy: bool) -> DepthSensor {
        DepthSensor::new(1280, 720, noisy, rand_pcg::Pcg64::new(1, 2))
    }

    fn counts(sensor: &mut DepthSensor, depths: &[f32]) -> Vec<u16> {
        let inverse: Vec<f32> = depths.iter().map(|z| 1.0 / z).collect();
        let mut out = vec![0; 2 * depths.len()];
        sensor.row(&inverse, &mut out);
        out.chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
    }

    #[test]
    fn too_near_too_far_and_nothing_at_all_are_zero() {
        assert_eq!(
            counts(&mut sensor(false), &[0.39, 0.41, 1.2345, 5.99, 6.01, f32::INFINITY]),
            [0, 410, 1235, 5990, 0, 0]
        );
    }

    #[test]
    fn the_noise_grows_with_the_square_of_the_distance() {
        let mut sensor = sensor(true);
        for (z, sigma) in [(1.0f32, 1.32), (2.0, 5.26)] {
            let values: Vec<f64> = (0..40)
                .flat_map(|_| counts(&mut sensor, &[z; 640]))
                .map(|c| f64::from(c) - f64::from(z) * 1000.0)
                .collect();
            let found = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
            assert!((found / sigma - 1.0).abs() < 0.1, "{found} mm at {z} m");
        }
    }
}
