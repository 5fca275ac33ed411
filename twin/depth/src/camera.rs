//! A pinhole camera, and a picture that it has taken from a known place.

use nalgebra::Isometry3;

/// A pinhole camera. Pixels count from the upper left corner of the picture, whose first pixel has its middle at (0.5, 0.5); axes: x
/// right, y down, z forwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Focal lengths [pixel].
    pub focal: [f64; 2],
    /// Principal point [pixel].
    pub centre: [f64; 2],
}

impl Camera {
    /// The same camera with a picture of fewer pixels: `by` of them in each direction become one.
    pub(crate) fn reduced(&self, by: usize) -> Self {
        let share = 1.0 / by as f64;
        Self {
            size: self.size.map(|n| n / by),
            focal: self.focal.map(|f| f * share),
            centre: self.centre.map(|c| c * share),
        }
    }

    /// Direction of the ray through a place of the picture, as x/z and y/z.
    pub(crate) fn direction(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [(u - self.centre[0]) / self.focal[0], (v - self.centre[1]) / self.focal[1]]
    }
}

/// A picture with a known camera.
#[derive(Debug, Clone)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// The world in the camera's frame [m].
    pub camera_from_world: Isometry3<f64>,
    /// Brightness, row by row [0 to 255].
    pub grey: Vec<f32>,
    /// Pixels of which depth is wanted as finely as the picture has it, row by row; the others have that of coarser pixels. Empty: all.
    pub fine: Vec<bool>,
    /// What is seen lies between these depths along the camera's axis [m]; both above 0.
    pub range: [f64; 2],
}

/// What is known of each pixel of a view, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Depth {
    /// Along the camera's axis [m]; NaN where views do not agree on one.
    pub depth: Vec<f32>,
    /// Of the surface, of length 1, in the camera's frame, towards the camera; NaN where there is no depth.
    pub normal: Vec<[f32; 3]>,
    /// Share of the views that have the pixel's place in sight and measure it there, times the similarity of the pictures about it [0 to
    /// 1]; 0 where there is no depth.
    pub confidence: Vec<f32>,
}
