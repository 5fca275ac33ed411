//! librealsense gives the lens of some cameras the other way round: coefficients that take a distorted point to an
//! undistorted one. Everything here knows Brown and Conrady's way, so the coefficients are fitted.
//!
//! Source: librealsense, `rs2_deproject_pixel_to_point`, `RS2_DISTORTION_INVERSE_BROWN_CONRADY`.

use nalgebra::{Matrix5, Vector5};
use shared_mem::lens::Distortion;

/// Points along a row and a column that the fit looks at.
const POINTS: u32 = 24;

/// Coefficients k1, k2, p1, p2, k3 that undo `inverse`, for a picture with focal lengths and principal point `pinhole`
/// [pixel] and this many columns and rows.
pub(super) fn inverted(inverse: &[f64; 5], pinhole: [f64; 4], [width, height]: [u32; 2]) -> [f64; 5] {
    let [fx, fy, cx, cy] = pinhole;
    let (mut square, mut right) = (Matrix5::zeros(), Vector5::zeros());
    for row in 0..=POINTS {
        for column in 0..=POINTS {
            let share = |i: u32, size: u32| f64::from(i) / f64::from(POINTS) * f64::from(size - 1);
            let (xd, yd) = ((share(column, width) - cx) / fx, (share(row, height) - cy) / fy);
            let bent = Distortion::brown(*inverse).bend(xd, yd).0;
            let (x, y) = (bent.x, bent.y);
            // What distortion adds is linear in its coefficients.
            let r2 = x * x + y * y;
            let along_x = Vector5::new(x * r2, x * r2 * r2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2.powi(3));
            let along_y = Vector5::new(y * r2, y * r2 * r2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2.powi(3));
            for (line, off) in [(along_x, xd - x), (along_y, yd - y)] {
                square += line * line.transpose();
                right += line * off;
            }
        }
    }
    square.cholesky().map_or([0.0; 5], |square| square.solve(&right).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fitted_lens_undoes_the_inverse_one_to_a_tenth_of_a_pixel() {
        let inverse = [-0.055, 0.066, -0.0005, 0.0007, -0.021];
        let pinhole = [608.6, 608.6, 319.5, 239.5];
        let forward = inverted(&inverse, pinhole, [640, 480]);
        for (u, v) in [(0.0, 0.0), (639.0, 479.0), (100.0, 400.0), (320.0, 10.0)] {
            let (xd, yd) = ((u - pinhole[2]) / pinhole[0], (v - pinhole[3]) / pinhole[1]);
            let there = Distortion::brown(inverse).bend(xd, yd).0;
            let back = Distortion::brown(forward).bend(there.x, there.y).0;
            let off = (back.x - xd).hypot(back.y - yd) * pinhole[0];
            assert!(off < 0.1, "{off} pixels at {u}, {v}");
        }
        assert_eq!(inverted(&[0.0; 5], pinhole, [640, 480]), [0.0; 5]);
    }
}
