//! The signed distance of a closed mesh at the nodes of a grid: exact beside the surface, by fast sweeping beyond.

use super::Mesh;
use crate::field::{Field, Grid};
use crate::sweep::signed_distance;
use nalgebra::{Point3, Vector3};

/// Nodes within so many voxels of a triangle have their exact distance.
const BAND: f64 = 2.0;
/// Lines of the grid are looked at so far beside their nodes that none meets an edge of triangles on round numbers [voxel].
const BESIDE: [f64; 2] = [1.234_567e-5, 2.718_281e-5];

/// A box around the mesh with about `nodes` nodes and a rim of `margin`, with signed distances: negative inside, in voxels. The field
/// has no colours.
pub fn distances(mesh: &Mesh, nodes: f64, margin: usize) -> Field<f32> {
    let (low, high) = mesh.bounds();
    let grid = Grid::filling(&low, &high, nodes, margin);
    let inside = inside(mesh, &grid);
    let exact = band(mesh, &grid);
    let far = 2.0 * BAND as f32;
    let level: Vec<f32> =
        exact.iter().zip(&inside).map(|(d, inside)| if *inside { -d.min(far) } else { d.min(far) }).collect();
    let mut distance = signed_distance(&grid, &level);
    for ((distance, exact), inside) in distance.iter_mut().zip(&exact).zip(&inside) {
        if exact.is_finite() {
            *distance = if *inside { -exact } else { *exact };
        }
    }
    Field { grid, distance, colour: Vec::new() }
}

/// Distances of the nodes beside triangles [voxel], infinite elsewhere.
fn band(mesh: &Mesh, grid: &Grid) -> Vec<f32> {
    let mut distance = vec![f32::INFINITY; grid.len()];
    for number in 0..mesh.triangles.len() {
        let corners = mesh.corners(number).map(|corner| grid.steps(&corner));
        let range = [0, 1, 2].map(|axis| {
            let values = corners.map(|corner| corner[axis]);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min) - BAND;
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) + BAND;
            low.ceil().max(0.0) as usize..=high.floor().clamp(0.0, (grid.dims[axis] - 1) as f64) as usize
        });
        for z in range[2].clone() {
            for y in range[1].clone() {
                for x in range[0].clone() {
                    let node = Point3::new(x as f64, y as f64, z as f64);
                    let away = (node - nearest(&node, &corners)).norm();
                    if away <= BAND {
                        let own = &mut distance[grid.index([x, y, z])];
                        *own = own.min(away as f32);
                    }
                }
            }
        }
    }
    distance
}

/// The point of a triangle that is nearest to a place (Ericson, Real-Time Collision Detection 5.1.5).
fn nearest(place: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> Point3<f64> {
    let (ab, ac) = (b - a, c - a);
    let along = |from: &Point3<f64>| (ab.dot(&(place - from)), ac.dot(&(place - from)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (along(a), along(b), along(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    a + ab * (vb / sum) + ac * (vc / sum)
}

/// Whether each node is inside: the triangles that a line along x has passed before the node, those that it enters by less those that
/// it leaves by, are more than none.
fn inside(mesh: &Mesh, grid: &Grid) -> Vec<bool> {
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); grid.dims[1] * grid.dims[2]];
    for number in 0..mesh.triangles.len() {
        let corners = mesh.corners(number).map(|corner| grid.steps(&corner));
        let flat = corners.map(|p| Vector3::new(p.y - BESIDE[0], p.z - BESIDE[1], p.x));
        let [a, b, c] = flat;
        let cross = |p: &Vector3<f64>, q: &Vector3<f64>, y: f64, z: f64| (p.x - y) * (q.y - z) - (p.y - z) * (q.x - y);
        let area = cross(&b, &c, a.x, a.y);
        if area == 0.0 {
            continue;
        }
        let range = [0, 1].map(|axis| {
            let values = flat.map(|p| p[axis]);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            low.ceil().max(0.0) as usize..=high.floor().clamp(0.0, (grid.dims[axis + 1] - 1) as f64) as usize
        });
        for z in range[1].clone() {
            for y in range[0].clone() {
                let (fy, fz) = (y as f64, z as f64);
                let weights = [cross(&b, &c, fy, fz), cross(&c, &a, fy, fz), cross(&a, &b, fy, fz)].map(|w| w / area);
                if weights.iter().all(|w| *w >= 0.0) {
                    let x = weights[0] * a.z + weights[1] * b.z + weights[2] * c.z;
                    // A triangle whose normal points against x is one that the line enters by.
                    crossings[z * grid.dims[1] + y].push((x, if area < 0.0 { 1 } else { -1 }));
                }
            }
        }
    }
    let mut inside = vec![false; grid.len()];
    for (line, crossings) in crossings.iter_mut().enumerate() {
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut passed, mut depth) = (0, 0);
        for x in 0..grid.dims[0] {
            while passed < crossings.len() && crossings[passed].0 < x as f64 {
                depth += crossings[passed].1;
                passed += 1;
            }
            inside[line * grid.dims[0] + x] = depth > 0;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::surface;

    #[test]
    fn the_distance_of_a_ring_is_that_of_its_formula_on_both_sides_and_inside_where_it_is_hollow() {
        let grid = Grid { dims: [60, 60, 30], origin: Point3::new(-0.15, -0.15, -0.075), voxel: 0.005 };
        let truth = |p: Point3<f64>| ((p.x.hypot(p.y) - 0.1).powi(2) + p.z * p.z).sqrt() - 0.035;
        let distance = (0..grid.len()).map(|i| (truth(grid.position(grid.node(i))) / 0.005) as f32).collect();
        let (ring, _) = surface(&Field { grid, distance, colour: Vec::new() }).expect("a ring");
        let found = distances(&ring, 1e5, 3);
        let mut worst = 0.0f64;
        for index in 0..found.grid.len() {
            let (truth, own) = (
                truth(found.grid.position(found.grid.node(index))),
                f64::from(found.distance[index]) * found.grid.voxel,
            );
            assert!(truth * own > 0.0 || truth.abs() < 3e-4, "{truth} {own}");
            if truth.abs() < 1.8 * found.grid.voxel {
                worst = worst.max((truth - own).abs());
            }
        }
        assert!(worst < 4e-4, "{worst}");
    }
}
