//! Terms of the field alone: its slope has length one (eikonal), and it bends little (the Laplacian's square). Derivatives by hand;
//! lengths in steps of the grid.
//!
//! Only at nodes beside the surface is the field asked to bend little: in the middle of a wall the distance has a ridge, and a field that
//! is smooth there has its surfaces too far apart.

use super::ray::Receiver;
use crate::field::Grid;
use nalgebra::{RealField, convert};

/// Nodes up to this distance from the surface shall bend little [step].
const REACH: f64 = 1.0;

/// Weights of the two terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Smoothness<T> {
    pub(crate) eikonal: T,
    pub(crate) curvature: T,
}

/// Loss at a node that has neighbours on all sides; its derivatives go to `into`.
#[inline]
pub(crate) fn at_node<T: RealField + Copy>(
    grid: &Grid,
    distance: &[T],
    node: usize,
    weights: &Smoothness<T>,
    into: &mut impl Receiver<T>,
) -> T {
    let two: T = convert(2.0);
    let here = distance[node];
    let strides = grid.strides();
    let slope = strides.map(|stride| distance[node + stride] - here);
    let bend = strides
        .iter()
        .fold(T::zero(), |sum, stride| sum + distance[node + stride] + distance[node - stride] - two * here);
    let length = slope.iter().fold(T::zero(), |sum, s| sum + *s * *s).sqrt();
    let off = length - T::one();
    let factor = if length > convert(1e-9) { two * weights.eikonal * off / length } else { T::zero() };
    let mut own = T::zero();
    let curvature = if here.abs() < convert(REACH) { weights.curvature } else { T::zero() };
    let by_bend = two * curvature * bend;
    for (axis, stride) in strides.into_iter().enumerate() {
        let by_slope = factor * slope[axis];
        own -= by_slope + two * by_bend;
        into.distance(node + stride, by_slope + by_bend);
        into.distance(node - stride, by_bend);
    }
    into.distance(node, own);
    weights.eikonal * off * off + curvature * bend * bend
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use rand::{RngExt as _, SeedableRng as _};

    struct Sums(Vec<f64>);

    impl Receiver<f64> for Sums {
        fn distance(&mut self, node: usize, value: f64) {
            self.0[node] += value;
        }

        fn colour(&mut self, _: usize, _: [f64; 3]) {}
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let grid = Grid { dims: [6; 3], origin: Point3::origin(), voxel: 1.0 };
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut distance: Vec<f64> = (0..grid.len()).map(|_| random.random_range(-2.0..2.0)).collect();
        let weights = Smoothness { eikonal: 0.7, curvature: 0.2 };
        let inner: Vec<usize> = (0..grid.len()).filter(|i| !grid.is_rim(grid.node(*i))).collect();
        let loss = |distance: &[f64], into: &mut Sums| -> f64 {
            inner.iter().map(|node| at_node(&grid, distance, *node, &weights, into)).sum()
        };
        let mut sums = Sums(vec![0.0; grid.len()]);
        loss(&distance, &mut sums);
        let mut nowhere = Sums(vec![0.0; grid.len()]);
        for node in 0..grid.len() {
            let before = distance[node];
            let mut at = |value: f64| {
                distance[node] = value;
                loss(&distance, &mut nowhere)
            };
            let slope = (at(before + 1e-6) - at(before - 1e-6)) / 2e-6;
            distance[node] = before;
            assert!((slope - sums.0[node]).abs() < 1e-4 * slope.abs().max(0.1), "{node}: {slope} {}", sums.0[node]);
        }
    }

    #[test]
    fn nothing_moves_the_surfaces_of_a_wall_of_four_steps() {
        let grid = Grid { dims: [5, 5, 16], origin: Point3::origin(), voxel: 1.0 };
        let distance: Vec<f64> = (0..grid.len()).map(|i| (grid.position(grid.node(i)).z - 7.3).abs() - 2.0).collect();
        let weights = Smoothness { eikonal: 0.0, curvature: 0.2 };
        let mut sums = Sums(vec![0.0; grid.len()]);
        let inner = (0..grid.len()).filter(|i| !grid.is_rim(grid.node(*i)));
        let loss: f64 = inner.map(|node| at_node(&grid, &distance, node, &weights, &mut sums)).sum();
        assert!(loss < 1e-20 && sums.0.iter().all(|slope| slope.abs() < 1e-12), "{loss}");
    }
}
