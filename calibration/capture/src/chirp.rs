//! A chirp: every joint swings at a frequency that grows geometrically, all at the same one with phases of their own. What
//! lags, rings or delays shows by how gain and phase change with frequency. Pure; rad, s, Hz.
//!
//! `x(t) = a / (1 + (w / w_c)²) sin(phase(t))` with `w = 2 pi f_lo (f_hi / f_lo)^(t / T)` and `phase` its integral: below
//! the corner `w_c` the excursion is `a`, above it the acceleration stays at about `a w_c²`, so that an arm whose
//! acceleration is limited can follow up to the highest frequency. Derivatives are analytic.

use super::jet::{Jet, product, window};
use super::limits::LIMITS_SHARE;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use twin::arm::JointLimits;

/// Rise and fall of the window at the ends [s].
const WINDOW_RISE: f64 = 1.0;
/// Share of what a motion may accelerate that the sweep settles at; the rest is for its window and for the other joints' pull.
const STEADY_SHARE: f64 = 0.6;

/// A sweep of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Chirp {
    amplitude: f64,
    duration: f64,
    /// Angular frequency at the beginning [rad/s].
    lowest: f64,
    /// The angular frequency grows as `exp(growth t)` [1/s].
    growth: f64,
    joints: Vec<Swing>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Swing {
    phase: f64,
    corner: f64,
}

impl Chirp {
    /// From the lower to the higher of `frequency` [Hz] in `duration` [s], with excursions up to `amplitude` [rad]; `seed`
    /// draws the phases.
    pub fn draw(frequency: [f64; 2], amplitude: f64, duration: f64, seed: u64, limits: &[JointLimits]) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let swing = |limit: &JointLimits| Swing {
            phase: rng.random_range(0.0..TAU),
            // Above the corner the acceleration stays at the amplitude times its square.
            corner: (STEADY_SHARE * LIMITS_SHARE * limit.acceleration / amplitude).sqrt(),
        };
        let joints = limits.iter().map(swing).collect();
        let growth = (frequency[1] / frequency[0]).ln() / duration;
        Self { amplitude, duration, lowest: TAU * frequency[0], growth, joints }
    }

    /// Excursion of `joint` at `t` [s] and its derivatives [rad].
    pub fn at(&self, joint: usize, t: f64) -> Jet {
        let Swing { phase, corner } = self.joints[joint];
        let k = self.growth;
        let w = self.lowest * (k * t).exp();
        // The integral of w from the beginning.
        let (sin, cos) = (phase + (w - self.lowest) / k).sin_cos();
        // The phase's derivatives are w, k w and k² w.
        let wave = [sin, w * cos, k * w * cos - w * w * sin, (k * k * w - w.powi(3)) * cos - 3.0 * k * w * w * sin];
        // a = 1 / (1 + r) with r = (w / corner)², r' = 2 k r: each derivative by the product rule of the one before.
        let r = (w / corner).powi(2);
        let a = 1.0 / (1.0 + r);
        let d1 = -2.0 * k * r * a * a;
        let d2 = -2.0 * k * (2.0 * k * r * a * a + 2.0 * r * a * d1);
        let d3 = -2.0 * k * (4.0 * k * k * r * a * a + 8.0 * k * r * a * d1 + 2.0 * r * (d1 * d1 + a * d2));
        // A short sweep keeps half its length at its full size.
        let rise = WINDOW_RISE.min(0.25 * self.duration);
        product([a, d1, d2, d3].map(|x| self.amplitude * x), product(wave, window(t, self.duration, rise)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::jet::tests::assert_derivatives;
    use super::*;
    use twin::arm::{ArmModel, Limits};

    fn limits() -> Vec<JointLimits> {
        Limits::of(&shared_mem::cell::Cell::default(), &ArmModel::fr3()).counted().copied().collect()
    }

    #[test]
    fn its_derivatives_are_those_of_its_value() {
        let chirp = Chirp::draw([0.2, 3.0], 0.25, 12.0, 4, &limits());
        assert_derivatives(|t| chirp.at(1, t), (1..119).map(|i| 0.1 * f64::from(i) + 0.003));
    }

    #[test]
    fn it_begins_slowly_ends_fast_and_accelerates_no_more_at_ten_hertz_than_at_one() {
        let chirp = Chirp::draw([0.2, 10.0], 0.25, 20.0, 1, &limits());
        let largest = |order: usize, times: std::ops::Range<u32>| {
            times.map(|i| chirp.at(3, f64::from(i) * 1e-3)[order].abs()).fold(0.0, f64::max)
        };
        assert!(largest(0, 0..10_000) > 0.2, "slow swings are as large as asked for");
        assert!(largest(0, 18_000..19_000) < 4e-3, "fast ones are small");
        let ends = [chirp.at(3, 0.0), chirp.at(3, 20.0)];
        assert!(ends.iter().all(|end| end[..3].iter().all(|x| x.abs() < 1e-9)), "{ends:?}");
        let acceleration = largest(2, 0..20_000);
        assert!((4.0..9.0).contains(&acceleration), "{acceleration}");
        let crossings = (18_000..19_000_u32)
            .filter(|i| chirp.at(3, f64::from(*i) * 1e-3)[0] * chirp.at(3, f64::from(i + 1) * 1e-3)[0] < 0.0)
            .count();
        let hertz = 10.0 * 50.0_f64.powf(-1.5 / 20.0);
        assert!((crossings as f64 - 2.0 * hertz).abs() < 2.0, "{crossings} crossings at {hertz} Hz");
    }
}
