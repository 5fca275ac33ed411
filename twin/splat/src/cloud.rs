//! The splats of one body: anisotropic Gaussians with opacity and a colour that depends on the direction (Kerbl et al.
//! 2023). Body frame, metres.

use super::harmonics::{FIRST, turns};
use nalgebra::{Point3, Similarity3, UnitQuaternion, Vector3};

/// One splat, without its colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Splat {
    /// Centre [m].
    pub centre: Point3<f32>,
    /// From its own axes to the body's.
    pub rotation: UnitQuaternion<f32>,
    /// One sigma along its own axes [m].
    pub sigma: Vector3<f32>,
    /// Share of light that its centre keeps back, 0 to 1.
    pub opacity: f32,
}

/// All splats of a body.
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use splat::{Splat, SplatCloud};
///
/// let at = |x: f32| Splat {
///     centre: Point3::new(x, 0.0, 0.0),
///     rotation: UnitQuaternion::identity(),
///     sigma: Vector3::repeat(0.01),
///     opacity: 0.5,
/// };
/// let cloud = SplatCloud { splats: vec![at(0.0), at(0.1)], degree: 0, harmonics: vec![[0.0; 3]; 2] };
/// assert_eq!(cloud.colour(0), [0.5; 3]);
///
/// // As a 3DGS PLY and back.
/// let read = SplatCloud::parse(&cloud.ply())?;
/// assert_eq!(read.splats.len(), 2);
/// assert!((read.splats[1].centre.x - 0.1).abs() < 1e-6); // m
/// assert_eq!(read.only(|number| number == 1).splats.len(), 1);
/// assert!(SplatCloud::parse(b"ply\n").is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SplatCloud {
    /// The splats.
    pub splats: Vec<Splat>,
    /// Degree of the spherical harmonics, 0 to 3.
    pub degree: usize,
    /// Their coefficients for red, green, blue: `(degree + 1)^2` of each splat, one splat after the other.
    pub harmonics: Vec<[f32; 3]>,
}

impl SplatCloud {
    /// How many coefficients each splat has.
    pub fn coefficients(&self) -> usize {
        (self.degree + 1) * (self.degree + 1)
    }

    /// Mean colour of a splat over all directions: red, green, blue, 0 to 1 and, where it was trained, a little beyond.
    pub fn colour(&self, number: usize) -> [f32; 3] {
        self.harmonics[number * self.coefficients()].map(|first| 0.5 + FIRST as f32 * first)
    }

    /// The splats whose number `keep` wants.
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut part = Self { degree: self.degree, ..Self::default() };
        let colors = self.harmonics.chunks_exact(self.coefficients());
        for (number, (splat, colors)) in self.splats.iter().zip(colors).enumerate() {
            if keep(number) {
                part.splats.push(*splat);
                part.harmonics.extend_from_slice(colors);
            }
        }
        part
    }

    /// The same splats turned, shifted and grown; their colours turn with them.
    pub fn moved(&self, change: &Similarity3<f64>) -> Self {
        let (rotation, scale) = (change.isometry.rotation, change.scaling());
        let turns = turns(&rotation);
        let splats = self.splats.iter().map(|splat| Splat {
            centre: (change * splat.centre.cast::<f64>()).cast(),
            rotation: (rotation * splat.rotation.cast::<f64>()).cast(),
            sigma: splat.sigma * scale as f32,
            opacity: splat.opacity,
        });
        let mut harmonics = self.harmonics.clone();
        for (colors, before) in
            harmonics.chunks_exact_mut(self.coefficients()).zip(self.harmonics.chunks_exact(self.coefficients()))
        {
            for (degree, turn) in (1..=self.degree).zip(&turns) {
                let first = degree * degree;
                for (row, color) in colors[first..first + 2 * degree + 1].iter_mut().enumerate() {
                    *color = [0, 1, 2].map(|c| {
                        (0..2 * degree + 1).map(|k| turn[(row, k)] * f64::from(before[first + k][c])).sum::<f64>()
                            as f32
                    });
                }
            }
        }
        Self { splats: splats.collect(), degree: self.degree, harmonics }
    }

    /// Of each splat whether all its values are finite numbers.
    pub(super) fn finite(&self) -> Vec<bool> {
        let colours = self.harmonics.chunks_exact(self.coefficients());
        let finite = |(splat, colour): (&Splat, &[[f32; 3]])| {
            let place = splat.centre.coords.iter().chain(splat.sigma.iter()).chain(splat.rotation.coords.iter());
            place.chain([&splat.opacity]).chain(colour.iter().flatten()).all(|value| value.is_finite())
        };
        self.splats.iter().zip(colours).map(finite).collect()
    }
}
