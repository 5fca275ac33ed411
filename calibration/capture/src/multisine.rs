//! The shape of an excitation: per joint a sum of sines on a common fundamental under a window that starts and ends at
//! rest. Dimensionless: the planner scales it to radians.
//!
//! All joints move at once, because gains show best where joints load each other. The derivatives are analytic, so that
//! set points carry an exact speed.

use super::jet::{Jet, product, window};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Fundamental of all joints [Hz]. One period, 5 s, fits a clip of the default length.
const FUNDAMENTAL: f64 = 0.2;
/// Multiples of the fundamental in use: 0.2 to 1.6 Hz, where a joint of an arm answers with stiffness, damping and inertia alike.
const MULTIPLES: [f64; 5] = [1.0, 2.0, 3.0, 5.0, 8.0];
/// Longest rise of the window [s].
const LONGEST_RISE: f64 = 1.5;

/// A windowed sum of sines for each joint, normalised so that each joint's largest magnitude is 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Multisine {
    joints: Vec<[Sine; MULTIPLES.len()]>,
    /// Length [s].
    duration: f64,
    /// Rise and fall of the window [s].
    rise: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sine {
    amplitude: f64,
    omega: f64,
    phase: f64,
}

impl Multisine {
    /// Draws amplitudes and phases for `dof` joints from `seed`. Amplitudes fall as 1/frequency, so that every sine
    /// brings about the same speed.
    pub fn draw(dof: usize, duration: f64, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let joints = (0..dof)
            .map(|_| {
                MULTIPLES.map(|multiple| Sine {
                    amplitude: rng.random_range(0.7..1.3) / multiple,
                    omega: TAU * FUNDAMENTAL * multiple,
                    phase: rng.random_range(0.0..TAU),
                })
            })
            .collect();
        let mut drawn = Self { joints, duration, rise: (0.25 * duration).min(LONGEST_RISE) };
        for joint in 0..dof {
            let peak = drawn.peak(joint);
            drawn.joints[joint].iter_mut().for_each(|sine| sine.amplitude /= peak);
        }
        drawn
    }

    /// The joint's largest magnitude, looked for each millisecond.
    fn peak(&self, joint: usize) -> f64 {
        let samples = (self.duration * 1e3).ceil() as u32;
        (0..=samples).map(|i| self.at(joint, f64::from(i) * 1e-3)[0].abs()).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Value and derivatives of `joint` at time `t` [s].
    pub fn at(&self, joint: usize, t: f64) -> Jet {
        let mut sum = [0.0; 4];
        for Sine { amplitude, omega, phase } in self.joints[joint] {
            let (sin, cos) = (omega * t + phase).sin_cos();
            let derivatives = [sin, omega * cos, -omega.powi(2) * sin, -omega.powi(3) * cos];
            for (total, derivative) in sum.iter_mut().zip(derivatives) {
                *total += amplitude * derivative;
            }
        }
        product(window(t, self.duration, self.rise), sum)
    }
}

#[cfg(test)]
mod tests {
    use super::super::jet::tests::assert_derivatives;
    use super::*;

    #[test]
    fn it_starts_and_ends_at_rest_where_it_began() {
        let shape = Multisine::draw(7, 8.0, 3);
        for joint in 0..7 {
            for t in [0.0, 8.0] {
                let [q, dq, ddq, _] = shape.at(joint, t);
                assert!(
                    q.abs() < 1e-12 && dq.abs() < 1e-12 && ddq.abs() < 1e-9,
                    "joint {joint} at {t} s: {q} {dq} {ddq}"
                );
            }
        }
    }

    #[test]
    fn its_derivatives_are_those_of_its_value() {
        let shape = Multisine::draw(2, 6.0, 11);
        assert_derivatives(|t| shape.at(1, t), (1..60).map(|i| 0.1 * f64::from(i) + 0.003));
    }

    #[test]
    fn every_joint_reaches_one_and_the_seed_decides_how() {
        let shape = Multisine::draw(3, 8.0, 5);
        for joint in 0..3 {
            assert!((shape.peak(joint) - 1.0).abs() < 1e-9);
        }
        assert_eq!(shape, Multisine::draw(3, 8.0, 5));
        assert_ne!(shape, Multisine::draw(3, 8.0, 6));
    }
}
