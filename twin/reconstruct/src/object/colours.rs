//! Colours beside the surface are those of the nearest place on it (closest-point extension; Adalsteinsson and Sethian, Journal of
//! Computational Physics 148, 1999). No ray sees what lies behind the surface, and whatever colour happens to be there would say whether
//! the surface should go there. With the surface's own, only that says so what the views show of it from different sides.

use crate::field::Field;
use rayon::prelude::*;

/// Nodes up to this distance from the surface have colours of their own [voxel].
const OWN: f32 = 0.5;
/// Slopes below this are taken for it, so that places on a ridge are not sent far away.
const FLATTEST: f32 = 0.5;

/// Gives these nodes, which must have neighbours on all sides, their colours.
pub(crate) fn extend(field: &mut Field<f32>, nodes: &[u32]) {
    let (grid, strides) = (field.grid, field.grid.strides());
    let nearest = |node: u32| {
        let index = node as usize;
        let distance = field.distance[index];
        if distance.abs() <= OWN {
            return None;
        }
        let slope = strides.map(|stride| 0.5 * (field.distance[index + stride] - field.distance[index - stride]));
        let square = slope.iter().map(|s| s * s).sum::<f32>().max(FLATTEST * FLATTEST);
        let at = grid.node(index);
        let cell = grid.cell([0, 1, 2].map(|axis| at[axis] as f32 - distance * slope[axis] / square))?;
        let mut colour = [0.0; 3];
        for (node, weight) in grid.nodes(cell.base).into_iter().zip(cell.weights()) {
            (0..3).for_each(|c| colour[c] += weight * field.colour[node][c]);
        }
        Some((index, colour))
    };
    let found: Vec<(usize, [f32; 3])> = nodes.par_iter().filter_map(|node| nearest(*node)).collect();
    for (index, colour) in found {
        field.colour[index] = colour;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Grid;
    use nalgebra::Point3;

    #[test]
    fn around_a_ball_colours_are_those_of_its_surface() {
        let grid = Grid { dims: [31; 3], origin: Point3::origin(), voxel: 1.0 };
        let away = |i: usize| grid.position(grid.node(i)) - Point3::new(15.2, 14.9, 15.1);
        let distance: Vec<f32> = (0..grid.len()).map(|i| (away(i).norm() - 8.0) as f32).collect();
        let right = |i: usize| 0.5 + 0.4 * away(i).normalize().x as f32;
        // What is farther than one cell's diagonal from the surface is black.
        let own = |i: usize| [if distance[i].abs() < 1.8 { right(i) } else { 0.0 }; 3];
        let colour = (0..grid.len()).map(own).collect();
        let mut field = Field { grid, distance, colour };
        let near = |i: &u32| (-4.0..5.0).contains(&field.distance[*i as usize]);
        let nodes: Vec<u32> =
            (0..grid.len() as u32).filter(|i| !grid.is_rim(grid.node(*i as usize))).filter(near).collect();
        extend(&mut field, &nodes);
        let off = |i: &u32| (field.colour[*i as usize][1] - right(*i as usize)).abs();
        let worst = nodes.iter().map(off).fold(0.0, f32::max);
        assert!(worst < 0.03, "{worst}");
    }
}
