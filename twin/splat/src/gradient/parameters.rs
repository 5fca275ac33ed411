//! Splats as the columns that are trained, those of a 3DGS PLY: opacity as a logit, sigma as a logarithm.

use crate::cloud::{Splat, SplatCloud};
use crate::project::Gaussian;
use crate::real::Real;
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};

/// One row a splat. Also the slope of a loss over each of these numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters<T> {
    /// Centres [m].
    pub centre: Vec<[T; 3]>,
    /// Quaternions w, x, y, z from a splat's own axes to the body's, of any length but 0.
    pub turn: Vec<[T; 4]>,
    /// Natural logarithms of sigma along a splat's own axes [m].
    pub log_sigma: Vec<[T; 3]>,
    /// Opacity as ln(o / (1 - o)).
    pub logit: Vec<T>,
    /// Degree of the spherical harmonics, 0 to 3.
    pub degree: usize,
    /// Their coefficients for red, green, blue: `(degree + 1)^2` of each splat, one splat after the other.
    pub harmonics: Vec<[T; 3]>,
}

/// Kinds of numbers.
const KINDS: usize = 5;
/// The nearest that an opacity comes to 0 and 1.
const OPACITY_MARGIN: f32 = 1e-6;

impl<T: Real> Parameters<T> {
    /// All 0.
    pub fn zeros(count: usize, degree: usize) -> Self {
        let none = T::zero();
        Self {
            centre: vec![[none; 3]; count],
            turn: vec![[none; 4]; count],
            log_sigma: vec![[none; 3]; count],
            logit: vec![none; count],
            degree,
            harmonics: vec![[none; 3]; count * (degree + 1) * (degree + 1)],
        }
    }

    /// How many splats.
    pub fn len(&self) -> usize {
        self.centre.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.centre.is_empty()
    }

    /// How many coefficients each splat has.
    pub fn coefficients(&self) -> usize {
        (self.degree + 1) * (self.degree + 1)
    }

    /// All numbers of each kind, splat by splat: centres, quaternions, sigmas, opacities, colours.
    pub fn columns(&self) -> [&[T]; KINDS] {
        [
            self.centre.as_flattened(),
            self.turn.as_flattened(),
            self.log_sigma.as_flattened(),
            &self.logit,
            self.harmonics.as_flattened(),
        ]
    }

    /// The same to be changed.
    pub fn columns_mut(&mut self) -> [&mut [T]; KINDS] {
        [
            self.centre.as_flattened_mut(),
            self.turn.as_flattened_mut(),
            self.log_sigma.as_flattened_mut(),
            &mut self.logit,
            self.harmonics.as_flattened_mut(),
        ]
    }

    /// The columns of a cloud.
    pub fn of(cloud: &SplatCloud) -> Self {
        let wide = |value: f32| T::of(f64::from(value));
        let mut out = Self::zeros(cloud.splats.len(), cloud.degree);
        for (i, splat) in cloud.splats.iter().enumerate() {
            let turn = splat.rotation.quaternion();
            let opacity = splat.opacity.clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
            out.centre[i] = [splat.centre.x, splat.centre.y, splat.centre.z].map(wide);
            out.turn[i] = [turn.w, turn.i, turn.j, turn.k].map(wide);
            out.log_sigma[i] = [0, 1, 2].map(|k| wide(splat.sigma[k].max(1e-30)).ln());
            out.logit[i] = (wide(opacity) / (T::one() - wide(opacity))).ln();
        }
        out.harmonics = cloud.harmonics.iter().map(|color| color.map(wide)).collect();
        out
    }

    /// The cloud of these columns.
    pub fn cloud(&self) -> SplatCloud {
        let narrow = |value: T| value.wide() as f32;
        let splats = (0..self.len()).map(|i| {
            let [w, x, y, z] = self.turn[i].map(narrow);
            Splat {
                centre: Point3::from(self.centre[i].map(narrow)),
                rotation: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
                sigma: Vector3::from(self.log_sigma[i].map(|log| narrow(log.exp()))),
                opacity: narrow(opacity(self.logit[i])),
            }
        });
        let harmonics = self.harmonics.iter().map(|color| color.map(narrow)).collect();
        SplatCloud { splats: splats.collect(), degree: self.degree, harmonics }
    }

    /// The splat with this number.
    pub(super) fn bell(&self, number: usize) -> Gaussian<T> {
        Gaussian {
            centre: Vector3::from(self.centre[number]),
            turn: self.turn[number],
            sigma: Vector3::from(self.log_sigma[number]).map(|log| log.exp()),
            opacity: opacity(self.logit[number]),
        }
    }

    /// Its coefficients.
    pub(super) fn colors(&self, number: usize) -> &[[T; 3]] {
        let count = self.coefficients();
        &self.harmonics[number * count..(number + 1) * count]
    }
}

/// Share of light of a logit.
fn opacity<T: Real>(logit: T) -> T {
    T::one() / (T::one() + (-logit).exp())
}
