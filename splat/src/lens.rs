//! Pinhole and Brown-Conrady distortion [pixel]: forward with its slope, and backward. Pixel centres lie at whole numbers.

use nalgebra::{Matrix2, Matrix2x3, Point3, Vector2, Vector3};

/// How a camera projects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Focal lengths along a row and along a column.
    pub focal: [f64; 2],
    /// Principal point: column, row.
    pub centre: [f64; 2],
    /// k1, k2, p1, p2, k3, with OpenCV's signs.
    pub distortion: [f64; 5],
}

/// Steps backward through the distortion; each brings some digits for lenses that do not fold the picture.
const STEPS: usize = 20;

impl Lens {
    /// Where a point of the optical frame lands, and how that changes with the point.
    #[must_use]
    pub fn project(&self, p: &Point3<f64>) -> ([f64; 2], Matrix2x3<f64>) {
        let (x, y) = (p.x / p.z, p.y / p.z);
        let (bent, slope) = self.bend(x, y);
        let flat = Matrix2x3::new(1.0 / p.z, 0.0, -x / p.z, 0.0, 1.0 / p.z, -y / p.z);
        let focal = Matrix2::from_diagonal(&Vector2::from(self.focal));
        let pixel = [0, 1].map(|i| self.focal[i] * bent[i] + self.centre[i]);
        (pixel, focal * slope * flat)
    }

    /// The distortion of a point of the plane z = 1, and its slope.
    fn bend(&self, x: f64, y: f64) -> (Vector2<f64>, Matrix2<f64>) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let rise = k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3);
        let bent = Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let mixed = 2.0 * x * y * rise + 2.0 * p1 * x + 2.0 * p2 * y;
        let slope = Matrix2::new(
            radial + 2.0 * x * x * rise + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + 2.0 * y * y * rise + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (bent, slope)
    }

    /// The direction that a pixel sees, with z = 1.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Vector3<f64> {
        let wanted = Vector2::from([0, 1].map(|i| (pixel[i] - self.centre[i]) / self.focal[i]));
        let mut at = wanted;
        if self.is_bent() {
            for _ in 0..STEPS {
                let (bent, slope) = self.bend(at.x, at.y);
                let Some(back) = slope.try_inverse() else { break };
                let step = back * (wanted - bent);
                at += step;
                if step.norm() < 1e-13 {
                    break;
                }
            }
        }
        Vector3::new(at.x, at.y, 1.0)
    }

    /// Whether there is any distortion.
    #[must_use]
    pub fn is_bent(&self) -> bool {
        self.distortion.iter().any(|k| *k != 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens =
        Lens { focal: [600.0, 590.0], centre: [322.0, 241.0], distortion: [-0.06, 0.05, 4e-4, -7e-4, -0.01] };

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
