//! The picture of splats and what each of their numbers does to it: forward as [`crate::render`] draws, and backward from
//! the slope of a loss over pixels to its slope over centres, rotations, sigmas, opacities and colours (Kerbl et al. 2023,
//! appendix A; Ye & Kanazawa 2023).
//!
//! | module | owns |
//! |---|---|
//! | `parameters` | splats as the columns that are trained |
//! | `tiles` | which splats a tile holds, nearest first |
//! | `blend` | the pixels of a tile, forward and backward |
//! | `projected` | from a splat in the picture back to the splat |
//! | `planes` | channels of a picture, row by row |
//!
//! A picture has four channels, red, green, blue and the depth of the centre, or seven, red, green, blue and the plane in which a
//! splat lies flattest: its distance from the camera and its normal, in the camera's frame. Each is the sum of the splats' values, each
//! times the light that it keeps back. Of planes a pixel's depth is where its ray meets the mean plane (Chen et al. 2024, PGSR): that
//! of centres goes in steps from splat to splat, and lies before a surface that is seen at a slant, since nearer centres are drawn first.

mod blend;
mod parameters;
mod planes;
mod projected;
#[cfg(test)]
mod tests;
mod tiles;

pub use parameters::Parameters;
pub use planes::Planes;

use crate::lens::Lens;
use crate::project::View;
use crate::real::Real;
use blend::{Pixels, Sums};
use nalgebra::Isometry3;
use projected::Back;
use rayon::prelude::*;
use tiles::{Drawn, Lists};

/// Red, green, blue, depth [m].
pub const COLOR_DEPTH: usize = 4;
/// Red, green, blue; normal n of the splat's plane towards the camera times its centre [m]; n's x, y, z, camera frame.
pub const COLOR_PLANE: usize = 7;

/// Splats seen by a camera, with all that the way back needs.
#[derive(Debug)]
pub struct Frame<T: Real, const C: usize> {
    view: View<T>,
    drawn: Vec<Drawn<T, C>>,
    lists: Lists,
    tiles: Vec<Pixels<T, C>>,
}

impl<T: Real, const C: usize> Frame<T, C> {
    /// Draws splats, for `C` of [`COLOR_DEPTH`] or [`COLOR_PLANE`] channels, as `size` columns and rows.
    pub fn new(splats: &Parameters<T>, camera_from_body: &Isometry3<f64>, lens: &Lens, size: [usize; 2]) -> Self {
        let view = View::new(camera_from_body, lens, size);
        let drawn = tiles::drawn(splats, &view);
        let lists = Lists::new(&drawn, size);
        let tiles = (0..lists.tiles()).into_par_iter().map(|tile| Pixels::forward(&drawn, lists.of(tile), tile, size));
        Self { tiles: tiles.collect(), view, drawn, lists }
    }

    /// The picture.
    pub fn planes(&self) -> Planes<T, C> {
        Planes::gather(&self.tiles, self.view.size)
    }

    /// The slope of a loss over the splats' parameters, from its slope over the picture: `slope.channels` over the
    /// channels, `slope.left` over the light that is left.
    pub fn backward(&self, splats: &Parameters<T>, slope: &Planes<T, C>) -> Parameters<T> {
        let sums: Vec<Vec<Sums<T, C>>> = (self.tiles.par_iter().enumerate())
            .map(|(tile, pixels)| pixels.backward(&self.drawn, self.lists.of(tile), tile, slope))
            .collect();
        let mut numbers = vec![u32::MAX; splats.len()];
        for (drawn, at) in self.drawn.iter().zip(0..) {
            numbers[drawn.number as usize] = at;
        }
        let mut out = Parameters::zeros(splats.len(), splats.degree);
        let count = out.coefficients();
        (out.centre.par_iter_mut().zip(out.turn.par_iter_mut()))
            .zip(out.log_sigma.par_iter_mut().zip(out.logit.par_iter_mut()))
            .zip(out.harmonics.par_chunks_mut(count).zip(numbers.par_iter().enumerate()))
            .with_min_len(64)
            .for_each(|(((centre, turn), (log_sigma, logit)), (harmonics, (number, at)))| {
                let Some(drawn) = self.drawn.get(*at as usize) else { return };
                let mut sum = Sums::default();
                self.lists.places(*at as usize).for_each(|(tile, place)| sum.add(&sums[tile][place]));
                let back = Back::new(splats, number, &self.view, drawn, &sum, harmonics);
                (*centre, *turn, *log_sigma, *logit) = (back.centre, back.turn, back.log_sigma, back.logit);
            });
        out
    }
}
