//! How the camera projects: a pinhole, and the lens in front of it.

use nalgebra::Point3;
use shared_mem::cell::Intrinsics;
use shared_mem::lens::Distortion;
use twin::render::Pinhole;

/// A pinhole [pixel]; the optical frame looks along z, x right, y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal lengths along a row and along a column.
    pub focal: [f64; 2],
    /// Principal point: column, row.
    pub centre: [f64; 2],
}

impl Lens {
    /// From cell.toml's numbers.
    pub fn new(intrinsics: &Intrinsics) -> Self {
        Self { focal: [intrinsics.fx, intrinsics.fy], centre: [intrinsics.cx, intrinsics.cy] }
    }

    /// For the picture in which every pixel is the mean of `factor * factor` ones.
    pub fn shrunk(&self, factor: usize) -> Self {
        let factor = factor as f64;
        Self { focal: self.focal.map(|f| f / factor), centre: self.centre.map(|c| (c - (factor - 1.0) / 2.0) / factor) }
    }

    /// Column and row of a point of the optical frame; the point lies before the camera.
    pub fn project(&self, p: &Point3<f64>) -> [f64; 2] {
        [self.focal[0] * p.x / p.z + self.centre[0], self.focal[1] * p.y / p.z + self.centre[1]]
    }

    /// Where a lens that bends shows what the pinhole alone would put at `pixel`.
    pub fn bent(&self, distortion: &Distortion, pixel: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.plane(pixel);
        let seen = distortion.bend(x, y).0;
        [0, 1].map(|i| self.focal[i] * seen[i] + self.centre[i])
    }

    /// The way back; `None` where the lens shows nothing at `pixel`.
    pub fn straight(&self, distortion: &Distortion, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let plane = distortion.straight(self.plane(pixel))?;
        Some([0, 1].map(|i| self.focal[i] * plane[i] + self.centre[i]))
    }

    /// A pixel's place in the plane z = 1.
    fn plane(&self, pixel: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| (pixel[i] - self.centre[i]) / self.focal[i])
    }

    /// For the rasteriser.
    pub fn pinhole(&self) -> Pinhole {
        let [fx, fy, cx, cy] = [self.focal[0], self.focal[1], self.centre[0], self.centre[1]].map(|value| value as f32);
        Pinhole { fx, fy, cx, cy }
    }
}
