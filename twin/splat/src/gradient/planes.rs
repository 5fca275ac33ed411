//! Channels of a picture, row by row.

use super::COLOR_PLANE;
use super::blend::Pixels;
use crate::real::Real;
use crate::reference::TILE;
use nalgebra::Vector3;

/// Light kept back from which on a pixel has a depth.
const HALF: f64 = 0.5;
/// A plane that is seen with less than this cosine has none.
const GRAZING: f64 = 0.05;

/// A picture of `C` channels; also the slope of a loss over each of its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Planes<T, const C: usize> {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Sums of the splats' values, each times the light that it keeps back; no background.
    pub channels: [Vec<T>; C],
    /// Light that is left behind all splats, 0 to 1.
    pub left: Vec<T>,
}

impl<T: Real, const C: usize> Planes<T, C> {
    /// All 0.
    pub fn zeros(size: [usize; 2]) -> Self {
        let plane = || vec![T::zero(); size[0] * size[1]];
        Self { size, channels: std::array::from_fn(|_| plane()), left: plane() }
    }

    /// Depth of each pixel [m], 0 where less than half of the light is kept back or a plane is seen from its edge. Of centres it is the
    /// mean; of planes it is where the pixel's ray meets the mean plane. `cover`: the light kept back, 1 - `left`; `rays`: the direction of
    /// each pixel with z = 1, only for planes.
    pub fn depth(&self, cover: &[T], rays: &[Vector3<T>]) -> Vec<T> {
        let one = |at: usize| {
            let (sum, cover) = (self.channels[3][at], cover[at]);
            if cover <= T::of(HALF) {
                return T::zero();
            }
            if C < COLOR_PLANE {
                return sum / cover;
            }
            let along = self.normal(at).dot(&rays[at]);
            if along > -T::of(GRAZING) * cover { T::zero() } else { (sum / along).max(T::zero()) }
        };
        (0..self.left.len()).map(one).collect()
    }

    /// From the slope `over` a pixel's depth of planes to that over this picture's values, which are put into `slope`.
    pub(crate) fn depth_back(&self, at: usize, depth: T, over: T, ray: &Vector3<T>, slope: &mut Self) {
        let share = over / self.normal(at).dot(ray);
        slope.channels[3][at] = share;
        (0..3).for_each(|i| slope.channels[4 + i][at] -= share * depth * ray[i]);
    }

    /// Sum of the planes' normals at a pixel.
    pub(crate) fn normal(&self, at: usize) -> Vector3<T> {
        Vector3::new(self.channels[4][at], self.channels[5][at], self.channels[6][at])
    }

    pub(super) fn gather(tiles: &[Pixels<T, C>], size: [usize; 2]) -> Self {
        let mut out = Self::zeros(size);
        let across = size[0].div_ceil(TILE);
        for (number, tile) in tiles.iter().enumerate() {
            let first = [number % across * TILE, number / across * TILE];
            let columns = TILE.min(size[0] - first[0]);
            for row in 0..TILE.min(size[1] - first[1]) {
                let at = (first[1] + row) * size[0] + first[0];
                for column in 0..columns {
                    out.left[at + column] = tile.left(row, column);
                    (0..C).for_each(|c| out.channels[c][at + column] = tile.channel(c, row, column));
                }
            }
        }
        out
    }
}
