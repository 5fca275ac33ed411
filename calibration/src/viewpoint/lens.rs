//! How the camera projects: a pinhole, and the lens in front of it as Brown and Conrady describe it.

use nalgebra::Point3;
use shared_mem::cell::Intrinsics;
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
    #[must_use]
    pub fn new(intrinsics: &Intrinsics) -> Self {
        Self { focal: [intrinsics.fx, intrinsics.fy], centre: [intrinsics.cx, intrinsics.cy] }
    }

    /// For the picture in which every pixel is the mean of `factor * factor` ones.
    #[must_use]
    pub fn shrunk(&self, factor: usize) -> Self {
        let factor = factor as f64;
        Self { focal: self.focal.map(|f| f / factor), centre: self.centre.map(|c| (c - (factor - 1.0) / 2.0) / factor) }
    }

    /// Column and row of a point of the optical frame; the point lies before the camera.
    #[must_use]
    pub fn project(&self, p: &Point3<f64>) -> [f64; 2] {
        [self.focal[0] * p.x / p.z + self.centre[0], self.focal[1] * p.y / p.z + self.centre[1]]
    }

    /// For the rasteriser.
    #[must_use]
    pub fn pinhole(&self) -> Pinhole {
        let [fx, fy, cx, cy] = [self.focal[0], self.focal[1], self.centre[0], self.centre[1]].map(|value| value as f32);
        Pinhole { fx, fy, cx, cy }
    }
}

/// Where the lens with the coefficients k1, k2, p1, p2, k3 puts what the pinhole alone would put at `pixel`
/// (Brown 1971, with the signs and the order of OpenCV).
#[must_use]
pub fn distorted(lens: &Lens, [k1, k2, p1, p2, k3]: &[f64; 5], pixel: [f64; 2]) -> [f64; 2] {
    let [x, y] = [0, 1].map(|i| (pixel[i] - lens.centre[i]) / lens.focal[i]);
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    [lens.focal[0] * (x * radial + dx) + lens.centre[0], lens.focal[1] * (y * radial + dy) + lens.centre[1]]
}
