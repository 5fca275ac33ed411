//! One step down a sum of squares: damped Newton steps, tried with growing damping until one costs less.

use super::bounded::bounded_step;
use nalgebra::{DMatrix, DVector};

/// Damping falls by this after a step that led down.
const RELIEF: f64 = 0.1;
/// It grows by this after one that did not, to at least [`LEAST`]: below, nothing is damped that matters.
const GROWTH: f64 = 20.0;
const LEAST: f64 = 1e-3;
/// No damping is less than this, or more.
const NOTHING: f64 = 1e-9;
const MOST: f64 = 1e12;

/// A point from which a step is looked for: `2 g's + s'Hs` is what the cost is expected to change by.
pub struct Descent<'a> {
    /// `H`, `P x P`.
    pub information: &'a DMatrix<f64>,
    /// `g`, `P`.
    pub gradient: &'a DVector<f64>,
    /// How far down (at most 0) and how far up each number may go.
    pub room: &'a [[f64; 2]],
    /// A step that promises less is not tried.
    pub enough: f64,
    /// Most steps that are tried.
    pub trials: usize,
}

impl Descent<'_> {
    /// The first step that leads down, as `attempt` (given the number of the trial and the step) makes it, `None` from it where
    /// the step costs more or has no answer. `damping` is kept for the next point.
    ///
    /// `None` where no step is worth it or none leads down.
    pub fn step<T>(&self, damping: &mut f64, mut attempt: impl FnMut(usize, &DVector<f64>) -> Option<T>) -> Option<T> {
        let mut trial = 0;
        while trial < self.trials && *damping < MOST {
            let step = bounded_step(self.information, self.gradient, self.room, *damping);
            let promised = self.promised(&step);
            // A step that leads up where many numbers come to their bounds at once is damped, not tried.
            if promised >= 0.0 {
                if promised < self.enough {
                    return None;
                }
                if let Some(found) = attempt(trial, &step) {
                    *damping = (*damping * RELIEF).max(NOTHING);
                    return Some(found);
                }
                trial += 1;
            }
            *damping = (*damping * GROWTH).max(LEAST);
        }
        None
    }

    /// By how much a step lowers the cost where the clips are as linear as they look.
    pub fn promised(&self, step: &DVector<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(self.information * step)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(x^2 - 1)^2 + 1`, around `x`: `r = x^2 - 1` has the slope `2 x`.
    fn at(x: f64) -> (DMatrix<f64>, DVector<f64>, f64) {
        let (r, slope) = (x * x - 1.0, 2.0 * x);
        (DMatrix::from_element(1, 1, slope * slope), DVector::from_element(1, slope * r), r * r)
    }

    #[test]
    fn a_step_that_overshoots_is_damped_until_it_leads_down() {
        let (information, gradient, cost) = at(0.1);
        let descent =
            Descent { information: &information, gradient: &gradient, room: &[[-9.0, 9.0]], enough: 0.0, trials: 9 };
        let mut damping = NOTHING;
        let mut tried = Vec::new();
        let found = descent.step(&mut damping, |_, step| {
            tried.push(step[0]);
            let there = at(0.1 + step[0]).2;
            (there < cost).then_some(there)
        });
        assert!(tried.len() > 1 && tried.windows(2).all(|pair| pair[1] < pair[0]), "{tried:?}");
        assert!(found.is_some_and(|there| there < cost) && damping > NOTHING);
    }

    #[test]
    fn what_promises_too_little_is_not_tried() {
        let (information, gradient, _) = at(1.000_1);
        let descent =
            Descent { information: &information, gradient: &gradient, room: &[[-9.0, 9.0]], enough: 1e-3, trials: 9 };
        assert_eq!(descent.step(&mut 1e-6, |_, _| -> Option<()> { panic!("it was tried") }), None);
    }
}
