//! How wrong the arm's poses are, from how much the pictures disagree: two variances, of turn and of shift, by restricted maximum
//! likelihood (Patterson & Thompson 1971), which counts the twelve numbers that were fitted.

use super::chain::{Slopes, Twelve};
use nalgebra::{Matrix6, SMatrix, Vector6};

/// What one picture says of the arm's error there, to first order: `value = error + slopes · step + noise`.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The error that explains the picture whole: turn [rad], shift [m].
    pub value: Vector6<f64>,
    /// Covariance of its noise, by the pixels.
    pub noise: Matrix6<f64>,
    /// How the value changes with the twelve numbers.
    pub slopes: Slopes,
}

/// One sigma of the arm's error along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSigma {
    /// Of its turn [rad].
    pub rotation: f64,
    /// Of its place [m].
    pub position: f64,
}

/// No arm is better or worse than this [rad and m].
const RANGE: std::ops::RangeInclusive<f64> = 1e-6..=0.2;
/// One sigma of what is known of the twelve numbers beforehand [rad and m]: nothing, but the equations keep an answer.
const BEFOREHAND: f64 = 10.0;

/// Information of 12 numbers.
pub type Information = SMatrix<f64, 12, 12>;

impl ArmSigma {
    /// Covariance of one picture's error with its noise.
    pub fn with(&self, noise: &Matrix6<f64>) -> Matrix6<f64> {
        let (r, p) = (self.rotation.powi(2), self.position.powi(2));
        noise + Matrix6::from_diagonal(&Vector6::new(r, r, r, p, p, p))
    }

    /// The most likely one, from `self` on.
    pub fn most_likely(self, observations: &[Observation]) -> Self {
        let clamp = |v: f64| v.clamp(*RANGE.start(), *RANGE.end());
        let (mut best, mut step) = (self, 1.5_f64);
        let mut least = deviance(observations, &best);
        while step > 0.02 {
            let factor = step.exp();
            let around = [[factor, 1.0], [1.0 / factor, 1.0], [1.0, factor], [1.0, 1.0 / factor]];
            let better = around
                .map(|[r, p]| Self { rotation: clamp(best.rotation * r), position: clamp(best.position * p) })
                .map(|sigma| (deviance(observations, &sigma), sigma))
                .into_iter()
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .filter(|(value, _)| *value < least - 1e-9);
            match better {
                Some((value, sigma)) => (least, best) = (value, sigma),
                None => step *= 0.5,
            }
        }
        best
    }
}

/// Information and right side of the normal equations for a step of the twelve numbers; `None` where a covariance is none.
pub fn normal_equations(observations: &[Observation], sigma: &ArmSigma) -> Option<(Information, Twelve)> {
    let mut information = Information::identity() / (BEFOREHAND * BEFOREHAND);
    let mut right = Twelve::zeros();
    for Observation { value, noise, slopes } in observations {
        let weight = sigma.with(noise).cholesky()?.inverse();
        information += slopes.transpose() * weight * slopes;
        right += slopes.transpose() * weight * value;
    }
    Some((information, right))
}

/// -2 ln of the restricted likelihood, less a constant; infinite where it has no value.
fn deviance(observations: &[Observation], sigma: &ArmSigma) -> f64 {
    let value = || {
        let (information, right) = normal_equations(observations, sigma)?;
        let information = information.cholesky()?;
        let step = information.solve(&right);
        let mut sum = 2.0 * information.l().diagonal().map(f64::ln).sum();
        for Observation { value, noise, slopes } in observations {
            let covariance = sigma.with(noise).cholesky()?;
            let left = value - slopes * step;
            sum += 2.0 * covariance.l().diagonal().map(f64::ln).sum() + left.dot(&covariance.solve(&left));
        }
        Some(sum)
    };
    value().unwrap_or(f64::INFINITY)
}
