//! Pinhole and Brown-Conrady distortion [pixel]: forward with its slope, and backward. Pixel centres lie at whole numbers.

use super::real::Real;
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
        let (bent, slope) = bend(&self.distortion, x, y);
        let flat = Matrix2x3::new(1.0 / p.z, 0.0, -x / p.z, 0.0, 1.0 / p.z, -y / p.z);
        let focal = Matrix2::from_diagonal(&Vector2::from(self.focal));
        let pixel = [0, 1].map(|i| self.focal[i] * bent[i] + self.centre[i]);
        (pixel, focal * slope * flat)
    }

    /// The direction that a pixel sees, with z = 1.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Vector3<f64> {
        let wanted = Vector2::from([0, 1].map(|i| (pixel[i] - self.centre[i]) / self.focal[i]));
        let mut at = wanted;
        if self.is_bent() {
            for _ in 0..STEPS {
                let (bent, slope) = bend(&self.distortion, at.x, at.y);
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

/// The distortion of a point of the plane z = 1, and its slope.
pub(super) fn bend<T: Real>(distortion: &[T; 5], x: T, y: T) -> (Vector2<T>, Matrix2<T>) {
    let [k1, k2, p1, p2, k3] = *distortion;
    let [one, two, three, six] = [1.0, 2.0, 3.0, 6.0].map(T::of);
    let r2 = x * x + y * y;
    let radial = one + r2 * (k1 + r2 * (k2 + r2 * k3));
    let rise = k1 + r2 * (two * k2 + three * r2 * k3);
    let bent = Vector2::new(
        x * radial + two * p1 * x * y + p2 * (r2 + two * x * x),
        y * radial + p1 * (r2 + two * y * y) + two * p2 * x * y,
    );
    let mixed = two * x * y * rise + two * p1 * x + two * p2 * y;
    let slope = Matrix2::new(
        radial + two * x * x * rise + two * p1 * y + six * p2 * x,
        mixed,
        mixed,
        radial + two * y * y * rise + six * p1 * y + two * p2 * x,
    );
    (bent, slope)
}

/// How the slope of the distortion changes with x and with y. It is symmetric, as are the two answers.
pub(super) fn bend_curvature<T: Real>(distortion: &[T; 5], x: T, y: T) -> [Matrix2<T>; 2] {
    let [k1, k2, p1, p2, k3] = *distortion;
    let [two, three, four, six] = [2.0, 3.0, 4.0, 6.0].map(T::of);
    let r2 = x * x + y * y;
    let rise = k1 + r2 * (two * k2 + three * r2 * k3);
    let bow = two * k2 + six * k3 * r2;
    let xxx = six * x * rise + four * x * x * x * bow + six * p2;
    let xxy = two * y * rise + four * x * x * y * bow + two * p1;
    let xyy = two * x * rise + four * x * y * y * bow + two * p2;
    let yyy = six * y * rise + four * y * y * y * bow + six * p1;
    [Matrix2::new(xxx, xxy, xxy, xyy), Matrix2::new(xxy, xyy, xyy, yyy)]
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
