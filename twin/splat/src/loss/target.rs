//! What a picture is held against.

use crate::lens::Lens;
use crate::real::Real;
use nalgebra::Vector3;

/// Pixels around a difference that the window of the similarity still sees, and as many again.
const MARGIN: usize = 10;

/// A photograph in planes, row by row.
#[derive(Debug, Clone)]
pub struct Target<T> {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Red, green, blue, 0 to 1, over the background where the mask says that the photograph shows something else.
    pub color: [Vec<T>; 3],
    /// What lies behind all splats: red, green, blue.
    pub background: [T; 3],
    /// Share of each pixel that is to be covered; empty where nothing is known of it.
    pub mask: Vec<T>,
    /// Distance along the optical axis [m], 0 where it is not known; empty where there is none at all.
    pub depth: Vec<T>,
    /// The direction that each pixel sees, with z = 1; empty unless normals are compared.
    pub rays: Vec<Vector3<T>>,
}

impl<T: Real> Target<T> {
    /// The direction of every pixel of a picture behind a lens.
    pub fn rays(lens: &Lens, size: [usize; 2]) -> Vec<Vector3<T>> {
        let ray = |i: usize| lens.ray([(i % size[0]) as f64, (i / size[0]) as f64]).map(T::of);
        (0..size[0] * size[1]).map(ray).collect()
    }

    /// The part of the picture in which it differs from `shown`, and a margin.
    pub(super) fn window(&self, shown: &[Vec<T>; 3]) -> Window {
        let [width, height] = self.size;
        let (mut low, mut high) = ([width, height], [0, 0]);
        for y in 0..height {
            let row = y * width..(y + 1) * width;
            let differs = |x: &usize| (0..3).any(|c| shown[c][row.start + x] != self.color[c][row.start + x]);
            let Some(first) = (0..width).find(differs) else { continue };
            let last = (first..width).rev().find(differs).unwrap_or(first);
            low = [low[0].min(first), low[1].min(y)];
            high = [high[0].max(last + 1), y + 1];
        }
        let low = [0, 1].map(|i| low[i].min(high[i]).saturating_sub(MARGIN));
        let high = [0, 1].map(|i| (high[i] + MARGIN).min(self.size[i]));
        Window { low, high, width }
    }
}

/// A rectangle of a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    low: [usize; 2],
    high: [usize; 2],
    /// Of the picture.
    width: usize,
}

impl Window {
    pub(super) fn size(&self) -> [usize; 2] {
        [0, 1].map(|i| self.high[i] - self.low[i])
    }

    pub(super) fn cut<T: Real>(&self, plane: &[T]) -> Vec<T> {
        let columns = self.low[0]..self.high[0];
        (self.low[1]..self.high[1]).flat_map(|y| plane[y * self.width..][columns.clone()].iter().copied()).collect()
    }

    pub(super) fn put<T: Real>(&self, part: &[T], plane: &mut [T]) {
        let columns = self.low[0]..self.high[0];
        for (y, row) in (self.low[1]..self.high[1]).zip(part.chunks_exact(columns.len().max(1))) {
            plane[y * self.width..][columns.clone()].copy_from_slice(row);
        }
    }
}
