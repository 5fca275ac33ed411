//! Channels of a picture, row by row.

use super::blend::Pixels;
use crate::real::Real;
use crate::reference::TILE;

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
    #[must_use]
    pub fn zeros(size: [usize; 2]) -> Self {
        let plane = || vec![T::zero(); size[0] * size[1]];
        Self { size, channels: std::array::from_fn(|_| plane()), left: plane() }
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
