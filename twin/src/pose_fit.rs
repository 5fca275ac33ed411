//! What every least-squares fit of a pose is made of: the step in six numbers, how a point answers to it, and the normal equations.
//!
//! A step turns about a pivot by its first three numbers [rad] and then shifts by the last three [m], along the axes of the frame that
//! the pose leads to. About a point near the body the two hardly stand in for each other, about a camera far away they would.

use nalgebra::{Isometry3, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, Vector6};

/// A pose after a step.
pub fn moved(pose: &Isometry3<f64>, pivot: &Point3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
    let about = Translation3::from(pivot.coords) * turn * Translation3::from(-pivot.coords);
    Translation3::new(step[3], step[4], step[5]) * about * pose
}

/// How a point at `lever` from the pivot moves along `direction` with the six numbers.
#[inline]
pub fn slope(direction: &Vector3<f64>, lever: &Vector3<f64>) -> Vector6<f64> {
    let turn = lever.cross(direction);
    Vector6::new(turn.x, turn.y, turn.z, direction.x, direction.y, direction.z)
}

/// The direction along which a point of the camera's frame moves its place in a pinhole's picture along `across`: the place moves
/// by so many pixels as the product of the two says. `focal` [pixel].
#[inline]
pub fn pixel_direction(point: &Point3<f64>, focal: [f64; 2], across: [f64; 2]) -> Vector3<f64> {
    let [a, b] = [0, 1].map(|i| across[i] * focal[i] / point.z);
    Vector3::new(a, b, -(a * point.x + b * point.y) / point.z)
}

/// Normal equations of `N` numbers: weighted sums over the residuals.
#[derive(Debug, Clone)]
pub struct Equations<const N: usize> {
    /// Of the slopes' outer products.
    pub information: SMatrix<f64, N, N>,
    /// Of slope times residual: half the gradient of the weighted sum of squares.
    pub gradient: SVector<f64, N>,
}

impl<const N: usize> Equations<N> {
    pub fn zeros() -> Self {
        Self { information: SMatrix::zeros(), gradient: SVector::zeros() }
    }

    /// Adds a residual that changes by `slope` with the numbers.
    #[inline]
    pub fn add(&mut self, slope: &SVector<f64, N>, residual: f64, weight: f64) {
        self.information.ger(weight, slope, slope, 1.0);
        self.gradient.axpy(weight * residual, slope, 1.0);
    }

    /// The step to the least sum, each number's information larger by this share of it and by `floor`; `None` where it is singular.
    pub fn step(&self, damping: f64, floor: f64) -> Option<SVector<f64, N>> {
        let mut damped = self.information;
        for i in 0..N {
            damped[(i, i)] += damping * self.information[(i, i)] + floor;
        }
        Some(-damped.cholesky()?.solve(&self.gradient))
    }
}

impl<const N: usize> std::ops::Add for Equations<N> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { information: self.information + other.information, gradient: self.gradient + other.gradient }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A move far from small, so that a pivot or axes that are wrong show.
    const TRUTH: [f64; 6] = [0.1, -0.05, 0.2, 0.03, 0.02, -0.04];

    #[test]
    fn the_slope_is_the_difference_quotient_of_the_picture() {
        let (pose, focal) =
            (Isometry3::new(Vector3::new(0.1, -0.2, 0.9), Vector3::new(0.3, 0.1, -0.2)), [600.0, 590.0]);
        let (point, pivot) = (Point3::new(0.05, 0.02, -0.03), Point3::new(0.08, -0.15, 0.8));
        let place = |pose: &Isometry3<f64>, across: [f64; 2]| {
            let p = pose * point;
            across[0] * focal[0] * p.x / p.z + across[1] * focal[1] * p.y / p.z
        };
        for across in [[1.0, 0.0], [0.0, 1.0], [0.6, -0.8]] {
            let at = pose * point;
            let slope = slope(&pixel_direction(&at, focal, across), &(at - pivot));
            for k in 0..6 {
                let by = |size: f64| place(&moved(&pose, &pivot, &(Vector6::ith(k, size))), across);
                let quotient = (by(1e-6) - by(-1e-6)) / 2e-6;
                assert!((quotient - slope[k]).abs() < 1e-5, "{k}: {quotient} {}", slope[k]);
            }
        }
    }

    #[test]
    fn a_few_steps_find_the_move_between_two_sets_of_points() {
        let corner = |k: usize| Point3::new(0.04 * (k & 1) as f64, 0.06 * (k >> 1 & 1) as f64, 0.1 * (k >> 2) as f64);
        let truth = moved(&Isometry3::identity(), &Point3::origin(), &Vector6::from(TRUTH));
        let (mut pose, pivot) = (Isometry3::identity(), Point3::new(0.02, 0.03, 0.05));
        for _ in 0..8 {
            let mut equations = Equations::zeros();
            for point in (0..8).map(corner) {
                let (at, off) = (pose * point, pose * point - truth * point);
                (0..3).for_each(|k| equations.add(&slope(&Vector3::ith(k, 1.0), &(at - pivot)), off[k], 1.0));
            }
            pose = moved(&pose, &pivot, &equations.step(0.0, 0.0).expect("eight points"));
        }
        assert!((pose.inverse() * truth).translation.vector.norm() < 1e-12);
        assert!(pose.rotation.angle_to(&truth.rotation) < 1e-9);
    }
}
