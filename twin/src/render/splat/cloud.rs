//! The splats of one body: anisotropic Gaussians with opacity and a colour that depends on the direction (Kerbl et al.
//! 2023). Body frame, metres.

use super::{compressed, ply};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};

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
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SplatCloud {
    /// The splats.
    pub splats: Vec<Splat>,
    /// Degree of the spherical harmonics, 0 to 3.
    pub degree: usize,
    /// Their coefficients for red, green, blue: `(degree + 1)^2` of each splat, one splat after the other.
    pub harmonics: Vec<[f32; 3]>,
}

/// A splat file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SplatError {
    /// Missing or unreadable.
    #[error("cannot read the splats {}: {source}; check the path", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not what its name says.
    #[error("{}: {what}; export it again as a 3DGS PLY or a SuperSplat compressed PLY", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

impl SplatCloud {
    /// Reads a PLY file of either kind.
    ///
    /// # Errors
    /// [`SplatError`] when it is missing, cut short, holds values that are no numbers, or is another kind of file.
    pub fn read(path: &Path) -> Result<Self, SplatError> {
        let bytes = std::fs::read(path).map_err(|source| SplatError::Read { path: path.to_owned(), source })?;
        Self::parse(&bytes).map_err(|what| SplatError::Content { path: path.to_owned(), what })
    }

    /// The same from a file's bytes.
    ///
    /// # Errors
    /// A sentence that says what is wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let header = ply::Header::parse(bytes)?;
        let cloud = if header.element("chunk").is_some() {
            compressed::read(&header, bytes)?
        } else {
            ply::read(&header, bytes)?
        };
        cloud.check()?;
        Ok(cloud)
    }

    /// How many coefficients each splat has.
    #[must_use]
    pub fn coefficients(&self) -> usize {
        (self.degree + 1) * (self.degree + 1)
    }

    fn check(&self) -> Result<(), String> {
        let bad =
            self.splats.iter().zip(self.harmonics.chunks_exact(self.coefficients())).position(|(splat, colour)| {
                let place = splat.centre.coords.iter().chain(splat.sigma.iter()).chain(splat.rotation.coords.iter());
                !place.chain([&splat.opacity]).chain(colour.iter().flatten()).all(|value| value.is_finite())
            });
        match bad {
            Some(number) => {
                Err(format!("splat {number} of {} holds a value that is no finite number", self.splats.len()))
            }
            None => Ok(()),
        }
    }
}
