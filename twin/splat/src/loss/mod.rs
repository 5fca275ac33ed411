//! How far a picture of splats is from a photograph, and the slope of that over every value of the picture.
//!
//! The loss is a sum of means over all pixels:
//!
//! | term | |
//! |---|---|
//! | colour | (1 - s) L1 + s (1 - SSIM), s the share of similarity (Kerbl et al. 2023) |
//! | mask | L1 between the light that is kept back and the mask |
//! | depth | L1 between expected and measured depth, relative to the latter, where more than half of the light is kept back; the light kept back by which the mean depth of centres is divided counts as a constant |
//! | normals | what splats' normals and the normal of their expected depth differ by (Chen et al. 2024, PGSR; Huang et al. 2024, 2DGS) |

mod normals;
mod ssim;
mod target;

pub use target::Target;

use crate::gradient::{COLOR_PLANE, Planes};
use crate::real::Real;

/// Weights of the terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Share of similarity in the colour's term.
    pub similarity: f64,
    /// Of the mask.
    pub mask: f64,
    /// Of the depth.
    pub depth: f64,
    /// Of the normals; more than 0 only for pictures that have them.
    pub normals: f64,
}

/// The loss, and its slope over the picture.
#[derive(Debug)]
pub struct Loss<T, const C: usize> {
    /// Its value.
    pub value: T,
    /// Its slope.
    pub slope: Planes<T, C>,
}

impl<T: Real, const C: usize> Loss<T, C> {
    /// Of a picture against a photograph. `cover`: the light kept back by which depths are divided, of this picture.
    pub fn new(seen: &Planes<T, C>, cover: &[T], target: &Target<T>, weights: &Weights) -> Self {
        let mut loss = Self { value: T::zero(), slope: Planes::zeros(seen.size) };
        loss.color(seen, target, weights);
        loss.mask(seen, target, weights);
        let depth = seen.depth(cover, &target.rays);
        let mut over_depth = vec![T::zero(); depth.len()];
        loss.depth(&depth, target, weights, &mut over_depth);
        if C == COLOR_PLANE && weights.normals > 0.0 {
            let weight = T::of(weights.normals / depth.len() as f64);
            let slopes = normals::normals(seen, &depth, target, weight, &mut over_depth);
            loss.value += slopes.0;
            loss.slope.channels[4..].iter_mut().zip(slopes.1).for_each(|(plane, slope)| *plane = slope);
        }
        for (at, over) in over_depth.into_iter().enumerate().filter(|(_, over)| *over != T::zero()) {
            if C == COLOR_PLANE {
                seen.depth_back(at, depth[at], over, &target.rays[at], &mut loss.slope);
            } else {
                loss.slope.channels[3][at] = over / cover[at];
            }
        }
        loss
    }

    fn color(&mut self, seen: &Planes<T, C>, target: &Target<T>, weights: &Weights) {
        let share = T::of(weights.similarity);
        let scale = T::of(1.0 / (3 * seen.left.len()) as f64);
        let shown: [Vec<T>; 3] = std::array::from_fn(|c| {
            let values = seen.channels[c].iter().zip(&seen.left);
            values.map(|(value, left)| *value + *left * target.background[c]).collect()
        });
        let window = target.window(&shown);
        let mut alike = T::zero();
        for (c, shown) in shown.iter().enumerate() {
            let cut = |plane: &[T]| window.cut(plane);
            let (sum, slope) = ssim::ssim(&cut(shown), &cut(&target.color[c]), window.size());
            // Beyond the window both are the background.
            alike += sum + T::of((seen.left.len() - slope.len()) as f64);
            let out = &mut self.slope.channels[c];
            window.put(&slope, out);
            for ((out, seen), wanted) in out.iter_mut().zip(shown).zip(&target.color[c]) {
                let off = *seen - *wanted;
                self.value += (T::one() - share) * scale * off.abs();
                *out = scale * ((T::one() - share) * sign(off) - share * *out);
            }
            for (left, out) in self.slope.left.iter_mut().zip(&self.slope.channels[c]) {
                *left += *out * target.background[c];
            }
        }
        self.value += share * (T::one() - alike * scale);
    }

    fn mask(&mut self, seen: &Planes<T, C>, target: &Target<T>, weights: &Weights) {
        let scale = T::of(weights.mask / seen.left.len() as f64);
        for ((slope, left), wanted) in self.slope.left.iter_mut().zip(&seen.left).zip(&target.mask) {
            let off = T::one() - *left - *wanted;
            self.value += scale * off.abs();
            *slope -= scale * sign(off);
        }
    }

    fn depth(&mut self, depth: &[T], target: &Target<T>, weights: &Weights, slope: &mut [T]) {
        let scale = T::of(weights.depth / depth.len() as f64);
        for ((seen, wanted), slope) in depth.iter().zip(&target.depth).zip(slope) {
            if *seen > T::zero() && *wanted > T::zero() {
                let off = *seen - *wanted;
                self.value += scale * off.abs() / *wanted;
                *slope += scale * sign(off) / *wanted;
            }
        }
    }
}

fn sign<T: Real>(value: T) -> T {
    if value > T::zero() {
        T::one()
    } else if value < T::zero() {
        -T::one()
    } else {
        T::zero()
    }
}
