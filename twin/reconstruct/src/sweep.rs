//! Signed distance from a function of the same sign: fast sweeping of |grad d| = 1 (Zhao, Mathematics of Computation 74, 2005), begun
//! at the nodes beside the surface, whose distances the function's slope gives.

use crate::field::Grid;

/// Distances beyond this are not needed exactly [voxel].
const FARTHEST: f32 = 1e4;
/// Times all eight directions are swept.
const SWEEPS: usize = 2;

/// The signed distance [voxel] of the surface where `level` changes its sign.
pub(crate) fn signed_distance(grid: &Grid, level: &[f32]) -> Vec<f32> {
    let strides = grid.strides();
    let mut distance = vec![FARTHEST; level.len()];
    for (index, distance) in distance.iter_mut().enumerate() {
        let node = grid.node(index);
        let mut square = 0.0;
        for axis in 0..3 {
            let mut nearest = FARTHEST;
            let mut look = |neighbour: usize| {
                if (level[neighbour] < 0.0) != (level[index] < 0.0) {
                    nearest = nearest.min((level[index] / (level[index] - level[neighbour])).abs().max(1e-3));
                }
            };
            if node[axis] > 0 {
                look(index - strides[axis]);
            }
            if node[axis] + 1 < grid.dims[axis] {
                look(index + strides[axis]);
            }
            if nearest < FARTHEST {
                square += 1.0 / (nearest * nearest);
            }
        }
        if square > 0.0 {
            // Of a plane that cuts the axes at these distances.
            *distance = 1.0 / square.sqrt();
        }
    }
    let known: Vec<bool> = distance.iter().map(|d| *d < FARTHEST).collect();
    for round in 0..8 * SWEEPS {
        sweep(grid, &known, &mut distance, round % 8);
    }
    distance.iter().zip(level).map(|(distance, level)| if *level < 0.0 { -distance } else { *distance }).collect()
}

/// Distances [voxel] from the nodes of a set.
pub(crate) fn distance_from(grid: &Grid, is_in: impl Fn(usize) -> bool) -> Vec<f32> {
    let known: Vec<bool> = (0..grid.len()).map(is_in).collect();
    let mut distance: Vec<f32> = known.iter().map(|known| if *known { 0.0 } else { FARTHEST }).collect();
    for round in 0..8 * SWEEPS {
        sweep(grid, &known, &mut distance, round % 8);
    }
    distance
}

fn sweep(grid: &Grid, known: &[bool], distance: &mut [f32], direction: usize) {
    let strides = grid.strides();
    let along = |axis: usize, step: usize| {
        if direction >> axis & 1 == 0 { step } else { grid.dims[axis] - 1 - step }
    };
    for z in 0..grid.dims[2] {
        for y in 0..grid.dims[1] {
            for x in 0..grid.dims[0] {
                let node = [along(0, x), along(1, y), along(2, z)];
                let index = grid.index(node);
                if known[index] {
                    continue;
                }
                let lower = [0, 1, 2].map(|axis| {
                    let before = if node[axis] > 0 { distance[index - strides[axis]] } else { FARTHEST };
                    let after =
                        if node[axis] + 1 < grid.dims[axis] { distance[index + strides[axis]] } else { FARTHEST };
                    before.min(after)
                });
                let found = upwind(lower);
                if found < distance[index] {
                    distance[index] = found;
                }
            }
        }
    }
}

/// The solution of sum((d - a_i)+^2) = 1.
fn upwind(mut a: [f32; 3]) -> f32 {
    a.sort_by(f32::total_cmp);
    let one = a[0] + 1.0;
    if one <= a[1] {
        return one;
    }
    let two = 0.5 * (a[0] + a[1] + (2.0 - (a[0] - a[1]).powi(2)).max(0.0).sqrt());
    if two <= a[2] {
        return two;
    }
    let (sum, squares) = (a[0] + a[1] + a[2], a.iter().map(|a| a * a).sum::<f32>());
    (sum + (sum * sum - 3.0 * (squares - 1.0)).max(0.0).sqrt()) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn the_distance_of_a_ball_is_found_from_its_sign_alone_within_half_a_voxel() {
        let grid = Grid { dims: [33; 3], origin: Point3::origin(), voxel: 1.0 };
        let truth = |i: usize| {
            let [x, y, z] = grid.node(i).map(|v| v as f32 - 16.0);
            (x * x + y * y + z * z).sqrt() - 9.3
        };
        let level: Vec<f32> = (0..grid.len()).map(|i| truth(i) * 0.3).collect();
        let found = signed_distance(&grid, &level);
        let around = (0..grid.len()).filter(|i| truth(*i).abs() < 4.0);
        let worst = around.map(|i| (found[i] - truth(i)).abs()).fold(0.0, f32::max);
        assert!(worst < 0.5, "{worst}");
        let near: Vec<f32> =
            (0..grid.len()).filter(|i| truth(*i).abs() < 1.0).map(|i| (found[i] - truth(i)).abs()).collect();
        assert!(
            near.iter().sum::<f32>() / (near.len() as f32) < 0.05,
            "{}",
            near.iter().sum::<f32>() / near.len() as f32
        );
    }
}
