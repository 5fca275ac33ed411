//! Which part of a surface moves: where each place of it would be in the other state if it stayed or moved along, smoothed; places for
//! which both are as likely follow the others: what a slide moves within itself those before and behind it along the slide, the rest
//! by random walks along the surface that seldom pass folds inwards.

use super::body::{Body, Place, normal};
use super::is_beyond;
use crate::field::{Field, Grid};
use crate::sweep::distance_from;
use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::ending;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Costs of a place that is hidden in the other state, nearly in the open, in the open; on a surface there is none.
const HIDDEN: f64 = 3.0;
const NEARLY: f64 = 4.5;
const FREE: f64 = 7.0;
/// Largest weight of one place's evidence.
const MAX_WEIGHT: f64 = 4.0;
/// Places whose evidence has this weight at least, and is so far from a half once smoothed, are what others follow.
const WEIGHTY: f64 = 1.0;
const CLEAR: f64 = 0.3;
/// How long a fold inwards makes a way: a step is so many times longer, as an exponent, for each unit by which normals change.
const FOLD: f64 = 16.0;
/// Rounds in which normals become means of their neighbours' that agree so far with them (cosine).
const AVERAGED: usize = 6;
const AGREE: f64 = 0.5;
/// Neighbours whose normals agree less (cosine) are on different sides of a wall.
const SIDES: f64 = -0.3;
/// Normals on a surface that goes on straight agree so far (cosine).
const STRAIGHT_ON: f64 = 0.9;
/// Rounds of the conjugate gradients, in smoothing and on, and the share of the squared residual at which they end.
const SMOOTHING_ITERATIONS: usize = 60;
const CONTINUATION_ITERATIONS: usize = 1500;
const CONVERGED: f64 = 1e-7;
/// Times the border between the parts is smoothed.
const SMOOTHED: usize = 4;

/// Evidence of one place of the surface: 1 for the part, 0 for the base, and its weight [squared standard deviations].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evidence {
    pub(super) part: f64,
    pub(super) weight: f64,
}

/// Places beside the surface, at nodes of the body's grid just outside of it: within a thin wall both sides would be near to each other.
struct Rim {
    grid: Grid,
    nodes: Vec<usize>,
    /// Of each such node which one it is.
    numbers: HashMap<usize, u32>,
    places: Vec<(Point3<f64>, Vector3<f64>)>,
    /// Neighbours and the length of the way to them.
    beside: Vec<Vec<(u32, f64)>>,
}

/// The border between the parts: negative nearer to the part that moves [voxel], at the nodes of the body's grid. `evidence_of` is asked for
/// places of the surface and the directions out of it; `slide`: the direction of the joint, where it is a slide.
pub(super) fn border(
    body: &Body,
    slide: Option<Vector3<f64>>,
    evidence_of: impl Fn(&Point3<f64>, &Vector3<f64>) -> Evidence,
) -> Field<f32> {
    let rim = Rim::of(body);
    let evidence: Vec<Evidence> = rim.places.iter().map(|(place, normal)| evidence_of(place, normal)).collect();
    let part = rim.carried_on(&evidence, rim.smoothed(&evidence), slide);
    let grid = body.field.grid;
    let mut seeds = vec![0u8; grid.len()];
    for (node, part) in rim.nodes.iter().zip(&part) {
        seeds[*node] = if *part { 2 } else { 1 };
    }
    let [base, part] = [1, 2].map(|kind| distance_from(&grid, |index| seeds[index] == kind));
    let mut distance: Vec<f32> = part.iter().zip(&base).map(|(part, base)| 0.5 * (part - base)).collect();
    for _ in 0..SMOOTHED {
        distance = smoothed(&grid, &distance);
    }
    Field { grid, distance, colour: Vec::new() }
}

/// Evidence of a place when the other state is reached by one of two poses. On the surface either way there is none: a plane that slides
/// within itself, or a place on the axis. A surface along `slide` may be hidden as well: the other part covers and uncovers it, whichever
/// of the two moves. Where the border of the other state is known already, a place that stays is on what stays there alone, and one that
/// moves on what moves.
pub(super) fn seen_in(
    (other, border): (&Body, Option<&Field<f32>>),
    poses: &[Isometry3<f64>; 2],
    (tolerance, slide): (f64, Option<&Vector3<f64>>),
    (place, normal): (&Point3<f64>, &Vector3<f64>),
) -> Evidence {
    let slides = slide.is_some_and(|slide| normal.dot(slide).powi(2) < 1.0 - STRAIGHT_ON * STRAIGHT_ON);
    let cost = |which: usize| {
        let (place, normal) = (poses[which] * place, poses[which].rotation * normal);
        let is_of_other = || border.is_some_and(|border| is_beyond(border, &place) != (which == 1));
        match other.place(&place, &normal, tolerance) {
            Place::On(..) if !is_of_other() => 0.0,
            Place::Hidden if slides => 0.0,
            Place::On(..) | Place::Hidden => HIDDEN,
            Place::Free if matches!(other.place(&place, &normal, 2.0 * tolerance), Place::Free) => FREE,
            Place::Free => NEARLY,
        }
    };
    let [base, part] = [0, 1].map(cost);
    Evidence { part: if part < base { 1.0 } else { 0.0 }, weight: (part - base).abs().min(MAX_WEIGHT) }
}

fn smoothed(grid: &Grid, values: &[f32]) -> Vec<f32> {
    let strides = grid.strides();
    let mean = |index: usize| {
        if grid.is_rim(grid.node(index)) {
            return values[index];
        }
        let around: f32 = strides.iter().map(|stride| values[index - stride] + values[index + stride]).sum();
        0.5 * values[index] + around / 12.0
    };
    (0..values.len()).map(mean).collect()
}

impl Rim {
    fn of(body: &Body) -> Self {
        let (grid, distance) = (&body.field.grid, &body.field.distance);
        let nodes: Vec<usize> = (0..grid.len()).filter(|i| (0.0..1.0).contains(&distance[*i])).collect();
        let places: Vec<(Point3<f64>, Vector3<f64>)> = nodes
            .iter()
            .map(|index| {
                let place = grid.position(grid.node(*index));
                let normal = normal(&body.field, &place);
                (place - normal * (f64::from(distance[*index]) * grid.voxel), normal)
            })
            .collect();
        let numbers: HashMap<usize, u32> = nodes.iter().enumerate().map(|(i, node)| (*node, i as u32)).collect();
        let [x, y, z] = grid.strides().map(|stride| stride as isize);
        let steps: Vec<isize> =
            [x, y, z, x + y, x - y, x + z, x - z, y + z, y - z].into_iter().flat_map(|s| [s, -s]).collect();
        let around: Vec<Vec<u32>> = (0..nodes.len())
            .map(|i| {
                steps.iter().filter_map(|step| numbers.get(&nodes[i].checked_add_signed(*step)?).copied()).collect()
            })
            .collect();
        let mut normals: Vec<Vector3<f64>> = places.iter().map(|place| place.1).collect();
        for _ in 0..AVERAGED {
            let mean = |i: usize| {
                let agree = around[i].iter().map(|j| normals[*j as usize]).filter(|n| n.dot(&normals[i]) > AGREE);
                (normals[i] + agree.sum::<Vector3<f64>>()).normalize()
            };
            normals = (0..normals.len()).map(mean).collect();
        }
        let ways = |i: usize| {
            let at = |i: usize| (places[i].0, normals[i]);
            around[i].iter().filter_map(|j| Some((*j, way(&at(i), &at(*j as usize))?))).collect()
        };
        let beside = (0..nodes.len()).map(ways).collect();
        Self { grid: *grid, nodes, numbers, places, beside }
    }

    /// The least of sum w_i (x_i - h_i)² + sum (x_i - x_j)², nearly.
    fn smoothed(&self, evidence: &[Evidence]) -> Vec<f64> {
        let apply = |x: &[f64]| -> Vec<f64> {
            let steps = |i: usize| self.beside[i].iter().map(|(j, _)| x[i] - x[*j as usize]).sum::<f64>();
            (0..x.len()).map(|i| evidence[i].weight * x[i] + steps(i)).collect()
        };
        let diagonal: Vec<f64> =
            evidence.iter().zip(&self.beside).map(|(one, beside)| one.weight + beside.len() as f64).collect();
        let right: Vec<f64> = evidence.iter().map(|one| one.weight * one.part).collect();
        solved(apply, &diagonal, &right, vec![0.5; evidence.len()], SMOOTHING_ITERATIONS)
    }

    /// Whether each place moves: what is clear there, or where more of the random walks from it end (Grady 2006).
    fn carried_on(&self, evidence: &[Evidence], mut smoothed: Vec<f64>, slide: Option<Vector3<f64>>) -> Vec<bool> {
        let is_clear = |i: usize| evidence[i].weight >= WEIGHTY && (smoothed[i] - 0.5).abs() > CLEAR;
        let mut clear: Vec<bool> = (0..evidence.len()).map(is_clear).collect();
        if let Some(slide) = slide {
            let open = (0..clear.len()).filter(|i| !clear[*i]);
            let found: Vec<_> = open.filter_map(|i| Some((i, smoothed[self.in_line(i, &slide, &clear)?]))).collect();
            for (i, part) in found {
                (clear[i], smoothed[i]) = (true, part);
            }
        }
        let start = self.nearest(&clear, &smoothed);
        let apply = |x: &[f64]| -> Vec<f64> {
            let steps = |i: usize| self.beside[i].iter().map(|(j, way)| (x[i] - x[*j as usize]) / way).sum::<f64>();
            (0..x.len()).map(|i| if clear[i] { x[i] } else { steps(i) }).collect()
        };
        // What is clear stays as it is: moved to the right side, the matrix is that of the others alone.
        let known: Vec<f64> = (0..start.len()).map(|i| if clear[i] { start[i] } else { 0.0 }).collect();
        let shares = apply(&known);
        let right: Vec<f64> = (0..start.len()).map(|i| if clear[i] { 0.0 } else { -shares[i] }).collect();
        let open = |x: &[f64]| -> Vec<f64> {
            let x: Vec<f64> = x.iter().zip(&clear).map(|(x, clear)| if *clear { 0.0 } else { *x }).collect();
            apply(&x)
        };
        let diagonal: Vec<f64> = (0..start.len())
            .map(
                |i| if clear[i] { 1.0 } else { self.beside[i].iter().map(|(_, way)| 1.0 / way).sum::<f64>().max(1e-9) },
            )
            .collect();
        let first = start.iter().zip(&clear).map(|(x, clear)| if *clear { 0.0 } else { *x }).collect();
        let found = solved(open, &diagonal, &right, first, CONTINUATION_ITERATIONS);
        (0..start.len()).map(|i| if clear[i] { start[i] > 0.5 } else { found[i] > 0.5 }).collect()
    }

    /// The nearest clear place before or behind another one along a slide, on the same surface: as the slide moves that surface within
    /// itself, all of the line belongs to one part, unless it ends on both.
    fn in_line(&self, from: usize, slide: &Vector3<f64>, clear: &[bool]) -> Option<usize> {
        let (place, normal) = self.places[from];
        let step = slide * self.grid.voxel;
        let walk = |sign: f64| {
            let on = (1..).map_while(|count| self.on_surface(&(place + step * (sign * f64::from(count))), &normal));
            on.enumerate().find(|(_, i)| clear[*i])
        };
        let ends = [walk(1.0), walk(-1.0)];
        ends.into_iter().flatten().min_by_key(|(count, _)| *count).map(|(_, i)| i)
    }

    /// The place beside the surface that is next to a place on it and whose normal agrees.
    fn on_surface(&self, place: &Point3<f64>, normal: &Vector3<f64>) -> Option<usize> {
        // Half a step outside, where these places are.
        let middle = self.grid.steps(&(place + normal * (0.5 * self.grid.voxel)));
        let around = (0..27).filter_map(|i: usize| {
            let node = [i % 3, i / 3 % 3, i / 9];
            let at = [0, 1, 2].map(|axis| middle[axis].round() as isize + node[axis] as isize - 1);
            let inside = (0..3).all(|axis| at[axis] >= 0 && at[axis] < self.grid.dims[axis] as isize);
            let number = inside.then(|| self.numbers.get(&self.grid.index(at.map(|v| v as usize))))?;
            number.map(|i| *i as usize)
        });
        let away = |i: usize| (self.places[i].0 - place).norm_squared();
        let near = around.filter(|i| self.places[*i].1.dot(normal) > STRAIGHT_ON && away(*i) < self.grid.voxel.powi(2));
        near.min_by(|a, b| away(*a).total_cmp(&away(*b)))
    }

    /// What is clear at the nearest place where it is (Dijkstra 1959): 1 for the part, 0 for the base.
    fn nearest(&self, clear: &[bool], smoothed: &[f64]) -> Vec<f64> {
        let mut part: Vec<f64> = smoothed.iter().map(|part| part.round()).collect();
        let mut length = vec![f64::INFINITY; part.len()];
        let mut open = BinaryHeap::new();
        for i in (0..part.len()).filter(|i| clear[*i]) {
            length[i] = 0.0;
            open.push((Reverse(0u64), i as u32));
        }
        while let Some((Reverse(at), i)) = open.pop() {
            let i = i as usize;
            // Lengths are ordered as whole thousandths.
            if at > (length[i] * 1e3) as u64 {
                continue;
            }
            for (j, way) in &self.beside[i] {
                let j = *j as usize;
                if length[i] + way < length[j] {
                    (length[j], part[j]) = (length[i] + way, part[i]);
                    open.push((Reverse((length[j] * 1e3) as u64), j as u32));
                }
            }
        }
        part
    }
}

/// Linear equations with a positive matrix by conjugate gradients, scaled by the matrix' diagonal.
fn solved(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    diagonal: &[f64],
    right: &[f64],
    start: Vec<f64>,
    rounds: usize,
) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |left: &[f64]| -> Vec<f64> { left.iter().zip(diagonal).map(|(left, d)| left / d).collect() };
    let mut x = start;
    let mut left: Vec<f64> = right.iter().zip(apply(&x)).map(|(b, a)| b - a).collect();
    let mut way = scaled(&left);
    let mut square = dot(&left, &way);
    let end = CONVERGED * square;
    for _ in 0..rounds {
        // Who asked for the end throws the result away.
        if square <= end || ending::asked() {
            break;
        }
        let product = apply(&way);
        let step = square / dot(&way, &product);
        x.iter_mut().zip(&way).for_each(|(x, way)| *x += step * way);
        left.iter_mut().zip(&product).for_each(|(left, product)| *left -= step * product);
        let next = scaled(&left);
        let before = std::mem::replace(&mut square, dot(&left, &next));
        way.iter_mut().zip(&next).for_each(|(way, next)| *way = next + *way * (square / before));
    }
    x
}

/// How many steps long the way between two neighbours counts; `None` through a wall.
fn way(one: &(Point3<f64>, Vector3<f64>), other: &(Point3<f64>, Vector3<f64>)) -> Option<f64> {
    let away = other.0 - one.0;
    if one.1.dot(&other.1) < SIDES {
        return None;
    }
    let fold = -(other.1 - one.1).dot(&away) / away.norm().max(1e-9);
    Some((FOLD * fold.max(0.0)).exp())
}
