//! One state of an object as the search needs it: points spread evenly over its surface, and the signed distance around it.

use crate::field::Field;
use crate::mesh::{Mesh, distances};
use nalgebra::{Isometry3, Point3, Vector3};
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};

/// Nodes of the field.
const NODES: f64 = 1.0e6;
/// Nodes between the mesh and the rim of the box.
const MARGIN: usize = 6;
/// Points on the surface.
const SAMPLES: usize = 5000;
/// Half of the stretch over which the distance's slope is taken for a normal [voxel].
const STRETCH: f64 = 1.5;
/// Surfaces whose normals agree less (cosine) are not the same.
const ALIKE: f64 = 0.6;

/// A point of the surface and the direction out of the object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) point: Point3<f64>,
    pub(super) normal: Vector3<f64>,
    /// Whether it moves with the part, once that is known.
    pub(super) moves: Option<bool>,
}

/// Where a point of one state is found in the other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Place {
    /// On the surface: its distance [m] and that distance's slope.
    On(f64, Vector3<f64>),
    /// Inside, where nothing can be seen, or where two surfaces touch.
    Hidden,
    /// In the open, where a surface would have been seen.
    Free,
}

#[derive(Debug, Clone)]
pub(super) struct Body {
    pub(super) mesh: Mesh,
    pub(super) field: Field<f32>,
    /// In an order drawn by lot: the first so many are spread evenly too.
    pub(super) samples: Vec<Sample>,
    /// Middle of its box [m].
    pub(super) middle: Point3<f64>,
    /// The box's diagonal [m].
    pub(super) size: f64,
}

impl Body {
    pub(super) fn of(mesh: Mesh) -> Self {
        let field = distances(&mesh, NODES, MARGIN);
        let (low, high) = mesh.bounds();
        let points = spread(&mesh, SAMPLES);
        let samples =
            points.into_iter().map(|point| Sample { point, normal: normal(&field, &point), moves: None }).collect();
        Self { mesh, field, samples, middle: nalgebra::center(&low, &high), size: (high - low).norm() }
    }

    /// Where a point with a normal, both in this state's frame, lies.
    pub(super) fn place(&self, point: &Point3<f64>, normal: &Vector3<f64>, tolerance: f64) -> Place {
        let Some((distance, slope)) = self.field.slope_at(point) else { return Place::Free };
        if distance > tolerance {
            return Place::Free;
        }
        if distance < -tolerance || slope.dot(normal) < ALIKE * slope.norm() {
            return Place::Hidden;
        }
        Place::On(distance, slope)
    }

    pub(super) fn place_of(&self, sample: &Sample, pose: &Isometry3<f64>, tolerance: f64) -> Place {
        self.place(&(pose * sample.point), &(pose.rotation * sample.normal), tolerance)
    }
}

/// The direction in which the distance grows around a place.
pub(super) fn normal(field: &Field<f32>, point: &Point3<f64>) -> Vector3<f64> {
    let step = STRETCH * field.grid.voxel;
    let slope = Vector3::from_fn(|axis, _| {
        let beside = |sign: f64| field.distance_at(&(point + Vector3::ith(axis, sign * step))).unwrap_or(0.0);
        beside(1.0) - beside(-1.0)
    });
    slope.try_normalize(1e-12).unwrap_or_else(Vector3::z)
}

/// Points spread evenly over a mesh, always the same ones.
fn spread(mesh: &Mesh, count: usize) -> Vec<Point3<f64>> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    let areas: Vec<f64> = (0..mesh.triangles.len()).map(|number| mesh.area(number)).collect();
    let step = areas.iter().sum::<f64>() / count as f64;
    let (mut points, mut left) = (Vec::with_capacity(count), step * random.random_range(0.0..1.0));
    for (number, area) in areas.iter().enumerate() {
        left -= area;
        while left < 0.0 {
            let (mut u, mut v) = (random.random_range(0.0..1.0), random.random_range(0.0..1.0));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = mesh.corners(number);
            points.push(a + (b - a) * u + (c - a) * v);
            left += step;
        }
    }
    points.shuffle(&mut random);
    points
}
