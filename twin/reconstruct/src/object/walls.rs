//! Walls that are thin for the grid: with fewer nodes across than these, tunnels and a wall's thickness are the grid's rather than the
//! object's.

use super::corners;
use super::evidence;
use crate::field::Field;
use crate::mesh::Mesh;
use shared_mem::statistics::median;

/// A wall shows as it is with so many nodes across [voxel]: two surfaces, each between nodes of its own.
const NODES: f64 = 2.5;
/// How finely it is looked [voxel].
const STEP: f64 = 0.25;

/// Walls of fewer than [`NODES`] nodes across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ThinWalls {
    /// Share of the surface [1].
    pub(super) share: f64,
    /// Their middle thickness [voxel].
    pub(super) middle: f64,
}

impl ThinWalls {
    /// Of a mesh on the surface of `field`, looked through from each corner along its normal.
    pub(super) fn of(field: &Field<f32>, mesh: &Mesh) -> Self {
        let voxel = field.grid.voxel;
        let through = |corner: usize, normal: &nalgebra::Vector3<f64>| {
            let depths = (1..=(NODES / STEP) as usize).map(|number| number as f64 * STEP);
            let is_outside = |depth: f64| {
                let place = mesh.points[corner] - normal * (depth * voxel);
                field.distance_at(&place).is_none_or(|distance| distance > 0.0)
            };
            // The corner itself may lie outside by the tolerance of the triangles.
            depths.skip_while(|depth| *depth < 2.0 * STEP).find(|depth| is_outside(*depth))
        };
        let normals = corners::normals(mesh);
        let thickness: Vec<Option<f64>> = normals.iter().enumerate().map(|(corner, n)| through(corner, n)).collect();
        Self {
            share: evidence::share(mesh, |corner| thickness[corner].is_some()),
            middle: median(thickness.iter().flatten().copied()).unwrap_or(NODES),
        }
    }

    /// Nodes along each edge of a grid, where it is `edge` now, on which the middle one of them has [`NODES`] across.
    pub(super) fn edge(&self, edge: u32) -> u32 {
        (f64::from(edge) * NODES / self.middle).ceil() as u32
    }

    /// [`NODES`] across [m].
    pub(super) fn limit(voxel: f64) -> f64 {
        NODES * voxel
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Grid;
    use crate::mesh::surface;
    use nalgebra::Point3;

    #[test]
    fn a_plate_is_thin_and_a_ball_is_not() {
        let grid = Grid { dims: [33; 3], origin: Point3::origin(), voxel: 1e-3 };
        let share = |distance: &dyn Fn([f32; 3]) -> f32| {
            let distance: Vec<f32> = (0..grid.len()).map(|i| distance(grid.node(i).map(|v| v as f32 - 16.0))).collect();
            let field = Field { grid, colour: vec![[0.5; 3]; distance.len()], distance };
            ThinWalls::of(&field, &surface(&field).expect("a body").0)
        };
        let plate = share(&|[x, y, z]| ((z - 0.3).abs() - 0.8).max(x.abs().max(y.abs()) - 12.0));
        assert!(plate.share > 0.8 && (1.25..=2.0).contains(&plate.middle), "{plate:?}");
        assert!((120..=200).contains(&plate.edge(100)), "{}", plate.edge(100));
        let ball = share(&|[x, y, z]| (x * x + y * y + z * z).sqrt() - 10.0);
        assert!(ball.share < 0.01, "{ball:?}");
    }
}
