//! From the slope over a splat in the picture back to the slope over the splat: the steps of [`View::project`] in reverse.

use super::blend::Sums;
use super::tiles::{Drawn, normal};
use super::{COLOR_PLANE, Parameters};
use crate::harmonics::{slopes, values};
use crate::project::{Forward, Gaussian, View, unit};
use crate::real::Real;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// Slope over a splat's parameters.
pub(super) struct Back<T: Real> {
    pub(super) centre: [T; 3],
    pub(super) turn: [T; 4],
    pub(super) log_sigma: [T; 3],
    pub(super) logit: T,
}

impl<T: Real> Back<T> {
    /// From the sums over all pixels; the slope over the coefficients of its colour goes into `harmonics`.
    pub(super) fn new<const C: usize>(
        splats: &Parameters<T>,
        number: usize,
        view: &View<T>,
        drawn: &Drawn<T, C>,
        sums: &Sums<T, C>,
        harmonics: &mut [[T; 3]],
    ) -> Self {
        let none = Self { centre: [T::zero(); 3], turn: [T::zero(); 4], log_sigma: [T::zero(); 3], logit: T::zero() };
        let bell = splats.bell(number);
        let Some(forward) = view.forward(&bell) else { return none };
        let [one, x, y, xx, xy, yy] = sums.bell;
        let [kxx, kxy, kyy] = drawn.conic;
        let half = T::of(0.5);
        let pixel = Vector2::new(kxx * x + kxy * y, kxy * x + kyy * y);
        // Over the conic, each of its four numbers by itself; then over the covariance that it is the inverse of.
        let conic = Matrix2::new(-half * xx, -half * xy, -half * xy, -half * yy);
        let inverse = Matrix2::new(kxx, kxy, kxy, kyy);
        let covariance = -(inverse * conic * inverse);

        let spread = covariance * forward.spread * T::of(2.0);
        let log_sigma = [0, 1, 2].map(|k| spread.column(k).dot(&forward.seen_axes.column(k)) * bell.sigma[k]);
        let seen_axes = spread * Matrix3::from_diagonal(&bell.sigma);
        let focal = Matrix2::from_diagonal(&Vector2::from(view.focal));
        let mut axes = (focal * forward.bent * forward.divided).transpose() * seen_axes;
        // Over the centre, camera frame, from the fourth channel.
        let mut over_at = Vector3::z() * sums.values[3];
        if C == COLOR_PLANE {
            let (axis, sign) = normal(&bell.sigma, &forward.axes, &forward.at);
            over_at = forward.axes.column(axis) * (sign * sums.values[3]);
            (0..3).for_each(|i| axes[(i, axis)] += sign * (sums.values[4 + i] + sums.values[3] * forward.at[i]));
        }
        let turn = turned(&bell.turn, &(view.rotation.transpose() * axes));

        let slope = seen_axes * forward.axes.transpose();
        let at = slope_back(view, &forward, &(focal * slope)) + pixel_back(view, &forward, &(focal * pixel)) + over_at;
        let color = [sums.values[0], sums.values[1], sums.values[2]];
        let centre = view.rotation.transpose() * at + color_back(splats, number, view, &bell, drawn, color, harmonics);
        // Over the logarithm of opacity; that one's slope over the logit is the light that passes.
        Self { centre: centre.into(), turn, log_sigma, logit: one * (T::one() - bell.opacity) }
    }
}

/// Slope over a quaternion of any length, from the slope over its rotation matrix.
fn turned<T: Real>(turn: &[T; 4], g: &Matrix3<T>) -> [T; 4] {
    let length = turn.iter().fold(T::zero(), |sum, part| sum + *part * *part).sqrt();
    let own = unit(turn);
    let [w, x, y, z] = own;
    let two = T::of(2.0);
    let off = |i: usize, j: usize| g[(i, j)] - g[(j, i)];
    let sum = |i: usize, j: usize| g[(i, j)] + g[(j, i)];
    let over = [
        two * (x * off(2, 1) + y * off(0, 2) + z * off(1, 0)),
        two * (w * off(2, 1) + y * sum(0, 1) + z * sum(0, 2) - two * x * (g[(1, 1)] + g[(2, 2)])),
        two * (w * off(0, 2) + x * sum(0, 1) + z * sum(1, 2) - two * y * (g[(0, 0)] + g[(2, 2)])),
        two * (w * off(1, 0) + x * sum(0, 2) + y * sum(1, 2) - two * z * (g[(0, 0)] + g[(1, 1)])),
    ];
    // Its length changes nothing.
    let along = (0..4).fold(T::zero(), |sum, i| sum + own[i] * over[i]);
    std::array::from_fn(|i| (over[i] - own[i] * along) / length)
}

/// Over the centre, camera frame, from the slope over the projection's own slope; `focal` is multiplied in already.
fn slope_back<T: Real>(view: &View<T>, forward: &Forward<T>, g: &Matrix2x3<T>) -> Vector3<T> {
    let inverse = forward.divided[(0, 0)];
    let [x, y] = forward.held;
    let bent = g * forward.divided.transpose();
    let divided = forward.bent.transpose() * g;
    let [over_x, over_y] = view.distortion.curvature(x, y);
    let mut held = [bent.dot(&over_x) - divided[(0, 2)] * inverse, bent.dot(&over_y) - divided[(1, 2)] * inverse];
    let mut over_inverse = divided[(0, 0)] + divided[(1, 1)] - divided[(0, 2)] * x - divided[(1, 2)] * y;
    // What is held at an end does not follow the centre.
    (0..2).for_each(|i| held[i] = if forward.is_own[i] { held[i] } else { T::zero() });
    over_inverse += held[0] * forward.at.x + held[1] * forward.at.y;
    Vector3::new(held[0] * inverse, held[1] * inverse, -over_inverse * inverse * inverse)
}

/// Over the centre, camera frame, from the slope over where it lands.
fn pixel_back<T: Real>(view: &View<T>, forward: &Forward<T>, g: &Vector2<T>) -> Vector3<T> {
    let inverse = forward.divided[(0, 0)];
    let (x, y) = (forward.at.x * inverse, forward.at.y * inverse);
    let plane = view.distortion.bend(x, y).1.transpose() * g * inverse;
    Vector3::new(plane.x, plane.y, -(plane.x * x + plane.y * y))
}

/// Over the coefficients of the colour, and over the centre by the direction that it is seen from.
fn color_back<T: Real, const C: usize>(
    splats: &Parameters<T>,
    number: usize,
    view: &View<T>,
    bell: &Gaussian<T>,
    drawn: &Drawn<T, C>,
    mut color: [T; 3],
    harmonics: &mut [[T; 3]],
) -> Vector3<T> {
    // A colour that is held at 0 moves nothing.
    (0..3).for_each(|c| color[c] = if drawn.values[c] > T::zero() { color[c] } else { T::zero() });
    let (way, far) = view.direction(bell);
    let functions = values(splats.degree, way);
    for (out, value) in harmonics.iter_mut().zip(functions) {
        *out = color.map(|slope| slope * value);
    }
    if splats.degree == 0 {
        return Vector3::zeros();
    }
    let mut over = Vector3::zeros();
    for (slope, coefficient) in slopes(splats.degree, way).iter().zip(splats.colors(number)) {
        let seen = (0..3).fold(T::zero(), |sum, c| sum + coefficient[c] * color[c]);
        over += Vector3::from(*slope) * seen;
    }
    let way = Vector3::from(way);
    (over - way * way.dot(&over)) / far
}
