//! The surface of a field by marching tetrahedra: each cell is cut into six tetrahedra along its diagonal (Kuhn), in which there is no
//! ambiguous case, so that the surface is a closed manifold whatever the field. Its largest part is the object.

use super::Mesh;
use crate::field::Field;
use nalgebra::Point3;
use std::collections::HashMap;

/// Corners of the six tetrahedra of a cell; bits are x, y, z. All are right-handed.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
/// A corner of the surface stays so far from the nodes beside it [share of the edge]: no triangle is a point.
const FROM_NODES: f32 = 0.02;

/// What was left out beside the object.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Islands {
    pub bodies: usize,
    /// Their volume, of the object's.
    pub share: f64,
    /// Hollows inside, which are filled.
    pub hollows: usize,
}

/// The surface where the field is zero, and what was left out; `None` where nothing is inside.
pub fn surface(field: &Field<f32>) -> Option<(Mesh, Islands)> {
    let all = marched(field);
    let parts = parts(&all);
    let (largest, volume) = parts.iter().copied().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(_, p)| p)?;
    if volume <= 0.0 {
        return None;
    }
    let others = parts.iter().filter(|part| part.0 != largest);
    let bodies: Vec<f64> = others.clone().map(|part| part.1).filter(|volume| *volume > 0.0).collect();
    let islands = Islands {
        bodies: bodies.len(),
        share: bodies.iter().sum::<f64>() / volume,
        hollows: others.filter(|part| part.1 <= 0.0).count(),
    };
    let roots = roots(&all);
    let kept: Vec<[u32; 3]> =
        all.triangles.iter().copied().filter(|triangle| roots[triangle[0] as usize] == largest).collect();
    Some((all.compact(kept), islands))
}

fn marched(field: &Field<f32>) -> Mesh {
    let grid = &field.grid;
    let mut mesh = Mesh::default();
    let mut corners: HashMap<(u32, u8), u32> = HashMap::new();
    // Whatever the field says, the rim of the box is outside.
    let value = |node: [usize; 3]| {
        let value = field.distance[grid.index(node)];
        if grid.is_rim(node) { value.max(0.5) } else { value }
    };
    for z in 0..grid.dims[2] - 1 {
        for y in 0..grid.dims[1] - 1 {
            for x in 0..grid.dims[0] - 1 {
                let nodes: [[usize; 3]; 8] = std::array::from_fn(|c| [x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)]);
                let values = nodes.map(value);
                if values.iter().all(|v| *v < 0.0) || values.iter().all(|v| *v >= 0.0) {
                    continue;
                }
                for tetrahedron in TETRAHEDRA {
                    // An edge is known by its lower node and its direction.
                    let mut corner = |a: usize, b: usize| {
                        let (a, b) = (a.min(b), a.max(b));
                        let key = (grid.index(nodes[a]) as u32, (a ^ b) as u8);
                        *corners.entry(key).or_insert_with(|| {
                            let share = (values[a] / (values[a] - values[b])).clamp(FROM_NODES, 1.0 - FROM_NODES);
                            let [low, high] = [nodes[a], nodes[b]].map(|node| grid.position(node));
                            mesh.points.push(low + (high - low) * f64::from(share));
                            mesh.points.len() as u32 - 1
                        })
                    };
                    cut(tetrahedron, &values, &mut corner, &mut mesh.triangles);
                }
            }
        }
    }
    mesh
}

/// The triangles of one tetrahedron.
fn cut(
    tetrahedron: [usize; 4],
    values: &[f32; 8],
    corner: &mut impl FnMut(usize, usize) -> u32,
    triangles: &mut Vec<[u32; 3]>,
) {
    let inside = |c: &usize| values[*c] < 0.0;
    let count = tetrahedron.iter().filter(|c| inside(c)).count();
    if count == 0 || count == 4 {
        return;
    }
    // Those inside first; an exchange makes it left-handed, and another one right-handed again.
    let mut order = tetrahedron;
    let mut odd = false;
    for i in 0..3 {
        for j in 0..3 - i {
            if !inside(&order[j]) && inside(&order[j + 1]) {
                order.swap(j, j + 1);
                odd = !odd;
            }
        }
    }
    let [a, b, c, d] = order;
    let mut put =
        |triangle: [u32; 3]| triangles.push(if odd { [triangle[0], triangle[2], triangle[1]] } else { triangle });
    match count {
        1 => put([corner(a, b), corner(a, c), corner(a, d)]),
        3 => put([corner(d, a), corner(d, b), corner(d, c)]),
        _ => {
            let rim = [corner(a, c), corner(a, d), corner(b, d), corner(b, c)];
            put([rim[0], rim[1], rim[2]]);
            put([rim[0], rim[2], rim[3]]);
        }
    }
}

/// Of each corner the number of one that stands for all that it is connected with.
fn roots(mesh: &Mesh) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..mesh.points.len() as u32).collect();
    fn root(parent: &mut [u32], mut at: u32) -> u32 {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }
    for [a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (one, two) = (root(&mut parent, *a), root(&mut parent, *other));
            parent[one.max(two) as usize] = one.min(two);
        }
    }
    (0..mesh.points.len() as u32).map(|at| root(&mut parent, at)).collect()
}

/// The parts that hang together, by the corner that stands for each, with the volume that each encloses [m³].
fn parts(mesh: &Mesh) -> Vec<(u32, f64)> {
    let roots = roots(mesh);
    let mut volumes: HashMap<u32, f64> = HashMap::new();
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c]: [Point3<f64>; 3] = mesh.corners(number);
        *volumes.entry(roots[triangle[0] as usize]).or_default() += a.coords.dot(&b.coords.cross(&c.coords)) / 6.0;
    }
    let mut parts: Vec<(u32, f64)> = volumes.into_iter().collect();
    parts.sort_unstable_by_key(|part| part.0);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Grid;
    use crate::mesh::{Solid, Topology};
    use rand::{RngExt as _, SeedableRng as _};

    fn field(value: impl Fn(Point3<f64>) -> f64) -> Field<f32> {
        let grid = Grid { dims: [40; 3], origin: Point3::new(-0.2, -0.2, -0.2), voxel: 0.01 };
        let distance = (0..grid.len()).map(|i| (value(grid.position(grid.node(i))) / 0.01) as f32).collect();
        Field { grid, distance, colour: vec![[0.5; 3]; grid.len()] }
    }

    #[test]
    fn a_ring_is_one_closed_surface_of_genus_one_with_its_volume_and_a_hollow_ball_is_filled() {
        let ring = field(|p| ((p.x.hypot(p.y) - 0.1).powi(2) + p.z * p.z).sqrt() - 0.04);
        let (mesh, islands) = surface(&ring).expect("a ring");
        let topology = Topology::of(&mesh).expect("closed and oriented");
        assert_eq!((topology.genus, islands), (1, Islands::default()));
        let truth = 2.0 * std::f64::consts::PI.powi(2) * 0.1 * 0.04 * 0.04;
        assert!((Solid::of(&mesh).volume / truth - 1.0).abs() < 0.03, "{}", Solid::of(&mesh).volume / truth);
        let hollow = field(|p| (p.coords.norm() - 0.12).max(0.05 - p.coords.norm()));
        let (mesh, islands) = surface(&hollow).expect("a ball");
        assert_eq!((Topology::of(&mesh).expect("closed").genus, islands.hollows), (0, 1));
    }

    #[test]
    fn whatever_the_field_the_surface_is_closed_and_oriented() {
        for seed in 0..10 {
            let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
            let mut noise = field(|_| 1.0);
            noise.distance.iter_mut().for_each(|d| *d = random.random_range(-1.0..1.0));
            let all = marched(&noise);
            Topology::of(&all).expect("closed and oriented");
            let (mesh, islands) = surface(&noise).expect("something is inside");
            Topology::of(&mesh).expect("closed and oriented");
            assert!(islands.bodies > 0 && islands.share > 0.0, "{islands:?}");
        }
        assert!(surface(&field(|_| 1.0)).is_none());
    }
}
