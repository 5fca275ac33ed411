//! The paper's way to a camera's pose: a particle swarm over six numbers, on the share of wrong pixels.

use super::frame::Frame;
use super::shape::Shape;
use inference::estimate::problem::Unknown;
use inference::estimate::{Swarm, search as estimate_search};
use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use twin::pose_fit::moved;

/// How far from the truth a start may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Angle between the camera's axes and the true ones [rad].
    pub angle: f64,
    /// Distance between the camera and its true place [m].
    pub distance: f64,
}

/// A pose that was searched for.
#[derive(Debug, Clone, PartialEq)]
pub struct Searched {
    pub camera_from_base: Isometry3<f64>,
    pub loss: f64,
    pub evaluations: usize,
}

/// The six numbers of [`moved`], bounded, and the point they turn about.
#[derive(Debug)]
pub struct Moves {
    start: Isometry3<f64>,
    pivot: Point3<f64>,
    unknowns: Vec<Unknown>,
}

impl Moves {
    /// All poses that `start` may be mistaken for.
    pub fn new(frames: &[Frame], start: &Isometry3<f64>, reach: &Reach) -> Self {
        let parts: Vec<Isometry3<f64>> = frames.iter().flat_map(|frame| frame.placed(start)).collect();
        let sum = parts.iter().fold(Vector3::zeros(), |sum, part| sum + part.translation.vector);
        let pivot = Point3::from(sum / parts.len().max(1) as f64);
        // A camera turned by an angle shifts what it sees by the angle times the distance.
        let sideways = reach.distance + reach.angle * pivot.coords.norm();
        let widths = [reach.angle, reach.angle, reach.angle, sideways, sideways, reach.distance + 0.1 * sideways];
        let unknown = |(number, width): (usize, &f64)| Unknown {
            name: format!("move {number}"),
            start: 0.0,
            lower: -width,
            upper: *width,
            step: 1e-4,
        };
        let unknowns = widths.iter().enumerate().map(unknown).collect();
        Self { start: *start, pivot, unknowns }
    }

    /// The pose that the numbers stand for.
    pub fn pose(&self, numbers: &[f64]) -> Isometry3<f64> {
        moved(&self.start, &self.pivot, &Vector6::from_column_slice(numbers))
    }

    /// The paper's way: a particle swarm on the share of wrong pixels. `done` hears how many of the losses are computed.
    pub fn swarm(
        &self,
        frames: &[Frame],
        shape: &Shape,
        (evaluations, seed): (usize, u64),
        done: impl FnMut(usize),
    ) -> Searched {
        let loss = |pose: &Isometry3<f64>| mean(frames.iter().map(|frame| frame.wrong(Frame::FINEST, shape, pose)));
        let search = Swarm::new(&estimate_search::start(&self.unknowns), seed);
        self.minimise(search, evaluations, loss, done)
    }

    fn minimise(
        &self,
        mut search: impl estimate_search::Search,
        evaluations: usize,
        loss: impl Fn(&Isometry3<f64>) -> f64 + Sync,
        mut done: impl FnMut(usize),
    ) -> Searched {
        let cost = |numbers: &[f64]| loss(&self.pose(numbers));
        let found = estimate_search::minimise(&mut search, &self.unknowns, evaluations, &[], cost, |_, found| {
            done(found.evaluations);
            true
        });
        Searched { camera_from_base: self.pose(&found.numbers), loss: found.cost, evaluations: found.evaluations }
    }
}

/// The mean; 0 of nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / f64::max(count, 1.0)
}
