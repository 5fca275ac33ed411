//! One splat in a picture: a Gaussian of the plane (elliptical weighted averaging, Zwicker et al. 2001), widened by the
//! low-pass that trained splats expect (Kerbl et al. 2023).

use super::cloud::SplatCloud;
use super::harmonics::values;
use super::lens::Lens;
use super::real::Real;
use nalgebra::{Isometry3, Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use shared_mem::lens::Distortion;

/// Splats whose centre is nearer are not drawn [m].
const NEAREST: f64 = 0.05;
/// Variance of the low-pass [pixel²].
const LOW_PASS: f64 = 0.3;
/// Light kept back by less than this is nothing: half a step of eight bits, about.
pub(super) const FAINTEST: f64 = 1.0 / 255.0;
/// The slope of the projection is taken no further outside than this many half-pictures: beyond, a straight line says
/// nothing about a picture's edge any more.
const OUTSIDE: f64 = 1.3;

/// A splat in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected<T = f64> {
    /// Column and row of its centre [pixel].
    pub centre: [T; 2],
    /// Inverse of its covariance: xx, xy, yy [1/pixel²].
    pub conic: [T; 3],
    /// Red, green, blue, 0 and above.
    pub color: [T; 3],
    /// Share of light that its centre keeps back.
    pub opacity: T,
    /// Distance of its centre along the optical axis [m].
    pub depth: T,
    /// It keeps back less than 1/255 beyond so many pixels along a row and along a column.
    pub reach: [T; 2],
}

/// A Gaussian in the frame of its body, without its colour.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gaussian<T: Real> {
    /// Centre [m].
    pub(super) centre: Vector3<T>,
    /// Quaternion w, x, y, z of any length but 0: from its own axes to the body's.
    pub(super) turn: [T; 4],
    /// One sigma along its own axes [m].
    pub(super) sigma: Vector3<T>,
    /// Share of light that its centre keeps back.
    pub(super) opacity: T,
}

/// A camera before a body.
#[derive(Debug, Clone)]
pub(super) struct View<T: Real> {
    /// Camera from body.
    pub(super) rotation: Matrix3<T>,
    translation: Vector3<T>,
    /// Where the camera stands, body frame [m].
    eye: Vector3<T>,
    pub(super) focal: [T; 2],
    pub(super) centre: [T; 2],
    pub(super) distortion: Distortion<T>,
    /// Between which ends the slope of the projection is taken.
    ends: [[T; 2]; 2],
    pub(super) size: [usize; 2],
}

/// Intermediate values of a projection, which its gradient needs again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Forward<T: Real> {
    /// The centre in the camera's frame [m].
    pub(super) at: Vector3<T>,
    /// Where in the plane z = 1 the slope is taken, and along which axes that is the centre's own place.
    pub(super) held: [T; 2],
    pub(super) is_own: [bool; 2],
    /// The lens's slope there, and that of the division by z.
    pub(super) bent: Matrix2<T>,
    pub(super) divided: Matrix2x3<T>,
    /// From the splat's own axes to the camera's.
    pub(super) axes: Matrix3<T>,
    /// The slope times those axes, and times the sigmas.
    pub(super) seen_axes: Matrix2x3<T>,
    pub(super) spread: Matrix2x3<T>,
    pub(super) covariance: Matrix2<T>,
    /// Where the centre lands [pixel].
    pub(super) pixel: Vector2<T>,
}

impl<T: Real> View<T> {
    pub(super) fn new(camera_from_body: &Isometry3<f64>, lens: &Lens, size: [usize; 2]) -> Self {
        let rotation: Matrix3<f64> = camera_from_body.rotation.to_rotation_matrix().into();
        let eye = camera_from_body.inverse_transform_point(&nalgebra::Point3::origin()).coords;
        Self {
            rotation: rotation.map(T::of),
            translation: camera_from_body.translation.vector.map(T::of),
            eye: eye.map(T::of),
            focal: lens.focal.map(T::of),
            centre: lens.centre.map(T::of),
            distortion: lens.distortion.of(),
            ends: slope_ends(lens, size).map(|ends| ends.map(T::of)),
            size,
        }
    }

    /// The splat behind this camera; `None` when it is behind the camera or too faint.
    pub(super) fn forward(&self, bell: &Gaussian<T>) -> Option<Forward<T>> {
        let at = self.rotation * bell.centre + self.translation;
        if at.z < T::of(NEAREST) || bell.opacity < T::of(FAINTEST) {
            return None;
        }
        let inverse = T::one() / at.z;
        let plane = [at.x * inverse, at.y * inverse];
        let [fx, fy] = self.focal;
        let pixel = self.distortion.bend(plane[0], plane[1]).0;
        let pixel = Vector2::new(fx * pixel.x + self.centre[0], fy * pixel.y + self.centre[1]);
        let held = [0, 1].map(|i| within(plane[i], self.ends[i]));
        let (_, bent) = self.distortion.bend(held[0], held[1]);
        let none = T::zero();
        let divided = Matrix2x3::new(inverse, none, -held[0] * inverse, none, inverse, -held[1] * inverse);
        let slope = Matrix2::new(fx, none, none, fy) * bent * divided;
        let axes = self.rotation * matrix(&unit(&bell.turn));
        let seen_axes = slope * axes;
        let spread = seen_axes * Matrix3::from_diagonal(&bell.sigma);
        let covariance = spread * spread.transpose() + Matrix2::identity() * T::of(LOW_PASS);
        let is_own = [0, 1].map(|i| held[i] == plane[i]);
        Some(Forward { at, held, is_own, bent, divided, axes, seen_axes, spread, covariance, pixel })
    }

    /// From the camera to the splat, body frame: the direction of length 1, and how far.
    pub(super) fn direction(&self, bell: &Gaussian<T>) -> ([T; 3], T) {
        let way = bell.centre - self.eye;
        let far = way.norm();
        ((way / far).into(), far)
    }

    /// The splat in the picture; `None` when it is behind the camera, beside the picture, or too faint.
    pub(super) fn project<H: Real>(
        &self,
        bell: &Gaussian<T>,
        degree: usize,
        harmonics: &[[H; 3]],
    ) -> Option<Projected<T>> {
        let Forward { at, covariance, pixel, .. } = self.forward(bell)?;
        let inverse = covariance.try_inverse()?;
        // opacity exp(-d²/2) = 1/255 on an ellipse; its extent along an axis is d times that axis's sigma.
        let far = (T::of(2.0) * (bell.opacity * T::of(1.0 / FAINTEST)).ln()).max(T::zero()).sqrt();
        let reach = [0, 1].map(|i| far * covariance[(i, i)].sqrt());
        let seen =
            (0..2).all(|i| pixel[i] + reach[i] >= T::zero() && pixel[i] - reach[i] <= T::of(self.size[i] as f64 - 1.0));
        if !seen || !reach.iter().all(|r| r.is_finite()) {
            return None;
        }
        let functions = values(degree, self.direction(bell).0);
        let mut color = [T::of(0.5); 3];
        for (value, coefficient) in functions.iter().zip(harmonics) {
            (0..3).for_each(|c| color[c] += *value * T::of(coefficient[c].wide()));
        }
        Some(Projected {
            centre: pixel.into(),
            conic: [inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 1)]],
            color: color.map(|c| c.max(T::zero())),
            opacity: bell.opacity,
            depth: at.z,
            reach,
        })
    }
}

fn within<T: Real>(value: T, [least, most]: [T; 2]) -> T {
    if value < least {
        least
    } else if value > most {
        most
    } else {
        value
    }
}

/// A quaternion of length 1.
pub(super) fn unit<T: Real>(turn: &[T; 4]) -> [T; 4] {
    let length = turn.iter().fold(T::zero(), |sum, part| sum + *part * *part).sqrt();
    turn.map(|part| part / length)
}

/// The rotation of a quaternion of length 1.
pub(super) fn matrix<T: Real>(&[w, x, y, z]: &[T; 4]) -> Matrix3<T> {
    let (one, two) = (T::one(), T::of(2.0));
    Matrix3::new(
        one - two * (y * y + z * z),
        two * (x * y - w * z),
        two * (x * z + w * y),
        two * (x * y + w * z),
        one - two * (x * x + z * z),
        two * (y * z - w * x),
        two * (x * z - w * y),
        two * (y * z + w * x),
        one - two * (x * x + y * y),
    )
}

/// The splat with this number, seen by a camera; `None` when it is behind the camera, beside the picture, or too faint.
pub fn project(
    cloud: &SplatCloud,
    number: usize,
    camera_from_body: &Isometry3<f64>,
    lens: &Lens,
    size: [usize; 2],
) -> Option<Projected> {
    project_from(cloud, number, &View::new(camera_from_body, lens, size))
}

/// The same for a view that is there already.
pub(super) fn project_from(cloud: &SplatCloud, number: usize, view: &View<f64>) -> Option<Projected> {
    let splat = cloud.splats.get(number)?;
    let turn = splat.rotation.quaternion();
    let bell = Gaussian {
        centre: splat.centre.coords.cast(),
        turn: [turn.w, turn.i, turn.j, turn.k].map(f64::from),
        sigma: splat.sigma.cast(),
        opacity: f64::from(splat.opacity),
    };
    let count = cloud.coefficients();
    view.project(&bell, cloud.degree, &cloud.harmonics[number * count..(number + 1) * count])
}

/// Between which ends the slope of the projection is taken, along a row and along a column, in the plane z = 1.
pub fn slope_ends(lens: &Lens, size: [usize; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| {
        let ends = [0.0, size[i] as f64 - 1.0].map(|edge| {
            let mut pixel = lens.centre;
            pixel[i] = edge;
            lens.ray(pixel)[i]
        });
        let spare = (OUTSIDE - 1.0) * 0.5 * (ends[1] - ends[0]);
        [ends[0] - spare, ends[1] + spare]
    })
}

impl Projected {
    /// Share of light that it keeps back at a pixel.
    pub fn alpha(&self, u: f64, v: f64) -> f64 {
        self.opacity * self.exponent(u, v).exp()
    }

    /// Logarithm of its bell at a pixel, 0 at its centre.
    pub(super) fn exponent(&self, u: f64, v: f64) -> f64 {
        let (x, y) = (u - self.centre[0], v - self.centre[1]);
        let [xx, xy, yy] = self.conic;
        -0.5 * (xx * x * x + yy * y * y) - xy * x * y
    }
}
