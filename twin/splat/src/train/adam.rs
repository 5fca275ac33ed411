//! One step of Adam for all parameters (Kingma & Ba 2015). A splat that the photograph does not show stays as it is, its
//! means too (Mallick et al. 2024).

use super::Rates;
use crate::gradient::Parameters;
use rayon::prelude::*;

const FIRST: f32 = 0.9;
const SECOND: f32 = 0.999;
/// Slopes are means over pixels, and small.
const SPARE: f32 = 1e-15;
/// The first coefficient of a colour learns so much quicker than the others.
const FIRST_COLOR: f64 = 20.0;
/// Splats that one thread takes at least.
const SPLATS_PER_THREAD: usize = 256;

/// Parameters on their way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moments {
    pub(super) at: Parameters<f32>,
    /// Running means of the slope and of its square.
    pub(super) mean: Parameters<f32>,
    pub(super) square: Parameters<f32>,
    /// Steps that are done.
    pub(super) step: usize,
}

impl Moments {
    pub(super) fn new(at: Parameters<f32>) -> Self {
        let none = Parameters::zeros(at.len(), at.degree);
        Self { at, mean: none.clone(), square: none, step: 0 }
    }

    /// Goes one step; the rate of the centres is in metres.
    pub(super) fn descend(&mut self, slope: &Parameters<f32>, rates: &Rates) {
        self.step += 1;
        let weight = |base: f32| (1.0 - f64::from(base).powf(self.step as f64)) as f32;
        let weights = [weight(FIRST), weight(SECOND)];
        let colors = 3 * self.at.coefficients();
        let widths = [3, 4, 3, 1, colors];
        let rates = [rates.centre, rates.turn, rates.log_sigma, rates.logit, rates.color];
        let columns = (self.at.columns_mut().into_iter().zip(self.mean.columns_mut()))
            .zip(self.square.columns_mut().into_iter().zip(slope.columns()));
        for ((((at, mean), (square, slope)), width), rate) in columns.zip(widths).zip(rates) {
            (at.par_chunks_mut(width).zip(mean.par_chunks_mut(width)))
                .zip(square.par_chunks_mut(width).zip(slope.par_chunks(width)))
                .with_min_len(SPLATS_PER_THREAD)
                .filter(|(_, (_, slope))| slope.iter().any(|slope| *slope != 0.0))
                .for_each(|((at, mean), (square, slope))| {
                    for (k, slope) in slope.iter().enumerate() {
                        let rate = if width == colors && k >= 3 { rate / FIRST_COLOR } else { rate };
                        mean[k] = FIRST * mean[k] + (1.0 - FIRST) * slope;
                        square[k] = SECOND * square[k] + (1.0 - SECOND) * slope * slope;
                        let steep = (square[k] / weights[1]).sqrt() + SPARE;
                        at[k] -= rate as f32 * (mean[k] / weights[0]) / steep;
                    }
                });
        }
    }
}
