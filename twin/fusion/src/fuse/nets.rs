//! The surface between positive and negative voxels: one corner in every cell that it passes, in the middle of where it
//! crosses the cell's edges; one quadrilateral around every edge that it crosses.

use super::grid::{Block, EDGE, Grid, voxel};
use crate::Surface;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Corners of a cell, in the order of their bits: x, y, z.
const CORNERS: [[i32; 3]; 8] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];

/// A voxel that enough views saw.
#[derive(Clone, Copy)]
struct Sample {
    distance: f32,
    color: [f32; 3],
}

/// A block, and those beside it towards x, y, z, by the same bits.
struct Around<'a> {
    blocks: [Option<&'a Block>; 8],
    least: u16,
}

impl Around<'_> {
    /// The voxel at a place from 0 to 8 along each axis.
    fn at(&self, own: [i32; 3]) -> Option<Sample> {
        let beyond = own.map(|i| i / EDGE);
        let block = self.blocks[(beyond[0] | beyond[1] << 1 | beyond[2] << 2) as usize]?;
        let number = voxel(own.map(|i| i % EDGE));
        let is_seen = block.seen[number] >= self.least;
        is_seen.then(|| Sample { distance: block.distance[number], color: block.color[number] })
    }
}

/// What a cell adds.
struct Cell {
    place: [i32; 3],
    point: Point3<f32>,
    color: [f32; 3],
    /// For x, y, z: whether the surface crosses the edge from the cell's first corner, and whether it is inside there.
    crossed: [Option<bool>; 3],
}

impl Grid {
    /// The surface that the views taken in show together.
    pub fn surface(&self) -> Surface {
        surface(self)
    }
}

fn surface(grid: &Grid) -> Surface {
    let mut places = grid.places().to_vec();
    places.sort_unstable();
    let cells: Vec<Cell> = places.par_iter().flat_map_iter(|place| cells(grid, *place)).collect();
    let numbers: HashMap<[i32; 3], u32> = cells.iter().map(|cell| cell.place).zip(0..).collect();
    let mut surface = Surface {
        points: cells.iter().map(|cell| cell.point).collect(),
        colors: cells.iter().map(|cell| cell.color).collect(),
        triangles: Vec::new(),
    };
    for cell in &cells {
        for (axis, inside) in cell.crossed.iter().enumerate() {
            let Some(inside) = *inside else { continue };
            // The four cells around the edge, counter-clockwise about its axis.
            let (one, two) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = [[0, 0], [-1, 0], [-1, -1], [0, -1]].map(|[a, b]| {
                let mut place = cell.place;
                place[one] += a;
                place[two] += b;
                numbers.get(&place).copied()
            });
            let [Some(a), Some(b), Some(c), Some(d)] = around else { continue };
            // From inside to outside along the axis, the surface faces along it.
            let ring = if inside { [a, b, c, d] } else { [d, c, b, a] };
            let far = |i: u32, j: u32| (surface.points[i as usize] - surface.points[j as usize]).norm_squared();
            let [a, b, c, d] = ring;
            // Along the shorter diagonal.
            let pair = if far(a, c) <= far(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            surface.triangles.extend(pair);
        }
    }
    used(surface)
}

/// The cells of a block through which the surface passes.
fn cells(grid: &Grid, place: [i32; 3]) -> Vec<Cell> {
    let blocks = CORNERS.map(|corner| grid.block([0, 1, 2].map(|i| place[i] + corner[i])));
    let around = Around { blocks, least: grid.settings.least };
    let mut out = Vec::new();
    for z in 0..EDGE {
        for y in 0..EDGE {
            for x in 0..EDGE {
                let own = [x, y, z];
                let samples = CORNERS.map(|corner| around.at([0, 1, 2].map(|i| own[i] + corner[i])));
                let cell = [0, 1, 2].map(|i| place[i] * EDGE + own[i]);
                out.extend(passed(cell, &samples, grid.settings.voxel));
            }
        }
    }
    out
}

/// A cell with the surface in it.
fn passed(place: [i32; 3], samples: &[Option<Sample>; 8], edge: f32) -> Option<Cell> {
    let mut known = [Sample { distance: 0.0, color: [0.0; 3] }; 8];
    for (known, sample) in known.iter_mut().zip(samples) {
        *known = (*sample)?;
    }
    let inside = known.map(|sample| sample.distance < 0.0);
    if inside.iter().all(|i| *i == inside[0]) {
        return None;
    }
    let (mut sum, mut color, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for from in 0..8usize {
        for axis in 0..3usize {
            let to = from | 1 << axis;
            if to == from || inside[from] == inside[to] {
                continue;
            }
            let (a, b) = (known[from].distance, known[to].distance);
            let share = a / (a - b);
            let [start, end] = [from, to].map(|i| Vector3::from(CORNERS[i]).cast::<f32>());
            sum += start + (end - start) * share;
            let [start, end] = [from, to].map(|i| Vector3::from(known[i].color));
            color += start + (end - start) * share;
            count += 1.0;
        }
    }
    let point = (Vector3::from(place).cast::<f32>() + sum / count) * edge;
    let crossed = [1, 2, 4].map(|to: usize| (inside[0] != inside[to]).then_some(inside[0]));
    Some(Cell { place, point: point.into(), color: (color / count).into(), crossed })
}

/// Without the corners of no triangle.
fn used(surface: Surface) -> Surface {
    surface.only(|_| true)
}
