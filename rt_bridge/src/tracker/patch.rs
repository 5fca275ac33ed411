//! The part of a picture around the object: what was measured there, what lies behind, and the object as it would be
//! drawn in a pose.

use super::arm::ArmBody;
use super::colors::{self, Bin, NO_COLOR};
use super::model::Model;
use super::table::Table;
use super::view::{Frame, View};
use nalgebra::{Isometry3, Vector3};
use shared_mem::msg::Joints;
use twin::render::{Pinhole, Raster};

/// Around the object [pixel]: as far as a contour is looked for, and what it may have moved.
const BORDER: f64 = 26.0;
/// Around the robot's outline [pixel].
const SEAM: usize = 2;

/// A rectangle of the picture.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Its upper left corner in the picture [pixel].
    corner: [usize; 2],
    pinhole: Pinhole,
    /// Inverse depth measured, corrected by the table's [1/m]; 0: nothing.
    pub(super) seen: Vec<f32>,
    /// Inverse depth of the robot's outline, a little widened [1/m]; 0: not here.
    pub(super) arm: Vec<f32>,
    pub(super) bins: Vec<Bin>,
    object: Raster,
}

impl Patch {
    /// Around a sphere at `centre` (camera frame); `None` where it is out of the picture.
    pub(super) fn around(
        view: &View,
        table: &Table,
        frame: &Frame,
        arm: Option<(&ArmBody, &Joints)>,
        centre: &Vector3<f64>,
        radius: f64,
    ) -> Option<Self> {
        if centre.z < 2.0 * radius {
            return None;
        }
        let [u, v] = view.pixel(centre);
        let reach = f64::from(view.pinhole.fx.max(view.pinhole.fy)) * radius / (centre.z - radius) + BORDER;
        let range = |at: f64, size: usize| {
            let from = (at - reach).floor().max(0.0) as usize;
            let to = ((at + reach).ceil().max(0.0) as usize).min(size);
            (to > from + 16).then_some((from, to - from))
        };
        let ((x, width), (y, height)) = (range(u, view.width)?, range(v, view.height)?);
        let Pinhole { fx, fy, cx, cy } = view.pinhole;
        let pinhole = Pinhole { fx, fy, cx: cx - x as f32, cy: cy - y as f32 };
        let mut raster = Raster::new(width, height, pinhole, -Vector3::z());
        let pixels = || (y..y + height).flat_map(|v| (x..x + width).map(move |u| (u, v)));
        let seen = pixels()
            .map(|(u, v)| table.corrected(&view.ray(u as f32, v as f32), frame.inverse_depth(view, u, v)))
            .collect();
        let bins = pixels().map(|(u, v)| frame.color(view, u, v).map_or(NO_COLOR, colors::bin)).collect();
        let arm = match arm {
            None => vec![0.0; width * height],
            Some((body, q)) => {
                raster.clear([0; 3]);
                body.draw(&mut raster, &view.base_from_camera.inverse(), q);
                widened(raster.inverse_depth(), width, SEAM)
            }
        };
        Some(Self { width, height, corner: [x, y], pinhole, seen, arm, bins, object: raster })
    }

    /// Draws the object as it would look in a pose.
    pub(super) fn draw(&mut self, model: &Model, camera_from_object: &Isometry3<f64>) {
        self.object.clear([0; 3]);
        self.object.draw(&model.mesh, &camera_from_object.cast::<f32>());
    }

    /// Inverse depth of the drawn object [1/m]; 0 beside it.
    #[inline]
    pub(super) fn drawn(&self) -> &[f32] {
        self.object.inverse_depth()
    }

    /// The ray through a pixel, of depth 1.
    #[inline]
    pub(super) fn ray(&self, u: usize, v: usize) -> Vector3<f32> {
        let Pinhole { fx, fy, cx, cy } = self.pinhole;
        Vector3::new((u as f32 - cx) / fx, (v as f32 - cy) / fy, 1.0)
    }

    /// Focal lengths [pixel].
    pub(super) fn focal(&self) -> [f32; 2] {
        [self.pinhole.fx, self.pinhole.fy]
    }

    /// Where a pixel of the whole picture lies here.
    pub(super) fn local(&self, u: usize, v: usize) -> Option<usize> {
        let (u, v) = (u.checked_sub(self.corner[0])?, v.checked_sub(self.corner[1])?);
        (u < self.width && v < self.height).then_some(v * self.width + u)
    }

    /// The inverse depth of what lies behind the object: the table, or the robot in front of it.
    #[inline]
    pub(super) fn behind(&self, table: &Table, u: usize, v: usize) -> f32 {
        table.inverse_depth(&self.ray(u, v)).max(self.arm[v * self.width + u])
    }
}

/// The largest value among each pixel's neighbours up to `by` away along rows and columns.
pub(super) fn widened(values: &[f32], width: usize, by: usize) -> Vec<f32> {
    let height = values.len() / width;
    let mut along_rows = vec![0.0; values.len()];
    for (row, out) in values.chunks_exact(width).zip(along_rows.chunks_exact_mut(width)) {
        for (u, out) in out.iter_mut().enumerate() {
            let near = &row[u.saturating_sub(by)..(u + by + 1).min(width)];
            *out = near.iter().copied().fold(0.0, f32::max);
        }
    }
    let mut out = along_rows.clone();
    for v in 0..height {
        for other in v.saturating_sub(by)..(v + by + 1).min(height) {
            for u in 0..width {
                out[v * width + u] = out[v * width + u].max(along_rows[other * width + u]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pixel_widens_to_a_square() {
        let mut values = vec![0.0; 7 * 6];
        values[3 * 7 + 4] = 2.0;
        let wide = widened(&values, 7, 2);
        assert_eq!(wide.iter().filter(|v| **v == 2.0).count(), 25);
        assert_eq!((wide[7 + 2], wide[7 + 1], wide[5 * 7 + 6]), (2.0, 0.0, 2.0));
    }
}
