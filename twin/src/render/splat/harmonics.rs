//! Colour by direction: real spherical harmonics to degree 3, with the signs that 3DGS files are written for.

/// The constant function.
pub(super) const FIRST: f64 = 0.282_094_791_773_878_14;

/// Values of the `(degree + 1)^2` functions in a direction of length 1; beyond them 0.
pub(super) fn values(degree: usize, [x, y, z]: [f64; 3]) -> [f64; 16] {
    let mut out = [0.0; 16];
    out[0] = FIRST;
    if degree >= 1 {
        let c = 0.488_602_511_902_919_9;
        out[1..4].copy_from_slice(&[-c * y, c * z, -c * x]);
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= 2 {
        let (a, b, c) = (1.092_548_430_592_079_2, 0.315_391_565_252_520_05, 0.546_274_215_296_039_6);
        out[4..9].copy_from_slice(&[a * x * y, -a * y * z, b * (2.0 * zz - xx - yy), -a * x * z, c * (xx - yy)]);
    }
    if degree >= 3 {
        let (a, b, c) = (0.590_043_589_926_643_5, 2.890_611_442_640_554, 0.457_045_799_464_465_8);
        let (d, e) = (0.373_176_332_590_115_4, 1.445_305_721_320_277);
        out[9..16].copy_from_slice(&[
            -a * y * (3.0 * xx - yy),
            b * x * y * z,
            -c * y * (4.0 * zz - xx - yy),
            d * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
            -c * x * (4.0 * zz - xx - yy),
            e * z * (xx - yy),
            -a * x * (xx - 3.0 * yy),
        ]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_functions_are_orthonormal_on_the_sphere() {
        // Fibonacci points: a quadrature of the sphere that is even enough for degree 6.
        let count = 20_000;
        let mut products = [[0.0; 16]; 16];
        for i in 0..count {
            let z: f64 = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let around = f64::from(i) * 2.399_963_229_728_653;
            let r = (1.0 - z * z).sqrt();
            let at = values(3, [r * around.cos(), r * around.sin(), z]);
            for (row, a) in products.iter_mut().zip(at) {
                for (product, b) in row.iter_mut().zip(at) {
                    *product += a * b * 4.0 * std::f64::consts::PI / f64::from(count);
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-3, "{i} {j}: {product}");
            }
        }
    }
}
