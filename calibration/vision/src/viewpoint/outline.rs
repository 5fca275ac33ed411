//! The outline of the robot in a picture, from geometry: edges between a triangle that faces the camera and one that
//! does not, as far as nothing hides them. Exact to the mesh, so that a fit is finer than the pixels of the z-buffer
//! that tells what is hidden.

use super::lens::Lens;
use super::shape::Part;
use nalgebra::{Isometry3, Point3, Vector3};
use twin::render::Raster;

/// One place on the outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Camera frame [m].
    pub point: Point3<f64>,
    /// Column and row in the picture [pixel].
    pub pixel: [f64; 2],
    /// Unit vector in the picture that points away from the part.
    pub outward: [f64; 2],
    /// Length of outline that it stands for [pixel].
    pub length: f64,
    /// The link it lies on.
    pub link: usize,
    /// Whether the background lies behind it, not another link.
    pub is_outer: bool,
}

/// Draws the parts and follows their outline.
#[derive(Debug)]
pub struct Outliner {
    width: usize,
    height: usize,
    lens: Lens,
    raster: Raster,
    corners: Vec<Point3<f64>>,
    facing: Vec<bool>,
}

/// Nearer than this no part is looked for [m].
const NEAREST_PART: f64 = 0.06;
/// How far beside the edge the z-buffer is asked what is there [pixel].
const BESIDE: f64 = 1.5;
const FURTHER: f64 = 4.5;
/// Surfaces that far behind the edge are another part [m].
const BEHIND: f64 = 0.03;
/// Longest piece of an edge that one place stands for [pixel].
const PIECE: f64 = 3.0;

impl Outliner {
    /// For pictures of this size.
    pub fn new(width: usize, height: usize, lens: Lens) -> Self {
        let raster = Raster::new(width, height, lens.pinhole(), -Vector3::z());
        Self { width, height, lens, raster, corners: Vec::new(), facing: Vec::new() }
    }

    /// Draws the parts: afterwards [`Self::covered`] tells where they are.
    pub fn draw(&mut self, parts: &[Part], camera_from_part: &[Isometry3<f64>]) {
        self.raster.clear([0; 3]);
        for (part, pose) in parts.iter().zip(camera_from_part) {
            self.raster.draw(&part.mesh, &pose.cast::<f32>());
        }
    }

    /// `1/z` of what was drawn, row by row [1/m]; 0 where nothing is.
    pub fn inverse_depth(&self) -> &[f32] {
        self.raster.inverse_depth()
    }

    /// Whether a pixel shows the robot, row by row.
    pub fn covered(&self) -> impl Iterator<Item = bool> + '_ {
        self.raster.inverse_depth().iter().map(|d| *d > 0.0)
    }

    /// Draws the parts and collects their outline into `out`, which is emptied first.
    pub fn outline(&mut self, parts: &[Part], camera_from_part: &[Isometry3<f64>], out: &mut Vec<Place>) {
        self.draw(parts, camera_from_part);
        out.clear();
        for (part, pose) in parts.iter().zip(camera_from_part) {
            let eye = pose.inverse_transform_point(&Point3::origin());
            let mut corners = std::mem::take(&mut self.corners);
            corners.clear();
            corners.extend(part.corners.iter().map(|p| pose * p));
            let mut facing = std::mem::take(&mut self.facing);
            facing.clear();
            facing.extend(part.planes.iter().map(|(normal, at)| normal.dot(&(eye - part.corners[*at as usize])) > 0.0));
            for edge in &part.edges {
                let third = match (facing[edge.one.0 as usize], edge.other) {
                    (true, None) => edge.one.1,
                    (true, Some(other)) if !facing[other.0 as usize] => edge.one.1,
                    (false, Some(other)) if facing[other.0 as usize] => other.1,
                    _ => continue,
                };
                let [a, b] = edge.ends.map(|i| corners[i as usize]);
                self.follow([a, b, corners[third as usize]], part.link, out);
            }
            (self.corners, self.facing) = (corners, facing);
        }
    }

    /// The visible places of one edge; `third` is the far corner of the triangle that faces the camera.
    fn follow(&self, [a, b, third]: [Point3<f64>; 3], link: usize, out: &mut Vec<Place>) {
        if a.z < NEAREST_PART || b.z < NEAREST_PART || third.z < NEAREST_PART {
            return;
        }
        let [pa, pb, pc] = [a, b, third].map(|p| self.lens.project(&p));
        let along = [pb[0] - pa[0], pb[1] - pa[1]];
        let length = along[0].hypot(along[1]);
        if length < 1e-6 {
            return;
        }
        let mut outward = [-along[1] / length, along[0] / length];
        if outward[0] * (pc[0] - pa[0]) + outward[1] * (pc[1] - pa[1]) > 0.0 {
            outward = outward.map(|v| -v);
        }
        let pieces = (length / PIECE).ceil().min(64.0);
        for k in 0..pieces as usize {
            let share = (k as f64 + 0.5) / pieces;
            let pixel = [pa[0] + share * along[0], pa[1] + share * along[1]];
            // Equal steps in the picture are no equal steps in space: 1/z is what runs evenly.
            let weight = share * a.z / (b.z + share * (a.z - b.z));
            let point = a + (b - a) * weight;
            if let Some(is_outer) = self.seen(pixel, outward, point.z) {
                out.push(Place { point, pixel, outward, length: length / pieces, link, is_outer });
            }
        }
    }

    /// `None` where the edge is hidden or no outline; else whether the background lies beside it.
    fn seen(&self, pixel: [f64; 2], outward: [f64; 2], z: f64) -> Option<bool> {
        let at = |step: f64| {
            let [u, v] = [0, 1].map(|i| (pixel[i] + step * outward[i]).round());
            let inside = u >= 0.0 && v >= 0.0 && u < self.width as f64 && v < self.height as f64;
            inside.then(|| f64::from(self.raster.inverse_depth()[v as usize * self.width + u as usize]))
        };
        let (beside, further, within) = (at(BESIDE)?, at(FURTHER)?, at(-BESIDE)?);
        let on_part = within > 0.0 && (1.0 / within - z).abs() < BEHIND;
        // Behind a letter or a screw the mesh has a hole no larger than itself: that is no outline.
        let is_outer = beside == 0.0 && further == 0.0;
        let is_inner = beside > 0.0 && 1.0 / beside > z + BEHIND;
        (on_part && (is_outer || is_inner)).then_some(is_outer)
    }
}
