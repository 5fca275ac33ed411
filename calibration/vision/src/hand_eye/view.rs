//! One picture of the board: its corners in pixels, what the arm said, and what both say of the board's place before the camera.

use crate::viewpoint::lens::Lens;
use crate::viewpoint::planar::{self, Seen};
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use shared_mem::statistics::median;

/// A picture of the board.
#[derive(Debug, Clone)]
pub struct View {
    /// The picture's name.
    pub name: String,
    /// The end effector in the base frame as the arm said it [m]: `O_T_EE`.
    pub base_from_end_effector: Isometry3<f64>,
    /// Corners of the board: where in its plane [m], where in the picture without distortion [pixel].
    pub seen: Vec<Seen>,
    pub lens: Lens,
}

/// Squares of what is left of the pixels, its slope and its information, about a pose of the board.
pub struct Equations {
    /// Half the gradient of the weighted sum of squares [pixel²].
    pub gradient: Vector6<f64>,
    /// Its Gauss-Newton information.
    pub information: Matrix6<f64>,
}

/// Residuals beyond so many sigmas count less, and beyond nothing but this share of them (Huber 1964).
const HUBER: f64 = 2.5;
/// Rounds of weighting and fitting one picture.
const ROUNDS: usize = 12;
/// A median of lengths of two normal numbers is so many of their sigmas.
const MEDIAN_LENGTH: f64 = 1.177;

impl View {
    /// Lengths of what is left of each corner [pixel]; infinite for those behind the camera.
    pub fn residuals(&self, camera_from_board: &Isometry3<f64>) -> Vec<f64> {
        let off = |seen: &Seen| {
            let at = camera_from_board * Point3::new(seen.place[0], seen.place[1], 0.0);
            let [u, v] = self.lens.project(&at);
            if at.z > 0.0 { (u - seen.pixel[0]).hypot(v - seen.pixel[1]) } else { f64::INFINITY }
        };
        self.seen.iter().map(off).collect()
    }

    /// Their root mean square, without corners that weigh less than whole.
    pub fn rms(&self, camera_from_board: &Isometry3<f64>, weights: &[f64]) -> f64 {
        let pairs = self.residuals(camera_from_board).into_iter().zip(weights);
        let (sum, count) = pairs.filter(|(_, w)| **w >= 1.0).fold((0.0, 0), |(sum, n), (r, _)| (sum + r * r, n + 1));
        (sum / f64::from(count.max(1))).sqrt()
    }

    /// The weights of corners whose residuals have this sigma along a row and along a column [pixel].
    pub fn weights(&self, camera_from_board: &Isometry3<f64>, sigma: f64) -> Vec<f64> {
        let weight = |off: f64| (HUBER * sigma / off.max(1e-12)).min(1.0);
        self.residuals(camera_from_board).into_iter().map(weight).collect()
    }

    /// The equations at a pose of the board, for moves of it in the camera's frame: turn about the camera's origin, then shift;
    /// `None` where a corner lies behind the camera.
    pub fn equations(&self, camera_from_board: &Isometry3<f64>, weights: &[f64]) -> Option<Equations> {
        let (mut gradient, mut information) = (Vector6::zeros(), Matrix6::zeros());
        for (seen, weight) in self.seen.iter().zip(weights) {
            let p = camera_from_board * Point3::new(seen.place[0], seen.place[1], 0.0);
            if p.z <= 1e-6 {
                return None;
            }
            let there = self.lens.project(&p);
            for axis in 0..2 {
                let mut along = Vector3::zeros();
                along[axis] = self.lens.focal[axis] / p.z;
                along.z = -self.lens.focal[axis] * p[axis] / (p.z * p.z);
                let turn = p.coords.cross(&along);
                let slope = Vector6::new(turn.x, turn.y, turn.z, along.x, along.y, along.z);
                gradient += *weight * (there[axis] - seen.pixel[axis]) * slope;
                information += *weight * slope * slope.transpose();
            }
        }
        Some(Equations { gradient, information })
    }

    /// The board in the camera's frame by this picture alone, robust against single wrong corners, and sigma of the corners [pixel];
    /// `None` for fewer than six corners or those of one row.
    pub fn board(&self) -> Option<(Isometry3<f64>, f64)> {
        if self.seen.len() < 6 {
            return None;
        }
        let mut pose = planar::pose(&self.seen, &self.lens)?;
        let mut sigma = f64::INFINITY;
        for _ in 0..ROUNDS {
            // Six numbers of the pose have been fitted.
            let free = 1.0 - 3.0 / self.seen.len() as f64;
            sigma = median(self.residuals(&pose))? / MEDIAN_LENGTH / free.sqrt();
            let weights = self.weights(&pose, sigma.max(1e-9));
            let Equations { gradient, information } = self.equations(&pose, &weights)?;
            pose = moved(&pose, &-information.cholesky()?.solve(&gradient));
        }
        Some((pose, sigma))
    }
}

/// A board's pose after a small move as the camera sees it: turn about the camera's origin, then shift.
pub fn moved(camera_from_board: &Isometry3<f64>, by: &Vector6<f64>) -> Isometry3<f64> {
    crate::viewpoint::step::moved(camera_from_board, &Point3::origin(), by)
}
