//! Nodes that change sides without changing what kind of surface the body has: simple points (Kong and Rosenfeld, "Digital topology", 1989),
//! here of the tetrahedra into which the surface cuts each cell, so that it has no other handles and parts afterwards than before.

use crate::field::Grid;

/// The nodes with which one shares an edge of a tetrahedron (Kuhn's cut): one step along some of the axes, all of them in the same sense.
const NEIGHBOURS: [[i8; 3]; 14] = {
    let mut all = [[0; 3]; 14];
    let mut bits = 1;
    while bits < 8 {
        let step = [bits & 1, bits >> 1 & 1, bits >> 2];
        all[bits as usize - 1] = step;
        all[bits as usize + 6] = [-step[0], -step[1], -step[2]];
        bits += 1;
    }
    all
};
const ALL: u16 = (1 << NEIGHBOURS.len()) - 1;
/// Which of them share such an edge with each of them, as bits.
const BESIDE: [u16; 14] = {
    let mut all = [0; 14];
    let mut pair = 0;
    while pair < 14 * 14 {
        let (one, other) = (pair / 14, pair % 14);
        let mut nearest = 0;
        while nearest < 14 {
            let mut same = true;
            let mut axis = 0;
            while axis < 3 {
                same &= NEIGHBOURS[other][axis] - NEIGHBOURS[one][axis] == NEIGHBOURS[nearest][axis];
                axis += 1;
            }
            if same {
                all[one] |= 1 << other;
            }
            nearest += 1;
        }
        pair += 1;
    }
    all
};

/// Gives nodes these distances, but for those that would change the topology by changing sides; `wanted` by index.
pub(super) fn moved(grid: &Grid, distance: &mut [f32], wanted: impl IntoIterator<Item = (usize, f32)>) {
    let mut waiting = Vec::new();
    for (node, value) in wanted {
        if (value < 0.0) == (distance[node] < 0.0) {
            distance[node] = value;
        } else if !grid.is_rim(grid.node(node)) {
            waiting.push((node, value));
        }
    }
    // From the surface on: of those far from it, some become simple by what goes before.
    waiting.sort_by(|a, b| distance[a.0].abs().total_cmp(&distance[b.0].abs()).then(a.0.cmp(&b.0)));
    loop {
        let before = waiting.len();
        waiting.retain(|(node, value)| {
            let stays = !is_simple(inside(grid, distance, *node));
            if !stays {
                distance[*node] = *value;
            }
            stays
        });
        if waiting.len() == before {
            return;
        }
    }
}

/// Which neighbours of a node that is not at the rim are inside, as bits.
fn inside(grid: &Grid, distance: &[f32], node: usize) -> u16 {
    let strides = grid.strides().map(|stride| stride as isize);
    let at = |step: &[i8; 3]| (0..3).map(|axis| isize::from(step[axis]) * strides[axis]).sum::<isize>();
    let bit =
        |(number, step): (usize, &[i8; 3])| u16::from(distance[node.wrapping_add_signed(at(step))] < 0.0) << number;
    NEIGHBOURS.iter().enumerate().map(bit).sum()
}

/// On the sphere of its neighbours those inside are in one piece, and those outside, too.
fn is_simple(inside: u16) -> bool {
    in_one_piece(inside) && in_one_piece(!inside & ALL)
}

/// `false` of none.
fn in_one_piece(set: u16) -> bool {
    let mut piece = set & set.wrapping_neg();
    loop {
        let next = (0..14).filter(|n| piece >> n & 1 == 1).fold(piece, |piece, n| piece | BESIDE[n] & set);
        if next == piece {
            return set != 0 && piece == set;
        }
        piece = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Field;
    use crate::mesh::{Topology, surface};
    use nalgebra::Point3;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;

    fn genus(grid: &Grid, distance: &[f32]) -> i64 {
        let field = Field { grid: *grid, colour: vec![[0.5; 3]; distance.len()], distance: distance.to_vec() };
        let (mesh, islands) = surface(&field).expect("a body");
        assert_eq!((islands.bodies, islands.hollows), (0, 0));
        Topology::of(&mesh).expect("closed").genus
    }

    /// A ring of 16 nodes across around the z axis.
    fn ring() -> (Grid, Vec<f32>) {
        let grid = Grid { dims: [33, 33, 17], origin: Point3::origin(), voxel: 1.0 };
        let distance = |index: usize| {
            let [x, y, z] = grid.node(index).map(|n| n as f32);
            let across = ((x - 16.0).powi(2) + (y - 16.0).powi(2)).sqrt();
            ((across - 9.0).powi(2) + (z - 8.0).powi(2)).sqrt() - 4.2
        };
        (grid, (0..grid.len()).map(distance).collect())
    }

    #[test]
    fn the_neighbours_are_a_sphere() {
        let edges: u32 = BESIDE.iter().map(|set| set.count_ones()).sum::<u32>() / 2;
        let triangles = (0..14u32).flat_map(|a| (0..a).map(move |b| (a as usize, b as usize)));
        let triangles = triangles.filter(|(a, b)| BESIDE[*a] >> b & 1 == 1);
        let triangles: u32 = triangles.map(|(a, b)| (BESIDE[a] & BESIDE[b]).count_ones()).sum::<u32>() / 3;
        assert_eq!((edges, triangles), (36, 24));
        assert!(!is_simple(0) && !is_simple(ALL) && is_simple(1));
    }

    #[test]
    fn whatever_is_wanted_a_ring_stays_a_ring() {
        let (grid, distance) = ring();
        let mut random = Pcg64::seed_from_u64(3);
        for share in [0.05, 0.3, 0.9] {
            let mut carved = distance.clone();
            let wanted: Vec<_> = (0..grid.len())
                .filter(|_| random.random_range(0.0..1.0) < share)
                .map(|node| (node, if carved[node] < 0.0 { 0.4 } else { -0.4 }))
                .collect();
            moved(&grid, &mut carved, wanted.iter().copied());
            assert_eq!(genus(&grid, &carved), 1);
            let changed = wanted.iter().filter(|(node, _)| (carved[*node] < 0.0) != (distance[*node] < 0.0)).count();
            assert!(changed > 100, "{changed}");
            // The same without this rule has another topology.
            let mut free = distance.clone();
            wanted.iter().for_each(|(node, value)| free[*node] = *value);
            let field = Field { grid, colour: vec![[0.5; 3]; free.len()], distance: free };
            let (mesh, islands) = surface(&field).expect("a body");
            assert!(islands.bodies + islands.hollows > 0 || Topology::of(&mesh).expect("closed").genus != 1);
        }
    }

    #[test]
    fn a_pit_is_opened_to_its_floor_but_not_through_it() {
        let grid = Grid { dims: [24, 24, 24], origin: Point3::origin(), voxel: 1.0 };
        let distance: Vec<f32> = (0..grid.len())
            .map(|index| grid.node(index).map(|n| (n as f32 - 11.5).abs() - 8.0).into_iter().fold(f32::MIN, f32::max))
            .collect();
        let column = |depth: usize| {
            let is_in = move |index: &usize| {
                let [x, y, z] = grid.node(*index);
                (9..15).contains(&x) && (9..15).contains(&y) && z + depth > 19
            };
            (0..grid.len()).filter(is_in).map(|index| (index, 0.5))
        };
        let mut pit = distance.clone();
        moved(&grid, &mut pit, column(10));
        assert!(column(10).all(|(node, _)| pit[node] > 0.0));
        let mut through = distance.clone();
        moved(&grid, &mut through, column(20));
        assert_eq!(genus(&grid, &through), 0);
        // A wall of one node is left.
        let left = column(20).filter(|(node, _)| through[*node] < 0.0).count();
        assert!((36..100).contains(&left), "{left}");
    }
}
