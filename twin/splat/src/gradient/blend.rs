//! The pixels of a tile: splats blended front to back, and the way back, front to back as well. What a splat does to a pixel is
//! what it adds there less what it takes of all that is added behind it; the sum of that is known at the end of the way
//! forward, and shrinks splat by splat.
//!
//! Pixels are taken eight of a row at a time, without branches, so that the compiler makes vector instructions of them.

#![allow(
    clippy::needless_range_loop,
    reason = "one number for several arrays side by side becomes vector instructions"
)]

use super::Planes;
use super::tiles::Drawn;
use crate::project::FAINTEST;
use crate::real::Real;
use crate::reference::{MAX_ALPHA, SPENT, TILE};

/// Pixels that are taken together.
const LANES: usize = 8;
const HALVES: usize = TILE / LANES;
/// After so many splats it is asked whether any light is left.
const EVERY: usize = 16;

/// Eight pixels of a row.
#[derive(Debug, Clone, Copy)]
struct Lanes<T, const C: usize> {
    left: [T; LANES],
    channels: [[T; LANES]; C],
}

/// A tile's pixels.
#[derive(Debug)]
pub(super) struct Pixels<T, const C: usize> {
    rows: [[Lanes<T, C>; TILE]; HALVES],
    /// So many splats of its list were blended before its light was spent.
    blended: usize,
}

/// What a splat's slope is summed up from, over the pixels of a tile or of all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sums<T, const C: usize> {
    /// Slope over the logarithm of what it keeps back, times 1, x, y, x², x y, y² of the way from its centre.
    pub(super) bell: [T; 6],
    /// Slope over its channels.
    pub(super) values: [T; C],
}

impl<T: Real, const C: usize> Default for Sums<T, C> {
    fn default() -> Self {
        Self { bell: [T::zero(); 6], values: [T::zero(); C] }
    }
}

impl<T: Real, const C: usize> Sums<T, C> {
    pub(super) fn add(&mut self, other: &Self) {
        (0..6).for_each(|i| self.bell[i] += other.bell[i]);
        (0..C).for_each(|i| self.values[i] += other.values[i]);
    }
}

/// Where a tile begins, and how many of its columns and rows lie in the picture.
fn place(tile: usize, size: [usize; 2]) -> ([usize; 2], [usize; 2]) {
    let across = size[0].div_ceil(TILE);
    let first = [tile % across * TILE, tile / across * TILE];
    (first, [0, 1].map(|i| TILE.min(size[i] - first[i])))
}

/// Rows and halves of a tile that a splat reaches.
fn reached<T: Real, const C: usize>(
    splat: &Drawn<T, C>,
    first: [usize; 2],
    size: [usize; 2],
) -> [std::ops::Range<usize>; 2] {
    let [columns, rows] = [0, 1].map(|i| {
        let (at, reach) = (splat.centre[i].wide() - first[i] as f64, splat.reach[i].wide());
        (at - reach).ceil().max(0.0) as usize..((at + reach).floor() + 1.0).clamp(0.0, size[i] as f64) as usize
    });
    let halves = if columns.is_empty() { 0..0 } else { columns.start / LANES..(columns.end - 1) / LANES + 1 };
    [rows, halves]
}

/// Share of light that a splat keeps back at eight pixels, `x` and `y` away from its centre: before and after it is held
/// to the most that one may.
#[inline(always)]
fn alphas<T: Real, const C: usize>(splat: &Drawn<T, C>, x: &[T; LANES], y: T) -> ([T; LANES], [T; LANES]) {
    let [xx, xy, yy] = splat.conic;
    let half = T::of(-0.5);
    let (a, b, c) = (half * xx, -xy * y, half * yy * y * y);
    let mut free = [T::zero(); LANES];
    for l in 0..LANES {
        free[l] = splat.opacity * ((a * x[l] + b) * x[l] + c).bell();
    }
    let most = T::of(MAX_ALPHA);
    let mut held = free;
    for l in 0..LANES {
        held[l] = if free[l] < most { free[l] } else { most };
    }
    (free, held)
}

/// How far the pixels of a half are right of a splat's centre.
#[inline(always)]
fn across<T: Real, const C: usize>(splat: &Drawn<T, C>, first: [usize; 2], half: usize) -> [T; LANES] {
    let begin = T::of((first[0] + half * LANES) as f64) - splat.centre[0];
    std::array::from_fn(|l| begin + T::of(l as f64))
}

impl<T: Real, const C: usize> Pixels<T, C> {
    /// Blends the splats of a tile's list, nearest first.
    pub(super) fn forward(drawn: &[Drawn<T, C>], list: &[u32], tile: usize, size: [usize; 2]) -> Self {
        let (first, inside) = place(tile, size);
        let dark = Lanes { left: [T::zero(); LANES], channels: [[T::zero(); LANES]; C] };
        let mut pixels = Self { rows: [[dark; TILE]; HALVES], blended: 0 };
        for (half, rows) in pixels.rows.iter_mut().enumerate() {
            for lanes in &mut rows[..inside[1]] {
                (0..LANES).filter(|l| half * LANES + l < inside[0]).for_each(|l| lanes.left[l] = T::one());
            }
        }
        for number in list {
            if pixels.blended.is_multiple_of(EVERY) && pixels.is_spent() {
                break;
            }
            pixels.blended += 1;
            let splat = &drawn[*number as usize];
            let [rows, halves] = reached(splat, first, inside);
            for half in halves {
                let x = across(splat, first, half);
                for row in rows.clone() {
                    let y = T::of((first[1] + row) as f64) - splat.centre[1];
                    pixels.rows[half][row].keep_back(splat, &x, y);
                }
            }
        }
        pixels
    }

    fn is_spent(&self) -> bool {
        let spent = T::of(SPENT);
        self.rows.iter().flatten().all(|lanes| lanes.left.iter().all(|left| *left < spent))
    }

    /// Light left at a pixel of this tile.
    pub(super) fn left(&self, row: usize, column: usize) -> T {
        self.rows[column / LANES][row].left[column % LANES]
    }

    /// A channel there.
    pub(super) fn channel(&self, channel: usize, row: usize, column: usize) -> T {
        self.rows[column / LANES][row].channels[channel][column % LANES]
    }

    /// The sums of every splat of this tile's list, from the slope over the whole picture.
    pub(super) fn backward(
        &self,
        drawn: &[Drawn<T, C>],
        list: &[u32],
        tile: usize,
        slope: &Planes<T, C>,
    ) -> Vec<Sums<T, C>> {
        let (first, inside) = place(tile, slope.size);
        let mut lanes = self.backward_lanes(slope, first, inside);
        let mut out = vec![Sums::default(); list.len()];
        for (number, sums) in list[..self.blended].iter().zip(&mut out) {
            let splat = &drawn[*number as usize];
            let [rows, halves] = reached(splat, first, inside);
            for half in halves {
                let x = across(splat, first, half);
                let mut gathered = Gathered::new();
                for row in rows.clone() {
                    let y = T::of((first[1] + row) as f64) - splat.centre[1];
                    lanes[half][row].take(splat, &x, y, &mut gathered);
                }
                gathered.sum(&x, sums);
            }
        }
        out
    }

    /// The adjoints at each pixel before its first splat.
    fn backward_lanes(
        &self,
        slope: &Planes<T, C>,
        first: [usize; 2],
        inside: [usize; 2],
    ) -> Box<[[BackwardLanes<T, C>; TILE]; HALVES]> {
        let none = [T::zero(); LANES];
        let dark = BackwardLanes { left: none, rest: none, slope: [none; C] };
        let mut lanes = Box::new([[dark; TILE]; HALVES]);
        for (half, (lanes, ends)) in lanes.iter_mut().zip(&self.rows).enumerate() {
            for row in 0..inside[1] {
                let begin = (first[1] + row) * slope.size[0] + first[0] + half * LANES;
                for l in (0..LANES).filter(|l| half * LANES + l < inside[0]) {
                    let (lane, end) = (&mut lanes[row], &ends[row]);
                    lane.left[l] = T::one();
                    lane.rest[l] = end.left[l] * slope.left[begin + l];
                    for c in 0..C {
                        lane.slope[c][l] = slope.channels[c][begin + l];
                        lane.rest[l] += end.channels[c][l] * lane.slope[c][l];
                    }
                }
            }
        }
        lanes
    }
}

impl<T: Real, const C: usize> Lanes<T, C> {
    #[inline(always)]
    fn keep_back(&mut self, splat: &Drawn<T, C>, x: &[T; LANES], y: T) {
        let (faintest, spent) = (T::of(FAINTEST), T::of(SPENT));
        let (_, alpha) = alphas(splat, x, y);
        let mut weight = [T::zero(); LANES];
        for l in 0..LANES {
            let counts = (alpha[l] >= faintest) & (self.left[l] >= spent);
            weight[l] = if counts { self.left[l] * alpha[l] } else { T::zero() };
        }
        for l in 0..LANES {
            self.left[l] -= weight[l];
        }
        for c in 0..C {
            for l in 0..LANES {
                self.channels[c][l] += weight[l] * splat.values[c];
            }
        }
    }
}

/// Adjoints of eight pixels.
#[derive(Clone, Copy)]
struct BackwardLanes<T, const C: usize> {
    /// Light that reaches the next splat.
    left: [T; LANES],
    /// What all splats from here on add to the loss, in its linear part, with the light behind them.
    rest: [T; LANES],
    slope: [[T; LANES]; C],
}

/// Sums over rows, eight columns beside each other.
struct Gathered<T, const C: usize> {
    /// Slope over the logarithm of what is kept back, times 1, y, y².
    bell: [[T; LANES]; 3],
    values: [[T; LANES]; C],
}

impl<T: Real, const C: usize> BackwardLanes<T, C> {
    #[inline(always)]
    fn take(&mut self, splat: &Drawn<T, C>, x: &[T; LANES], y: T, gathered: &mut Gathered<T, C>) {
        let (faintest, spent, most) = (T::of(FAINTEST), T::of(SPENT), T::of(MAX_ALPHA));
        let (free, alpha) = alphas(splat, x, y);
        let mut weight = [T::zero(); LANES];
        for l in 0..LANES {
            let counts = (alpha[l] >= faintest) & (self.left[l] >= spent);
            weight[l] = if counts { self.left[l] * alpha[l] } else { T::zero() };
        }
        let mut value = [T::zero(); LANES];
        for c in 0..C {
            for l in 0..LANES {
                value[l] += splat.values[c] * self.slope[c][l];
                gathered.values[c][l] += weight[l] * self.slope[c][l];
            }
        }
        for l in 0..LANES {
            self.rest[l] -= weight[l] * value[l];
            // Over the logarithm of alpha: what it adds, less what it takes of the rest.
            let moves = (weight[l] > T::zero()) & (free[l] < most);
            let bell = weight[l] * value[l] - alpha[l] * self.rest[l] / (T::one() - alpha[l]);
            let bell = if moves { bell } else { T::zero() };
            self.left[l] -= weight[l];
            gathered.bell[0][l] += bell;
            gathered.bell[1][l] += bell * y;
            gathered.bell[2][l] += bell * y * y;
        }
    }
}

impl<T: Real, const C: usize> Gathered<T, C> {
    fn new() -> Self {
        Self { bell: [[T::zero(); LANES]; 3], values: [[T::zero(); LANES]; C] }
    }

    #[inline(always)]
    fn sum(&self, x: &[T; LANES], sums: &mut Sums<T, C>) {
        for l in 0..LANES {
            let [one, y, yy] = [0, 1, 2].map(|i| self.bell[i][l]);
            let more = [one, one * x[l], y, one * x[l] * x[l], y * x[l], yy];
            (0..6).for_each(|i| sums.bell[i] += more[i]);
            (0..C).for_each(|c| sums.values[c] += self.values[c][l]);
        }
    }
}
