//! One splat in a picture: a Gaussian of the plane (elliptical weighted averaging, Zwicker et al. 2001), widened by the
//! low-pass that trained splats expect (Kerbl et al. 2023).

use super::cloud::SplatCloud;
use super::harmonics::values;
use super::lens::Lens;
use nalgebra::{Isometry3, Matrix2, Matrix3};

/// Splats whose centre is nearer are not drawn [m].
const NEAR: f64 = 0.05;
/// Variance of the low-pass [pixel²].
const LOW_PASS: f64 = 0.3;
/// Light kept back by less than this is nothing: half a step of eight bits, about.
pub(super) const FAINTEST: f64 = 1.0 / 255.0;
/// The slope of the projection is taken no further outside than this many half-pictures: beyond, a straight line says
/// nothing about a picture's edge any more.
const OUTSIDE: f64 = 1.3;

/// A splat in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected {
    /// Column and row of its centre [pixel].
    pub centre: [f64; 2],
    /// Inverse of its covariance: xx, xy, yy [1/pixel²].
    pub conic: [f64; 3],
    /// Red, green, blue, 0 and above.
    pub color: [f64; 3],
    /// Share of light that its centre keeps back.
    pub opacity: f64,
    /// Distance of its centre along the optical axis [m].
    pub depth: f64,
    /// It keeps back less than 1/255 beyond so many pixels along a row and along a column.
    pub reach: [f64; 2],
}

/// The splat with this number, seen by a camera; `None` when it is behind the camera, beside the picture, or too faint.
#[must_use]
pub fn project(
    cloud: &SplatCloud,
    number: usize,
    camera_from_body: &Isometry3<f64>,
    lens: &Lens,
    size: [usize; 2],
) -> Option<Projected> {
    let splat = cloud.splats.get(number)?;
    let centre = camera_from_body * splat.centre.cast::<f64>();
    let opacity = f64::from(splat.opacity);
    if centre.z < NEAR || opacity < FAINTEST {
        return None;
    }
    let (pixel, _) = lens.project(&centre);
    let mut held_at = centre;
    for (i, [least, most]) in slope_ends(lens, size).into_iter().enumerate() {
        held_at[i] = (centre[i] / centre.z).clamp(least, most) * centre.z;
    }
    let (_, slope) = lens.project(&held_at);
    let axes: Matrix3<f64> = (camera_from_body.rotation * splat.rotation.cast::<f64>()).to_rotation_matrix().into();
    let spread = axes * Matrix3::from_diagonal(&splat.sigma.cast::<f64>());
    let in_plane = slope * spread;
    let covariance: Matrix2<f64> = in_plane * in_plane.transpose() + Matrix2::identity() * LOW_PASS;
    let inverse = covariance.try_inverse()?;
    // opacity exp(-d²/2) = 1/255 on an ellipse; its extent along an axis is d times that axis's sigma.
    let far = (2.0 * (opacity / FAINTEST).ln()).max(0.0).sqrt();
    let reach = [0, 1].map(|i| far * covariance[(i, i)].sqrt());
    let seen = (0..2).all(|i| pixel[i] + reach[i] >= 0.0 && pixel[i] - reach[i] <= size[i] as f64 - 1.0);
    if !seen || !reach.iter().all(|r| r.is_finite()) {
        return None;
    }
    let eye = camera_from_body.inverse_transform_point(&nalgebra::Point3::origin());
    let way = splat.centre.cast::<f64>() - eye;
    let functions = values(cloud.degree, (way / way.norm()).into());
    let count = cloud.coefficients();
    let mut color = [0.5; 3];
    for (value, coefficient) in functions.iter().zip(&cloud.harmonics[number * count..(number + 1) * count]) {
        (0..3).for_each(|c| color[c] += value * f64::from(coefficient[c]));
    }
    Some(Projected {
        centre: pixel,
        conic: [inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 1)]],
        color: color.map(|c| c.max(0.0)),
        opacity,
        depth: centre.z,
        reach,
    })
}

/// Between which ends the slope of the projection is taken, along a row and along a column, in the plane z = 1.
#[must_use]
pub fn slope_ends(lens: &Lens, size: [usize; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| {
        let ends = [-lens.centre[i], size[i] as f64 - 1.0 - lens.centre[i]].map(|end| end / lens.focal[i]);
        let spare = (OUTSIDE - 1.0) * 0.5 * (ends[1] - ends[0]);
        [ends[0] - spare, ends[1] + spare]
    })
}

impl Projected {
    /// Share of light that it keeps back at a pixel.
    #[must_use]
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
