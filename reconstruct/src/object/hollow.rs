//! Hollows that no silhouette shows, found by colour: where the views contradict each other about the hull's surface, it is taken back until
//! they agree (space carving; Kutulakos and Seitz, International Journal of Computer Vision 38, 2000). What lies behind a surface about
//! which they agree stays: silhouettes show it.

use super::evidence::Evidence;
use crate::field::{Field, Grid};
use crate::mesh::{self, Mesh, Solid};
use crate::scan::Frame;
use crate::sweep;
use nalgebra::{Isometry3, Point3};
use shared_mem::ending;

/// By so much the surface goes back in a round where views contradict each other about it [voxel]. Colours change by what views
/// notice within a voxel: longer steps would go past where they agree.
const STEP: f64 = 0.5;
/// The surface lies between nodes no farther from it than this [voxel].
const BESIDE: f64 = 1.75;
/// What lies nearer than this to a surface about which views agree stays [voxel]: a wall has two surfaces, and nodes between them.
const WALL: f32 = 1.8;
/// So many views agree about what stays: of fewer, a pixel beside the right one is soon found.
const AGREE: u8 = 4;
/// Rounds at most: a hollow as deep as forty nodes.
const ROUNDS: usize = 80;
/// A round that opens less than this share of the body is the last.
const LITTLE: f64 = 2e-3;

/// The signed distance [voxel] of the surface without what the views contradict; as it is where they do so on less than `least` of it.
pub(super) fn carved(
    grid: &Grid,
    distance: Vec<f32>,
    (frames, poses): (&[Frame], &[Isometry3<f64>]),
    least: f64,
) -> Vec<f32> {
    let mut field = Field { grid: *grid, colour: vec![[0.5; 3]; distance.len()], distance };
    let (mut stays, mut before) = (vec![false; field.distance.len()], f64::INFINITY);
    for round in 0..ROUNDS {
        let Some((surface, _)) = mesh::surface(&field) else { break };
        let now = Solid::of(&surface).volume;
        if before - now < LITTLE * now {
            break;
        }
        before = now;
        let evidence = Evidence::to_a_pixel(&field, &surface, frames, poses);
        if ending::asked() || round == 0 && evidence.share_contradicted(&surface) < least {
            break;
        }
        let agreed = |corner: usize| evidence.views[corner] >= AGREE && !evidence.contradicted[corner];
        let behind = sweep::distance_from(grid, near(grid, &surface, agreed));
        stays.iter_mut().zip(behind).for_each(|(stays, distance)| *stays |= distance < WALL);
        take_away(&mut field, &surface, &evidence.contradicted, &stays);
        field.distance = sweep::signed_distance(grid, &field.distance);
    }
    field.distance
}

/// Whether a node is the nearest one to some of the corners.
fn near(grid: &Grid, surface: &Mesh, is: impl Fn(usize) -> bool) -> impl Fn(usize) -> bool {
    let mut marked = vec![false; grid.len()];
    let corners = surface.points.iter().enumerate().filter(|(corner, _)| is(*corner));
    for (_, point) in corners {
        let steps = grid.steps(point);
        let node = [0, 1, 2].map(|axis| (steps[axis].round().max(0.0) as usize).min(grid.dims[axis] - 1));
        marked[grid.index(node)] = true;
    }
    move |node| marked[node]
}

/// Takes balls around corners out of the body, but for what stays.
fn take_away(field: &mut Field<f32>, surface: &Mesh, wrong: &[bool], stays: &[bool]) {
    let grid = field.grid;
    for (point, _) in surface.points.iter().zip(wrong).filter(|(_, wrong)| **wrong) {
        let steps = grid.steps(point);
        for index in beside(&grid, &steps) {
            let away = (Point3::from(grid.node(index).map(|n| n as f64)) - steps).norm();
            let level = (STEP - away) as f32;
            if !stays[index] {
                field.distance[index] = field.distance[index].max(level);
            }
        }
    }
}

/// Nodes of the cube around a place.
fn beside(grid: &Grid, steps: &Point3<f64>) -> Vec<usize> {
    let range = |axis: usize| {
        let low = (steps[axis] - BESIDE).ceil().max(0.0) as usize;
        low..((steps[axis] + BESIDE).floor().max(0.0) as usize + 1).min(grid.dims[axis])
    };
    let mut all = Vec::new();
    for k in range(2) {
        for j in range(1) {
            all.extend(range(0).map(|i| grid.index([i, j, k])));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::evidence::tests::{body, scan};
    use super::*;

    fn volume(field: &Field<f32>) -> f64 {
        Solid::of(&mesh::surface(field).expect("a body").0).volume
    }

    #[test]
    fn a_filled_hollow_is_opened_and_a_right_shape_stays() {
        let (frames, poses) = scan();
        let carved = |body: Field<f32>| {
            let distance = carved(&body.grid, body.distance.clone(), (&frames, &poses), 0.1);
            Field { distance, ..body }
        };
        let right = body(true);
        assert_eq!(carved(right.clone()).distance, right.distance);
        let [right, filled, opened] = [&right, &body(false), &carved(body(false))].map(volume);
        // Half-voxel steps end where pixels of five millimetres agree.
        let left = (opened - right) / (filled - right);
        assert!((0.0..0.65).contains(&left), "{left} of what fills the hollow");
    }
}
