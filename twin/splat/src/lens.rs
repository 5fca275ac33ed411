//! Pinhole and distortion [pixel]: forward with its slope, and backward. Pixel centres lie at whole numbers.

use nalgebra::{Matrix2, Matrix2x3, Point3, Vector2, Vector3};
use shared_mem::lens::Distortion;

/// How a camera projects.
///
/// ```
/// use nalgebra::Point3;
/// use splat::{Distortion, Lens};
///
/// let lens = Lens { focal: [600.0; 2], centre: [319.5, 239.5], distortion: Distortion::NONE }; // pixels
/// let ([u, v], _slope) = lens.project(&Point3::new(0.1, 0.0, 1.0)); // m
/// assert!((u - 379.5).abs() < 1e-9 && (v - 239.5).abs() < 1e-9);
/// let ray = lens.ray([u, v]);
/// assert!((ray.x / ray.z - 0.1).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal lengths along a row and along a column.
    pub focal: [f64; 2],
    /// Principal point: column, row.
    pub centre: [f64; 2],
    /// What the lens does.
    pub distortion: Distortion,
}

impl Lens {
    /// Where a point of the optical frame lands, and how that changes with the point.
    pub fn project(&self, p: &Point3<f64>) -> ([f64; 2], Matrix2x3<f64>) {
        let (x, y) = (p.x / p.z, p.y / p.z);
        let (bent, slope) = self.distortion.bend(x, y);
        let flat = Matrix2x3::new(1.0 / p.z, 0.0, -x / p.z, 0.0, 1.0 / p.z, -y / p.z);
        let focal = Matrix2::from_diagonal(&Vector2::from(self.focal));
        let pixel = [0, 1].map(|i| self.focal[i] * bent[i] + self.centre[i]);
        (pixel, focal * slope * flat)
    }

    /// The direction that a pixel sees, with z = 1.
    pub fn ray(&self, pixel: [f64; 2]) -> Vector3<f64> {
        let [x, y] = self.distortion.direction([0, 1].map(|i| (pixel[i] - self.centre[i]) / self.focal[i]));
        Vector3::new(x, y, 1.0)
    }

    /// Whether there is any distortion.
    pub fn is_bent(&self) -> bool {
        self.distortion.is_bent()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens {
        focal: [600.0, 590.0],
        centre: [322.0, 241.0],
        distortion: Distortion::brown([-0.06, 0.05, 4e-4, -7e-4, -0.01]),
    };

    #[test]
    fn a_ray_lands_on_its_pixel_and_the_slope_is_the_difference_quotient() {
        for pixel in [[0.0, 0.0], [639.0, 479.0], [100.0, 400.0], [322.0, 241.0]] {
            let p = Point3::from(LENS.ray(pixel) * 1.7);
            let (there, slope) = LENS.project(&p);
            assert!((0..2).all(|i| (there[i] - pixel[i]).abs() < 1e-8), "{there:?}");
            for k in 0..3 {
                let mut moved = p;
                moved[k] += 1e-6;
                for i in 0..2 {
                    let quotient = (LENS.project(&moved).0[i] - there[i]) / 1e-6;
                    assert!((quotient - slope[(i, k)]).abs() < 1e-2, "{quotient} {}", slope[(i, k)]);
                }
            }
        }
    }
}
