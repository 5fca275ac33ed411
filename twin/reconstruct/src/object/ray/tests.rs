//! The derivatives of everything that a ray sees against finite differences.

use super::*;
use nalgebra::{Point3, Rotation3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

const NODES: usize = 14;
const RAYS: usize = 400;
const PIVOT: [f64; 3] = [6.5; 3];

/// A dented ball in colours that change from node to node, and rays that meet it from all sides.
struct Problem {
    grid: Grid,
    band: Band,
    distance: Vec<f64>,
    colour: Vec<[f64; 3]>,
    rays: Vec<(Ray<f64>, Target<f64>, f64)>,
    /// Shift [step] and turn [rad] of all rays.
    pose: [f64; 6],
}

#[derive(Default)]
struct Sums {
    distance: Vec<f64>,
    colour: Vec<[f64; 3]>,
}

impl Receiver<f64> for Sums {
    fn distance(&mut self, node: usize, value: f64) {
        self.distance[node] += value;
    }

    fn colour(&mut self, node: usize, value: [f64; 3]) {
        (0..3).for_each(|c| self.colour[node][c] += value[c]);
    }
}

impl Problem {
    fn new() -> Self {
        let mut random = Pcg64::seed_from_u64(5);
        let grid = Grid { dims: [NODES; 3], origin: Point3::origin(), voxel: 1.0 };
        let distance: Vec<f64> = (0..grid.len())
            .map(|i| {
                (grid.position(grid.node(i)) - Point3::from(PIVOT)).norm() - 3.8 + random.random_range(-0.25..0.25)
            })
            .collect();
        let colour = (0..grid.len()).map(|_| [(); 3].map(|()| random.random_range(0.0..1.0))).collect();
        let near: Vec<f32> = distance.iter().map(|d| *d as f32).collect();
        let band = Band::new(&grid, &near, 4.0);
        let mut vector = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0f64));
        let rays = (0..RAYS).map(|number| {
            let (from, towards) = (vector().normalize() * 25.0, vector() * 4.2);
            let direction = (towards - from).normalize();
            let origin = (from + Vector3::from(PIVOT)).into();
            let target = Target {
                colour: (number % 3 != 0).then_some([0.3, 0.6, 0.5]),
                mask: if number % 5 == 0 { 0.0 } else { 1.0 },
                depth: (number % 2 == 0).then_some(20.0 + towards.x),
            };
            (Ray { origin, direction: direction.into(), axial: 0.9 }, target, 0.37)
        });
        let rays = rays.collect();
        Self { grid, band, distance, colour, rays, pose: [0.0; 6] }
    }

    fn moved(&self, ray: &Ray<f64>) -> Ray<f64> {
        let turn = Rotation3::new(Vector3::new(self.pose[3], self.pose[4], self.pose[5]));
        let (pivot, shift) = (Vector3::from(PIVOT), Vector3::new(self.pose[0], self.pose[1], self.pose[2]));
        let origin = turn * (Vector3::from(ray.origin) - pivot) + pivot + shift;
        Ray { origin: origin.into(), direction: (turn * Vector3::from(ray.direction)).into(), axial: ray.axial }
    }

    /// Loss and derivatives by the pose.
    fn loss(&self, mut into: Option<&mut Sums>) -> (f64, [f64; 6]) {
        let medium = Medium {
            grid: &self.grid,
            band: &self.band,
            distance: &self.distance,
            colour: &self.colour,
            steepness: 2.5,
            pace: 0.7,
        };
        let weights = Weights { colour: 1.0, mask: 0.3, depth: 0.2, depth_limit: 50.0 };
        let (mut tracer, mut sum, mut pose) = (Tracer::new(), 0.0, [0.0; 6]);
        let mut nowhere = Sums { distance: vec![0.0; self.grid.len()], colour: vec![[0.0; 3]; self.grid.len()] };
        for (ray, target, jitter) in &self.rays {
            let ray = self.moved(ray);
            let sight = tracer.see(&medium, &ray, *jitter);
            let into = into.as_deref_mut().unwrap_or(&mut nowhere);
            let (loss, by_pose) = tracer.learn(&medium, &ray, &sight, (target, &weights), PIVOT, into);
            sum += loss;
            (0..6).for_each(|i| pose[i] += by_pose[i]);
        }
        (sum, pose)
    }

    fn entry(&mut self, number: usize) -> &mut f64 {
        let count = self.grid.len();
        match number {
            n if n < count => &mut self.distance[n],
            n if n < 4 * count => &mut self.colour[(n - count) / 3][(n - count) % 3],
            n => &mut self.pose[n - 4 * count],
        }
    }

    /// The slope of the loss along one number.
    fn difference(&mut self, number: usize) -> f64 {
        // Along a pose a step moves all rays, some of them into another cell, where the slope is another.
        let step = if number < 4 * self.grid.len() { 1e-6 } else { 3e-8 };
        let before = *self.entry(number);
        let mut at = |value: f64| {
            *self.entry(number) = value;
            self.loss(None).0
        };
        let slope = (at(before + step) - at(before - step)) / (2.0 * step);
        *self.entry(number) = before;
        slope
    }
}

#[test]
fn a_thousand_derivatives_agree_with_finite_differences() {
    let (mut problem, count) = (Problem::new(), 1000);
    let nodes = problem.grid.len();
    let mut sums = Sums { distance: vec![0.0; nodes], colour: vec![[0.0; 3]; nodes] };
    let (_, pose) = problem.loss(Some(&mut sums));
    let all: Vec<f64> =
        sums.distance.iter().copied().chain(sums.colour.iter().flatten().copied()).chain(pose).collect();
    let largest = all[..4 * nodes].iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let seen: Vec<usize> = (0..4 * nodes).filter(|n| all[*n].abs() > 1e-4 * largest).collect();
    let mut random = Pcg64::seed_from_u64(9);
    let mut chosen: Vec<usize> = (0..count).map(|_| seen[random.random_range(0..seen.len())]).collect();
    chosen.extend(4 * nodes..4 * nodes + 6);
    let mut wrong = Vec::new();
    for number in chosen {
        let (by_hand, difference) = (all[number], problem.difference(number));
        let off = (by_hand - difference).abs() / difference.abs().max(1e-3 * largest);
        if off > 1e-4 {
            wrong.push((number, by_hand, difference));
        }
    }
    assert!(wrong.is_empty(), "{} of {count}: {:?}", wrong.len(), &wrong[..wrong.len().min(5)]);
}

#[test]
fn depth_of_a_thin_wall_is_where_the_ray_enters_it_and_not_towards_what_stands_behind() {
    let grid = Grid { dims: [40, 8, 8], origin: Point3::origin(), voxel: 1.0 };
    // Walls of two steps from 10.3 and of six from 30.
    let distance = |x: f64| ((x - 11.3).abs() - 1.0).min((x - 33.0).abs() - 3.0);
    let distance: Vec<f64> = (0..grid.len()).map(|i| distance(grid.position(grid.node(i)).x)).collect();
    let near: Vec<f32> = distance.iter().map(|d| *d as f32).collect();
    let band = Band::new(&grid, &near, 40.0);
    let colour = vec![[0.5; 3]; grid.len()];
    let medium = Medium { grid: &grid, band: &band, distance: &distance, colour: &colour, steepness: 2.0, pace: 0.7 };
    let along = |direction: Vector3<f64>| {
        let direction = direction.normalize();
        let origin = Point3::new(10.3, 3.5, 3.5) - direction * 6.0;
        Tracer::new().see(&medium, &Ray { origin: origin.coords.into(), direction: direction.into(), axial: 0.5 }, 0.2)
    };
    for (direction, expected) in
        [(Vector3::x(), 3.0), (Vector3::new(1.0, 0.2, 0.1), 3.0), (Vector3::new(0.05, 1.0, 0.0), 0.0)]
    {
        let sight = along(direction);
        assert!((sight.depth - expected).abs() < 1e-9, "{direction:?}: {sight:?}");
    }
}

#[test]
fn a_ray_that_runs_along_a_wall_sees_what_stands_at_its_end() {
    let grid = Grid { dims: [150, 16, 8], origin: Point3::origin(), voxel: 1.0 };
    let distance = |p: Point3<f64>| (p.y - 3.0).min(140.0 - p.x);
    let distance: Vec<f64> = (0..grid.len()).map(|i| distance(grid.position(grid.node(i)))).collect();
    let near: Vec<f32> = distance.iter().map(|d| *d as f32).collect();
    let (colour, steepness) = (vec![[0.5; 3]; grid.len()], 8.0);
    let band = Band::new(&grid, &near, reach(8.0));
    let medium = Medium { grid: &grid, band: &band, distance: &distance, colour: &colour, steepness, pace: 0.35 };
    for above in [1.2, 3.0, 6.0] {
        let ray = Ray { origin: [-5.0, 3.0 + above, 3.5], direction: [1.0, 0.0, 0.0], axial: 1.0 };
        let sight = Tracer::new().see(&medium, &ray, 0.5);
        assert!((sight.depth - 145.0).abs() < 1e-9 && sight.opacity > 0.99, "{above}: {sight:?}");
        assert!((sight.colour[0] - 0.5).abs() < 0.01, "{above}: {sight:?}");
    }
}
