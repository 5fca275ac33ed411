//! The field as a camera sees it: whole pictures.

use super::band::Band;
use super::pool::Stand;
use super::ray::{Medium, Sight, Tracer, reach};
use crate::field::Field;
use crate::scan::Camera;
use nalgebra::Isometry3;
use rayon::prelude::*;

/// Distance of samples of a picture [voxel].
const PACE: f32 = 0.35;
/// Steepness of the surface [1/voxel].
const STEEPNESS: f32 = 8.0;

/// A drawn picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Red, green, blue; black where nothing is seen.
    pub rgb: Vec<[u8; 3]>,
    /// Opacity, 0 to 1.
    pub opacity: Vec<f32>,
    /// Depth along the camera's axis [m], 0 where nothing is seen.
    pub depth: Vec<f32>,
}

/// Draws the field from a pose in the scan's frame.
pub fn draw(field: &Field<f32>, camera: &Camera, scan_from_camera: &Isometry3<f64>) -> Drawn {
    let grid = &field.grid;
    let band = Band::new(grid, &field.distance, reach(STEEPNESS));
    let medium = Medium {
        grid,
        band: &band,
        distance: &field.distance,
        colour: &field.colour,
        steepness: STEEPNESS,
        pace: PACE,
    };
    let stand = Stand::new(grid, scan_from_camera);
    let row = |row: u32| {
        let mut tracer = Tracer::new();
        let pixel = |column: u32| {
            let across = camera.direction([f64::from(column) + 0.5, f64::from(row) + 0.5]);
            tracer.see(&medium, &stand.ray(across.map(|v| v as f32)), 0.5)
        };
        (0..camera.width).map(pixel).collect::<Vec<Sight<f32>>>()
    };
    let sights: Vec<Sight<f32>> = (0..camera.height).into_par_iter().flat_map_iter(row).collect();
    Drawn {
        rgb: sights.iter().map(|s| s.colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)).collect(),
        opacity: sights.iter().map(|s| s.opacity).collect(),
        depth: sights.iter().map(|s| s.depth * grid.voxel as f32).collect(),
    }
}
