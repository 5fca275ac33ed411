//! The table on which an object stands: nothing of the object lies below it. Pictures from above leave open what is hidden beneath
//! the edges of the object, and a robot knows how high its table is.

use crate::field::Field;

/// Cuts a field off where z is below `height` (scan's frame, m).
pub(super) fn cut(field: &mut Field<f32>, height: f64) {
    let grid = &field.grid;
    for (index, distance) in field.distance.iter_mut().enumerate() {
        let z = grid.origin.z + grid.voxel * grid.node(index)[2] as f64;
        *distance = distance.max(((height - z) / grid.voxel) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Grid;
    use crate::mesh::surface;
    use nalgebra::Point3;

    #[test]
    fn what_is_below_the_table_is_cut_off_flat() {
        let grid = Grid { dims: [33; 3], origin: Point3::new(0.4, 0.1, -0.02), voxel: 2e-3 };
        let middle = Point3::new(0.4315, 0.1325, 0.01);
        let distance = |index: usize| {
            let node = Point3::from(grid.node(index).map(|i| i as f64)) * grid.voxel + grid.origin.coords;
            (((node - middle).norm() - 0.02) / grid.voxel) as f32
        };
        let distance: Vec<f32> = (0..grid.len()).map(distance).collect();
        let mut ball = Field { grid, colour: vec![[0.5; 3]; distance.len()], distance };
        cut(&mut ball, 0.0013);
        let (mesh, _) = surface(&ball).expect("most of a ball");
        let low = mesh.points.iter().map(|point| point.z).fold(f64::INFINITY, f64::min);
        let high = mesh.points.iter().map(|point| point.z).fold(f64::NEG_INFINITY, f64::max);
        assert!((low - 0.0013).abs() < 2e-4 && (high - 0.03).abs() < 2e-4, "{low} to {high}");
    }
}
