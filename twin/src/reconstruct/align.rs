//! Where a scan lies and how large it is: iterative closest points (Besl & McKay 1992) between the scan and the robot's
//! surface at known joint positions, distances taken along the surface's normals (Chen & Medioni 1992), rotation,
//! translation and scale together. Points are paired both ways: only the scan's, and it could shrink to nothing; only the
//! robot's, and it could grow into whatever else was scanned. Pairs are let go as the gate between them closes.

use super::nearest::Nearest;
use super::surface::SurfacePoints;
use crate::pose_fit::{Equations, slope};
use nalgebra::{Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How far points may be apart to be a pair, at first and at last [m].
const GATE: [f64; 2] = [0.12, 0.012];
/// Steps while the gate closes, and at the end with many points.
const GATED_STEPS: usize = 40;
const LAST_STEPS: usize = 12;
/// Points that are paired while the best start is looked for, and afterwards.
const SEARCH_POINTS: usize = 1500;
const FIT_POINTS: usize = 10_000;
/// The robot's surface counts as seen where the scan has a point this near [m].
const SEEN_WITHIN: f64 = 0.01;
/// Below this share of the surface nothing was found. Inner sides and the far side are never seen.
const MIN_SEEN_SHARE: f64 = 0.2;
/// What else is tried beside the start: larger and smaller, and turned about each axis [rad].
const SCALES: [f64; 3] = [1.0, 0.87, 1.15];
const TURN: f64 = 0.25;
/// So many starts are followed: every scale, upright and turned either way about each of three axes.
pub const STARTS: usize = SCALES.len() * 7;

/// A scan that lies on the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// From the scan's frame and units to the base frame in metres.
    pub base_from_scan: Similarity3<f64>,
    /// Share of the robot's surface that the scan has.
    pub seen: f64,
    /// Root mean square distance of the scan's points there [m].
    pub rms: f64,
}

/// The scan shows no robot.
#[derive(Debug, thiserror::Error)]
pub enum AlignError {
    /// Too little to begin with.
    #[error(
        "the scan holds {0} points near where the robot should be: check the file, or say with --start where its frame lies"
    )]
    Empty(usize),
    /// Nothing that fits.
    #[error(
        "only {:.0} % of the robot's surface has scanned points within 10 mm: check the joint positions, or give a --start \
         within 15 degrees, 10 cm and 15 % of scale", .0 * 100.0
    )]
    Apart(f64),
}

/// Puts a scan's points onto the robot, beginning with `start` and what is around it. `tried` hears how many of
/// these [`STARTS`] were followed.
///
/// # Errors
/// [`AlignError`] when that leads nowhere.
pub fn align(
    scan: &[Point3<f64>],
    robot: &SurfacePoints,
    start: &Similarity3<f64>,
    tried: impl Fn(usize) + Sync,
) -> Result<Alignment, AlignError> {
    let middle = robot.points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / robot.points.len().max(1) as f64;
    let pair = Pair {
        middle: Point3::from(middle),
        scan,
        robot,
        scanned: Nearest::new(scan.iter().copied()),
        surface: Nearest::new(robot.points.iter().copied()),
    };
    let near = scan.iter().filter(|p| pair.surface.one(&(start * **p), 2.0 * GATE[0]).is_some()).count();
    if near < 100 {
        return Err(AlignError::Empty(near));
    }
    let around = |scale: f64, turn: Vector3<f64>| {
        let about = Translation3::from(middle);
        let change = Similarity3::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(turn), scale);
        about * change * about.inverse() * start
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let turns: Vec<Vector3<f64>> =
        [Vector3::zeros()].into_iter().chain(axes.iter().flat_map(|axis| [axis * TURN, axis * -TURN])).collect();
    let starts: Vec<Similarity3<f64>> =
        SCALES.iter().flat_map(|scale| turns.iter().map(|turn| around(*scale, *turn))).collect();
    let done = AtomicUsize::new(0);
    let best = (starts.par_iter())
        .map(|start| {
            let end = pair.settle(*start, SEARCH_POINTS, &GATE, GATED_STEPS);
            tried(done.fetch_add(1, Ordering::Relaxed) + 1);
            (pair.quality(&end, SEARCH_POINTS).0, end)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let (_, best) = best.ok_or(AlignError::Empty(0))?;
    let base_from_scan = pair.settle(best, FIT_POINTS, &[2.0 * GATE[1], GATE[1]], LAST_STEPS);
    let (seen, rms) = pair.quality(&base_from_scan, FIT_POINTS);
    if seen < MIN_SEEN_SHARE { Err(AlignError::Apart(seen)) } else { Ok(Alignment { base_from_scan, seen, rms }) }
}

struct Pair<'a> {
    /// Of the robot's surface: turning and growing about it hardly shifts it.
    middle: Point3<f64>,
    scan: &'a [Point3<f64>],
    robot: &'a SurfacePoints,
    scanned: Nearest,
    surface: Nearest,
}

/// Of rotation, translation and logarithm of scale.
type Normal = Equations<7>;

impl Pair<'_> {
    /// Steps while the gate closes, the last quarter of them with the smallest.
    fn settle(&self, start: Similarity3<f64>, count: usize, gates: &[f64; 2], steps: usize) -> Similarity3<f64> {
        let mut at = start;
        for step in 0..steps {
            let closed = (step as f64 / (0.75 * steps as f64)).min(1.0);
            let gate = gates[0] * (gates[1] / gates[0]).powf(closed);
            let Some(next) = self.step(&at, count, gate) else { break };
            at = next;
        }
        at
    }

    /// One step of Gauss and Newton. Each pair asks for a shift along the surface's normal.
    fn step(&self, at: &Similarity3<f64>, count: usize, gate: f64) -> Option<Similarity3<f64>> {
        let back = at.inverse();
        let middle = self.middle;
        let add = |mut equations: Normal, (point, number): (Point3<f64>, usize)| {
            let (to, normal) = (self.robot.points[number], self.robot.normals[number]);
            let arm = point - middle;
            let off = normal.dot(&(point - to));
            let by_scale = normal.dot(&arm);
            let slope = slope(&normal, &arm).push(by_scale);
            // Tukey's weight of the distance between the two: pairs at the gate's edge count for nothing.
            let weight = (1.0 - ((point - to).norm() / gate).powi(2)).max(0.0).powi(2);
            equations.add(&slope, off, weight);
            equations
        };
        let from_scan = (every(self.scan.len(), count))
            .filter_map(|i| {
                let point = at * self.scan[i];
                Some((point, self.surface.one(&point, gate)?.1))
            })
            .fold(Equations::zeros, add)
            .reduce(Equations::zeros, std::ops::Add::add);
        let from_robot = (every(self.robot.points.len(), count))
            .filter_map(|number| {
                let (_, i) = self.scanned.one(&(back * self.robot.points[number]), gate / at.scaling())?;
                Some((at * self.scan[i], number))
            })
            .fold(Equations::zeros, add)
            .reduce(Equations::zeros, std::ops::Add::add);
        let equations = from_scan + from_robot;
        let change = equations.step(0.0, 1e-6 * equations.information.trace().max(1e-12))?;
        let turn = UnitQuaternion::from_scaled_axis(change.fixed_rows::<3>(0).into_owned());
        let grow = change[6].clamp(-0.1, 0.1).exp();
        let about = Translation3::from(middle.coords);
        let shift = Translation3::from(change.fixed_rows::<3>(3).into_owned());
        Some(shift * (about * Similarity3::from_parts(Translation3::identity(), turn, grow) * about.inverse() * at))
    }

    /// Share of the surface that is seen, and how far off the scan is there.
    fn quality(&self, at: &Similarity3<f64>, count: usize) -> (f64, f64) {
        let back = at.inverse();
        let numbers = every(self.robot.points.len(), count);
        let asked = numbers.clone().count();
        let offs: Vec<f64> = numbers
            .filter_map(|number| {
                let (to, normal) = (self.robot.points[number], self.robot.normals[number]);
                let (_, i) = self.scanned.one(&(back * to), SEEN_WITHIN / at.scaling())?;
                Some(normal.dot(&(at * self.scan[i] - to)))
            })
            .collect();
        let rms = (offs.iter().map(|off| off * off).sum::<f64>() / offs.len().max(1) as f64).sqrt();
        (offs.len() as f64 / asked.max(1) as f64, rms)
    }
}

/// About `count` numbers below `all`, evenly spread.
fn every(all: usize, count: usize) -> impl ParallelIterator<Item = usize> + Clone {
    (0..all).into_par_iter().step_by(all.div_ceil(count).max(1))
}
