//! Gaps that a grid cannot show: what is narrower than two nodes' distance is filled, by a closing (Serra, Image Analysis and
//! Mathematical Morphology, 1982) with a ball of one voxel or of two. Noise pierces thin walls by such gaps, and a wall with a pinhole has
//! another topology.

use crate::field::Field;
use crate::sweep::signed_distance;

/// Radius of the ball [voxel] of an object with depth, and of one without, in whose opened hollows noise of colours leaves tunnels.
pub(crate) const PINHOLE: f32 = 1.0;
pub(crate) const TUNNEL: f32 = 2.0;
/// Where the closing lies no deeper than this, the field stays as it is: so much are distances wrong beside sharp edges [voxel].
const SHALLOW: f32 = 0.5;

/// The field with the gaps filled into which no ball of this radius goes [voxel]; everywhere else it stays as it is.
pub(crate) fn closed(field: &Field<f32>, radius: f32) -> Field<f32> {
    let grown: Vec<f32> = signed_distance(&field.grid, &field.distance).iter().map(|d| d - radius).collect();
    let closing = signed_distance(&field.grid, &grown).into_iter().map(|d| d + radius);
    let fill = |(own, closing): (&f32, f32)| if *own >= 0.0 && closing < -SHALLOW { closing } else { *own };
    Field { distance: field.distance.iter().zip(closing).map(fill).collect(), ..field.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Grid;
    use crate::mesh::{Topology, surface};
    use nalgebra::Point3;

    /// A plate of four voxels, bent, with a hole of this radius [voxel].
    fn plate(hole: f32) -> Field<f32> {
        let grid = Grid { dims: [33, 33, 17], origin: Point3::origin(), voxel: 1e-3 };
        let distance = |index: usize| {
            let [x, y, z] = grid.node(index).map(|v| v as f32);
            let across = ((x - 16.0).powi(2) + (y - 16.0).powi(2)).sqrt();
            let high = (z - 8.3 - 0.01 * across * across).abs() - 2.0;
            high.max(across - 12.0).max(hole - ((x - 13.2).powi(2) + (y - 15.1).powi(2)).sqrt())
        };
        let distance: Vec<f32> = (0..grid.len()).map(distance).collect();
        Field { grid, colour: vec![[0.5; 3]; distance.len()], distance }
    }

    fn genus(field: &Field<f32>) -> i64 {
        let (mesh, _) = surface(field).expect("a plate");
        Topology::of(&mesh).expect("closed").genus
    }

    #[test]
    fn a_pinhole_is_filled_and_a_hole_that_the_grid_shows_stays() {
        assert_eq!([0.9, 3.0].map(|hole| genus(&plate(hole))), [1, 1]);
        assert_eq!([0.9, 3.0].map(|hole| genus(&closed(&plate(hole), PINHOLE))), [0, 1]);
    }

    #[test]
    fn nothing_else_changes() {
        for whole in [plate(0.0), plate(4.0)] {
            assert_eq!(closed(&whole, PINHOLE), whole);
        }
    }
}
