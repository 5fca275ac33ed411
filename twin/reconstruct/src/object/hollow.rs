//! Hollows that no silhouette shows, and walls behind them: the surface goes back to where the views agree best, again and again, since
//! of a surface that is bent otherwise than the right one they do so too early. Where they agree on it as it is, it stays, and what lies
//! behind it: silhouettes show it.

use super::corners;
use super::simple;
use super::stereo::{STEP, Stereo};
use crate::closing;
use crate::field::{Field, Grid};
use crate::mesh::{self, Mesh, Solid};
use crate::scan::Frame;
use crate::sweep;
use nalgebra::{Isometry3, Point3};
use shared_mem::ending;
use std::collections::BTreeMap;

/// The surface lies between nodes no farther from it than this [voxel].
const BESIDE: f64 = 1.75;
/// What lies nearer than this to a surface that stays does so, too [voxel]: a wall has two surfaces, and nodes between them.
const WALL: f32 = 1.8;
/// Of what is opened, gaps narrower than twice this are filled again [voxel]: corners that go back by themselves leave narrow pits.
const NARROW: f32 = 1.5;
/// A round that opens less than this share of the body is the last.
const LITTLE: f64 = 0.003;

/// How far it is looked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    /// Rounds at most.
    rounds: usize,
    /// Depths that are tried in each, half a voxel apart.
    depths: usize,
}

impl Search {
    /// From the hull: a hollow as deep as forty nodes.
    pub(super) const FROM_HULL: Self = Self { rounds: 40, depths: 16 };
    /// From the surface that a grid of half as many nodes along each edge showed: walls that were too thin for it.
    pub(super) const REFINED: Self = Self { rounds: 8, depths: 9 };
}

/// The signed distance [voxel] of the surface that the views show in or behind the one that is given.
pub(super) fn opened(
    grid: &Grid,
    distance: Vec<f32>,
    views: (&[Frame], &[Isometry3<f64>]),
    search: Search,
) -> Vec<f32> {
    let middle = grid.position(grid.dims.map(|n| n / 2));
    let stereo = Stereo::new(views, (grid.voxel, &middle));
    let mut field = Field { grid: *grid, colour: vec![[0.5; 3]; distance.len()], distance: distance.clone() };
    let mut before = f64::INFINITY;
    for _ in 0..search.rounds {
        let Some((surface, _)) = mesh::surface(&field) else { break };
        let now = Solid::of(&surface).volume;
        if ending::asked() || before - now < LITTLE * now {
            break;
        }
        before = now;
        let depths = stereo.depths(&field, &surface, search.depths);
        let behind = sweep::distance_from(grid, near(grid, &surface, |corner| depths[corner].round() == 0.0));
        take_away(&mut field, &surface, &depths, |node| behind[node] < WALL);
        field.distance = sweep::signed_distance(grid, &field.distance);
    }
    let filled = closing::closed(&field, NARROW).distance.into_iter().enumerate();
    let filled = filled.filter(|(node, _)| distance[*node] < 0.0);
    simple::moved(grid, &mut field.distance, filled);
    sweep::signed_distance(grid, &field.distance)
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

/// Takes balls out of the body on each corner's way inwards, but for what stays, and without piercing it; `depths` in [`STEP`].
fn take_away(field: &mut Field<f32>, surface: &Mesh, depths: &[f64], stays: impl Fn(usize) -> bool) {
    let grid = field.grid;
    let normals = corners::normals(surface);
    let mut wanted = BTreeMap::new();
    for ((point, normal), depth) in surface.points.iter().zip(&normals).zip(depths) {
        for number in 0..depth.round() as usize {
            let steps = grid.steps(&(point - normal * (number as f64 * STEP * grid.voxel)));
            for index in beside(&grid, &steps).into_iter().filter(|index| !stays(*index)) {
                let away = (Point3::from(grid.node(index).map(|n| n as f64)) - steps).norm();
                let value = wanted.entry(index).or_insert(field.distance[index]);
                *value = value.max((STEP - away) as f32);
            }
        }
    }
    simple::moved(&grid, &mut field.distance, wanted);
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
        let after = |body: Field<f32>| {
            let distance = opened(&body.grid, body.distance.clone(), (&frames, &poses), Search::FROM_HULL);
            Field { distance, ..body }
        };
        let [right, same, filled, opened] =
            [body(true), after(body(true)), body(false), after(body(false))].map(|body| volume(&body));
        assert!((0.97..1.001).contains(&(same / right)), "{same} of {right}");
        let left = (opened - right) / (filled - right);
        assert!((-0.05..0.45).contains(&left), "{left} of what fills the hollow");
    }

    #[test]
    fn views_whose_colours_cannot_be_compared_change_nothing() {
        let (mut frames, poses) = scan();
        for (number, frame) in frames.iter_mut().enumerate() {
            let turned = |rgb: [u8; 3]| [rgb[number % 3], rgb[(number + 1) % 3] / 2, rgb[(number / 3) % 3]];
            frame.rgb.iter_mut().for_each(|rgb| *rgb = turned(*rgb));
        }
        let filled = body(false);
        let after = opened(&filled.grid, filled.distance.clone(), (&frames, &poses), Search::FROM_HULL);
        assert!((volume(&Field { distance: after, ..filled.clone() }) / volume(&filled) - 1.0).abs() < 0.01);
    }
}
