//! Depth pictures of known cameras fused into one surface: a truncated signed distance in blocks of 8³ voxels, kept only where
//! a surface is (Curless & Levoy 1996; Niessner et al. 2013), and a mesh of it (surface nets, Gibson 1998).
//!
//! A depth counts by the fourth power of its inverse: the deviation of a stereo camera's depth grows with its square.
//!
//! | file | owns |
//! |---|---|
//! | `grid` | blocks of voxels, and views going into them |
//! | `nets` | the surface between positive and negative voxels |

mod grid;
mod nets;
#[cfg(test)]
mod tests;

pub use grid::Grid;

use crate::Surface;
use splat::Camera;

/// A depth picture.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Lens, and the world in the camera's frame.
    pub camera: Camera,
    /// Columns and rows.
    pub size: [usize; 2],
    /// Distance along the optical axis [m], row by row; 0 where it is not known.
    pub depth: &'a [f32],
    /// Red, green, blue of the same pixels.
    pub rgb: Option<&'a [[u8; 3]]>,
}

/// How finely to fuse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Edge of a voxel [m].
    pub voxel: f32,
    /// Distances are kept up to so many voxels before and behind a surface.
    pub band: f32,
    /// Voxels that fewer views saw are no surface.
    pub least: u16,
    /// Depths beyond are left out [m].
    pub farthest: f32,
    /// Standard deviation of a depth of one metre, growing with the square of depth [m].
    pub spread: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { voxel: 4e-3, band: 5.0, least: 2, farthest: 3.0, spread: 0.0 }
    }
}

/// The surface that all views see.
///
/// A wall half a metre before two cameras that stand side by side:
///
/// ```
/// use fusion::fuse::{Settings, View, fuse};
/// use nalgebra::Isometry3;
/// use splat::{Camera, Distortion, Lens};
///
/// let lens = Lens { focal: [40.0; 2], centre: [15.5; 2], distortion: Distortion::NONE }; // pixels
/// let depth = vec![0.5_f32; 32 * 32]; // m along the optical axis, row by row
/// let view = |x: f64| View {
///     camera: Camera { lens, camera_from_world: Isometry3::translation(-x, 0.0, 0.0) },
///     size: [32, 32],
///     depth: &depth,
///     rgb: None,
/// };
/// let surface = fuse([view(0.0), view(0.02)], Settings { voxel: 0.01, ..Settings::default() });
/// assert!(surface.triangles.len() > 100);
/// assert!(surface.points.iter().all(|point| (point.z - 0.5).abs() < 5e-3));
/// // Outwards is towards the cameras.
/// assert!(surface.normals().iter().all(|normal| normal.z < -0.9));
/// ```
pub fn fuse<'a>(views: impl IntoIterator<Item = View<'a>>, settings: Settings) -> Surface {
    let mut grid = Grid::new(settings);
    views.into_iter().for_each(|view| grid.add(&view));
    grid.surface()
}
