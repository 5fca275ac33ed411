//! One picture of the board: its corners in pixels, what the arm said, and what both say of the board's place before the camera.

use crate::viewpoint::lens::Lens;
use crate::viewpoint::planar::{self, Seen};
use nalgebra::{Isometry3, Point3};
use shared_mem::statistics::median;
use twin::pose_fit::{Equations, moved};

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

/// Residuals beyond so many sigmas count less, and beyond nothing but this share of them (Huber 1964).
const HUBER: f64 = 2.5;
/// Rounds of weighting and fitting one picture.
const REWEIGHTINGS: usize = 12;
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

    /// The equations at a pose of the board, for steps of it about the camera's origin; `None` where a corner lies behind the camera.
    pub fn equations(&self, camera_from_board: &Isometry3<f64>, weights: &[f64]) -> Option<Equations<6>> {
        Some(planar::equations(&self.seen, &self.lens, camera_from_board, &Point3::origin(), weights)?.1)
    }

    /// The board in the camera's frame by this picture alone, robust against single wrong corners, and sigma of the corners [pixel];
    /// `None` for fewer than six corners or those of one row.
    pub fn board(&self) -> Option<(Isometry3<f64>, f64)> {
        if self.seen.len() < 6 {
            return None;
        }
        let mut pose = planar::pose(&self.seen, &self.lens)?;
        let mut sigma = f64::INFINITY;
        for _ in 0..REWEIGHTINGS {
            // Six numbers of the pose have been fitted.
            let free = 1.0 - 3.0 / self.seen.len() as f64;
            sigma = median(self.residuals(&pose))? / MEDIAN_LENGTH / free.sqrt();
            let weights = self.weights(&pose, sigma.max(1e-9));
            pose = moved(&pose, &Point3::origin(), &self.equations(&pose, &weights)?.step(0.0, 0.0)?);
        }
        Some((pose, sigma))
    }
}
