//! Colour by direction: real spherical harmonics to degree 3, with the signs that 3DGS files are written for.

use super::real::Real;
use nalgebra::{DMatrix, UnitQuaternion, Vector3};

/// The constant function.
pub(super) const FIRST: f64 = 0.282_094_791_773_878_14;

/// Constants of the degrees 1 to 3.
const ONE: f64 = 0.488_602_511_902_919_9;
const TWO: [f64; 3] = [1.092_548_430_592_079_2, 0.315_391_565_252_520_05, 0.546_274_215_296_039_6];
const THREE: [f64; 5] = [
    0.590_043_589_926_643_5,
    2.890_611_442_640_554,
    0.457_045_799_464_465_8,
    0.373_176_332_590_115_4,
    1.445_305_721_320_277,
];

/// Values of the `(degree + 1)^2` functions in a direction of length 1; beyond them 0.
pub(super) fn values<T: Real>(degree: usize, [x, y, z]: [T; 3]) -> [T; 16] {
    let mut out = [T::zero(); 16];
    out[0] = T::of(FIRST);
    if degree >= 1 {
        let c = T::of(ONE);
        out[1..4].copy_from_slice(&[-c * y, c * z, -c * x]);
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let [two, three, four] = [2.0, 3.0, 4.0].map(T::of);
    if degree >= 2 {
        let [a, b, c] = TWO.map(T::of);
        out[4..9].copy_from_slice(&[a * x * y, -a * y * z, b * (two * zz - xx - yy), -a * x * z, c * (xx - yy)]);
    }
    if degree >= 3 {
        let [a, b, c, d, e] = THREE.map(T::of);
        out[9..16].copy_from_slice(&[
            -a * y * (three * xx - yy),
            b * x * y * z,
            -c * y * (four * zz - xx - yy),
            d * z * (two * zz - three * xx - three * yy),
            -c * x * (four * zz - xx - yy),
            e * z * (xx - yy),
            -a * x * (xx - three * yy),
        ]);
    }
    out
}

/// How the functions change with x, y and z, each taken by itself.
pub(super) fn slopes<T: Real>(degree: usize, [x, y, z]: [T; 3]) -> [[T; 3]; 16] {
    let mut out = [[T::zero(); 3]; 16];
    let none = T::zero();
    if degree >= 1 {
        let c = T::of(ONE);
        out[1..4].copy_from_slice(&[[none, -c, none], [none, none, c], [-c, none, none]]);
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let [two, three, four, six, eight] = [2.0, 3.0, 4.0, 6.0, 8.0].map(T::of);
    if degree >= 2 {
        let [a, b, c] = TWO.map(T::of);
        out[4..9].copy_from_slice(&[
            [a * y, a * x, none],
            [none, -a * z, -a * y],
            [-two * b * x, -two * b * y, four * b * z],
            [-a * z, none, -a * x],
            [two * c * x, -two * c * y, none],
        ]);
    }
    if degree >= 3 {
        let [a, b, c, d, e] = THREE.map(T::of);
        out[9..16].copy_from_slice(&[
            [-six * a * x * y, -three * a * (xx - yy), none],
            [b * y * z, b * x * z, b * x * y],
            [two * c * x * y, -c * (four * zz - xx - three * yy), -eight * c * y * z],
            [-six * d * x * z, -six * d * y * z, d * (six * zz - three * xx - three * yy)],
            [-c * (four * zz - three * xx - yy), two * c * x * y, -eight * c * x * z],
            [two * e * x * z, -two * e * y * z, e * (xx - yy)],
            [-three * a * (xx - yy), six * a * x * y, none],
        ]);
    }
    out
}

/// How coefficients change when what they colour is turned: for every degree a matrix over its own functions, so that the
/// turned splat shows in a turned direction what it showed before.
pub(super) fn turns(rotation: &UnitQuaternion<f64>) -> [DMatrix<f64>; 3] {
    // The functions of one degree turn into each other: what they become follows from their values in enough directions.
    let directions: Vec<Vector3<f64>> = (0..DIRECTIONS)
        .map(|i| {
            let z: f64 = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(DIRECTIONS);
            let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vector3::new(r * cos, r * sin, z)
        })
        .collect();
    let back = rotation.inverse();
    [1usize, 2, 3].map(|degree| {
        let table = |turned: bool| {
            DMatrix::from_fn(directions.len(), 2 * degree + 1, |row, column| {
                let way = if turned { back * directions[row] } else { directions[row] };
                values(degree, way.into())[degree * degree + column]
            })
        };
        let (plain, turned) = (table(false), table(true));
        let square = plain.transpose() * &plain;
        square.cholesky().map_or_else(
            || DMatrix::identity(2 * degree + 1, 2 * degree + 1),
            |square| square.solve(&(plain.transpose() * turned)),
        )
    })
}

/// Enough to tell the seven functions of degree 3 apart many times over.
const DIRECTIONS: u32 = 64;

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

    #[test]
    fn slopes_are_difference_quotients() {
        let at = [0.48, -0.6, 0.64];
        let slopes = slopes(3, at);
        for axis in 0..3 {
            let moved = |by: f64| {
                let mut there = at;
                there[axis] += by;
                values(3, there)
            };
            let (after, before) = (moved(1e-6), moved(-1e-6));
            for k in 0..16 {
                let quotient = (after[k] - before[k]) / 2e-6;
                assert!((quotient - slopes[k][axis]).abs() < 1e-8, "{k} {axis}: {quotient} {}", slopes[k][axis]);
            }
        }
    }

    #[test]
    fn turned_coefficients_show_in_a_turned_direction_what_they_showed_before() {
        let rotation = UnitQuaternion::from_euler_angles(0.7, -1.1, 2.3);
        let turns = turns(&rotation);
        let before: Vec<f64> = (0..16).map(|k| (f64::from(k) * 1.7).sin()).collect();
        let mut after = before.clone();
        for (degree, turn) in (1..).zip(&turns) {
            for row in 0..2 * degree + 1 {
                after[degree * degree + row] =
                    (0..2 * degree + 1).map(|k| turn[(row, k)] * before[degree * degree + k]).sum();
            }
        }
        let shown = |coefficients: &[f64], way: Vector3<f64>| -> f64 {
            values(3, way.into()).iter().zip(coefficients).map(|(a, b)| a * b).sum()
        };
        for way in [Vector3::new(0.6, 0.0, 0.8), Vector3::new(-0.36, 0.48, -0.8), Vector3::y()] {
            assert!((shown(&before, way) - shown(&after, rotation * way)).abs() < 1e-12);
        }
    }
}
