//! Encoders: white noise and the step of their scale, the same for all joints, from `[simulation]` of cell.toml.

use rand_distr::{Distribution as _, Normal};
use shared_mem::cell::Cell;
use shared_mem::msg::Joints;

/// Adds noise to measured joint positions and velocities.
#[derive(Debug, Clone)]
pub(super) struct JointNoise {
    position: Normal<f64>,
    velocity: Normal<f64>,
    position_step: f64,
    velocity_step: f64,
    generator: rand_pcg::Pcg64,
}

impl JointNoise {
    /// Noise of a cell's encoders; none where cell.toml gives none.
    pub(super) fn new(cell: &Cell) -> Self {
        let normal =
            |sigma: f64| Normal::new(0.0, sigma.abs()).unwrap_or_else(|_| Normal::new(0.0, 0.0).expect("zero"));
        Self {
            position: normal(cell.simulation.q_noise),
            velocity: normal(cell.simulation.dq_noise),
            position_step: cell.simulation.q_step,
            velocity_step: cell.simulation.dq_step,
            generator: super::generator(cell, 1),
        }
    }

    /// Adds a fresh draw to the first `dof` joints of `q` [rad] and `dq` [rad/s] and rounds them to the encoder's steps.
    pub(super) fn add(&mut self, dof: usize, q: &mut Joints, dq: &mut Joints) {
        for (q, dq) in q.iter_mut().zip(dq).take(dof) {
            *q = rounded(*q + self.position.sample(&mut self.generator), self.position_step);
            *dq = rounded(*dq + self.velocity.sample(&mut self.generator), self.velocity_step);
        }
    }
}

/// The nearest multiple of `step`; the value itself where there is no step.
fn rounded(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_multiples_of_the_encoders_step_and_no_farther_than_half_of_it() {
        let mut cell = Cell::default();
        cell.simulation.q_step = std::f64::consts::TAU / 4096.0;
        let mut noise = JointNoise::new(&cell);
        for i in 0..100 {
            let (mut q, mut dq) = ([0.0137 * f64::from(i); 8], [0.1; 8]);
            noise.add(1, &mut q, &mut dq);
            let steps = q[0] / cell.simulation.q_step;
            assert!((steps - steps.round()).abs() < 1e-9 && (q[0] - q[1]).abs() <= 0.5 * cell.simulation.q_step);
            assert_eq!(dq[0], 0.1, "no step, no rounding");
        }
    }

    #[test]
    fn the_noise_has_the_sigma_of_the_cell_and_repeats_with_its_seed() {
        let mut cell = Cell::default();
        cell.simulation.q_noise = 2e-6;
        let draw = |cell: &Cell| {
            let mut noise = JointNoise::new(cell);
            (0..2000)
                .map(|_| {
                    let (mut q, mut dq) = ([0.0; 8], [0.0; 8]);
                    noise.add(1, &mut q, &mut dq);
                    assert_eq!((q[1], dq[0]), (0.0, 0.0), "only what is asked for");
                    q[0]
                })
                .collect::<Vec<f64>>()
        };
        let values = draw(&cell);
        let sigma = (values.iter().map(|v| v * v).sum::<f64>() / 2000.0).sqrt();
        assert!((sigma / 2e-6 - 1.0).abs() < 0.1, "{sigma}");
        assert_eq!(values, draw(&cell));
        cell.simulation.seed += 1;
        assert_ne!(values, draw(&cell));
    }
}
