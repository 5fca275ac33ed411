//! The splats of one body: anisotropic Gaussians with opacity and a colour that depends on the direction (Kerbl et al.
//! 2023). Body frame, metres.

use super::harmonics::turns;
use super::{compressed, ply};
use nalgebra::{Point3, Similarity3, UnitQuaternion, Vector3};
use shared_mem::input::{self, InputError};
use shared_mem::output::{self, Output, OutputError};
use std::io::Write as _;
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
    /// Missing, no file, or too large.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A folder that cannot be listed.
    #[error("cannot list the splats in {}: {source}; give the path of a folder", path.display())]
    Folder {
        /// The folder.
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
    /// A folder of a robot's splats without any.
    #[error("{} holds no splats of links: name them like `link3.ply`", folder.display())]
    NoLinks {
        /// The folder.
        folder: PathBuf,
    },
}

impl SplatCloud {
    /// Reads a PLY file of either kind.
    ///
    /// # Errors
    /// [`SplatError`] when it is missing, cut short, holds values that are no numbers, or is another kind of file.
    pub fn read(path: &Path) -> Result<Self, SplatError> {
        let bytes = input::bytes(path, input::Kind::Splats)?;
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

    /// The splats whose number `keep` wants.
    #[must_use]
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
    #[must_use]
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

    /// A 3DGS PLY.
    #[must_use]
    pub fn ply(&self) -> Vec<u8> {
        ply::write(self)
    }

    /// Writes the file `path` as a 3DGS PLY.
    ///
    /// # Errors
    /// [`OutputError`] where it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        output::write(path, self.ply())
    }

    /// Writes a 3DGS PLY into an output, which the caller finishes.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_to(&self, output: &mut Output) -> Result<(), OutputError> {
        output.write_all(&self.ply()).map_err(|error| OutputError::of(output.path(), error))
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
