//! The rays that the field learns from: every pixel of the object in the views that are not held out, and those around it.

use super::ray::{Ray, Target};
use crate::field::Grid;
use crate::scan::Frame;
use nalgebra::{Isometry3, Point3, Vector3};

/// So far around a mask background is looked at [pixel].
const RING: i16 = 10;
/// So near to a mask's border the picture may show what is behind [pixel].
const EDGE: i16 = 3;
/// Marks of a pixel.
const INSIDE: u8 = 1;
const COLOURED: u8 = 2;

/// One pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixel {
    /// Which frame it is of.
    pub(crate) frame: u16,
    marks: u8,
    rgb: [u8; 3],
    /// Direction of its ray: x/z and y/z.
    across: [f32; 2],
    /// Depth [m], 0: none.
    depth: f32,
}

/// The pixels of some frames; `frames` are their numbers.
pub(crate) fn pixels(frames: &[Frame]) -> Vec<Pixel> {
    let mut out = Vec::new();
    for (number, frame) in frames.iter().enumerate() {
        let (width, border) = (frame.camera.width as usize, frame.border_distance(RING + 1));
        for (at, steps) in border.into_iter().enumerate().filter(|(_, steps)| *steps >= -RING) {
            let pixel = [(at % width) as f64 + 0.5, (at / width) as f64 + 0.5];
            let inside = steps > 0;
            out.push(Pixel {
                frame: number as u16,
                marks: if inside { INSIDE } else { 0 } | if steps >= EDGE { COLOURED } else { 0 },
                rgb: frame.rgb[at],
                across: frame.camera.direction(pixel).map(|v| v as f32),
                depth: if inside { frame.depth.get(at).copied().unwrap_or(0.0) } else { 0.0 },
            });
        }
    }
    out
}

/// A camera's pose in steps of a grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stand {
    origin: [f32; 3],
    columns: [[f32; 3]; 3],
    per_metre: f32,
}

impl Stand {
    pub(crate) fn new(grid: &Grid, scan_from_camera: &Isometry3<f64>) -> Self {
        let turn = scan_from_camera.rotation.to_rotation_matrix();
        let column = |c: usize| -> [f32; 3] { turn.matrix().column(c).map(|v| v as f32).into() };
        let origin = grid.steps(&Point3::from(scan_from_camera.translation.vector));
        Self {
            origin: origin.coords.map(|v| v as f32).into(),
            columns: [column(0), column(1), column(2)],
            per_metre: (1.0 / grid.voxel) as f32,
        }
    }

    /// The ray of a direction x/z, y/z.
    #[inline]
    pub(crate) fn ray(&self, across: [f32; 2]) -> Ray<f32> {
        let axial = 1.0 / (across[0] * across[0] + across[1] * across[1] + 1.0).sqrt();
        let [x, y, z] = &self.columns;
        let direction = [0, 1, 2].map(|i| (x[i] * across[0] + y[i] * across[1] + z[i]) * axial);
        Ray { origin: self.origin, direction, axial }
    }

    /// The ray of a pixel and what the pixel says.
    #[inline]
    pub(crate) fn look(&self, pixel: &Pixel) -> (Ray<f32>, Target<f32>) {
        let target = Target {
            colour: (pixel.marks & COLOURED != 0).then(|| pixel.rgb.map(|c| f32::from(c) / 255.0)),
            mask: f32::from(pixel.marks & INSIDE),
            depth: (pixel.depth > 0.0).then_some(pixel.depth * self.per_metre),
        };
        (self.ray(pixel.across), target)
    }
}

/// A small change of a camera's pose: shift [m], then turn [rad] about a pivot.
pub(crate) fn corrected(pose: &Isometry3<f64>, by: &[f64; 6], pivot: &Point3<f64>) -> Isometry3<f64> {
    let (shift, turn) = (Vector3::new(by[0], by[1], by[2]), Vector3::new(by[3], by[4], by[5]));
    let turned = Isometry3::rotation_wrt_point(nalgebra::UnitQuaternion::new(turn), *pivot) * pose;
    Isometry3::from_parts((turned.translation.vector + shift).into(), turned.rotation)
}
