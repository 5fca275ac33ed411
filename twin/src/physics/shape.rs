//! The object's collision shape: a box or the convex hull of a mesh. Object frame, SI.

use super::convert;
use super::hull::Hull;
use crate::scene::ObjectShape;
use nalgebra::{Matrix3, Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::SharedShape;

/// The mesh encloses no volume, so it cannot be a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the object's mesh has no volume; give a mesh that encloses a volume as `object.mesh` in cell.toml")]
pub struct FlatMesh;

/// Corners of a mesh that are all asked for, and directions in which the outermost are looked for where it has more.
const MOST_POINTS: usize = 500;
const DIRECTIONS: usize = 300;
/// Directions of edges of a hull among many bodies, and directions in which the outermost corners of one with more are kept.
const MOST_EDGES: usize = 64;
const FEW_DIRECTIONS: usize = 24;

/// Shape and what follows from it alone: made once, shared by clones.
#[derive(Clone)]
pub(super) struct CollisionShape {
    shape: SharedShape,
    /// Half the edge lengths of a box; `None` for a hull.
    pub(super) half_extents: Option<Vector3<f64>>,
    /// Radius of a sphere around the geometric centre that holds the object [m].
    pub(super) bounding_radius: f64,
    /// Corners of the convex hull.
    pub(super) corners: Vec<Point3<f64>>,
    /// Inertia of the homogeneous body about its own centre of mass, for one kilogram [m²].
    pub(super) unit_inertia: Matrix3<f64>,
}

impl CollisionShape {
    /// # Errors
    /// [`FlatMesh`] when there is no convex hull.
    pub(super) fn new(outline: &ObjectShape) -> Result<Self, FlatMesh> {
        let (shape, unit_inertia) = match outline {
            ObjectShape::Box { half_extents: h } => {
                let square = h.component_mul(h);
                let moments = (Vector3::repeat(square.sum()) - square) / 3.0;
                (SharedShape::cuboid(h.x, h.y, h.z), Matrix3::from_diagonal(&moments))
            }
            ObjectShape::Mesh { points, .. } => {
                let points = outermost(points);
                let shape = SharedShape::convex_hull(&points.iter().map(convert::point).collect::<Vec<_>>());
                (shape.ok_or(FlatMesh)?, Hull::of(&points).ok_or(FlatMesh)?.unit_inertia)
            }
        };
        unit_inertia.try_inverse().ok_or(FlatMesh)?;
        let corners = hull_corners(&shape);
        let half_extents = shape.as_cuboid().map(|cuboid| convert::to_vector(cuboid.half_extents));
        Ok(Self { shape, half_extents, bounding_radius: outline.bounding_radius(), corners, unit_inertia })
    }
}

/// The corners that lie farthest in one of many directions; all of them where they are few. A scan's million corners make
/// a hull of thousands, of which a step would have to ask each one.
fn outermost(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    let kept = farthest_in(points, DIRECTIONS);
    tracing::warn!("the object's mesh has {} corners; the physics takes the {} outermost", points.len(), kept.len());
    kept
}

/// The corners that lie farthest in so many directions, spread evenly over the sphere along a golden spiral.
fn farthest_in(points: &[Point3<f64>], directions: usize) -> Vec<Point3<f64>> {
    let farthest = |direction: Vector3<f64>| {
        points.iter().max_by(|a, b| direction.dot(&a.coords).total_cmp(&direction.dot(&b.coords))).copied()
    };
    let spiral = (0..directions).map(|i| {
        let height = 1.0 - (2 * i + 1) as f64 / directions as f64;
        let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
        let across = (1.0 - height * height).sqrt();
        Vector3::new(across * cos, across * sin, height)
    });
    let mut kept: Vec<Point3<f64>> = spiral.filter_map(farthest).collect();
    kept.sort_by(|a, b| (a.x, a.y, a.z).partial_cmp(&(b.x, b.y, b.z)).unwrap_or(std::cmp::Ordering::Equal));
    kept.dedup();
    kept
}

impl CollisionShape {
    /// Its hull for a world of many bodies, of no more directions of edges than that can ask.
    pub(super) fn hull(&self) -> Option<Hull> {
        let whole = Hull::of(&self.corners)?;
        if whole.edges.len() <= MOST_EDGES {
            return Some(whole);
        }
        Hull::of(&farthest_in(&self.corners, FEW_DIRECTIONS))
    }

    /// Distance of a point from the surface (negative inside), the surface's nearest point, and the outward direction.
    #[inline]
    pub(super) fn signed_distance(&self, point: &Point3<f64>) -> (f64, Point3<f64>, Vector3<f64>) {
        match &self.half_extents {
            Some(half) => distance_from_box(half, &point.coords),
            None => self.distance_from_hull(point),
        }
    }

    fn distance_from_hull(&self, point: &Point3<f64>) -> (f64, Point3<f64>, Vector3<f64>) {
        let projection = self.shape.project_local_point(convert::point(point), false);
        let surface = Point3::from(convert::to_vector(projection.point));
        let outwards = if projection.is_inside { surface - point } else { point - surface };
        let distance = outwards.norm();
        let unit = if distance > 1e-12 { outwards / distance } else { Vector3::z() };
        (if projection.is_inside { -distance } else { distance }, surface, unit)
    }
}

/// The same for a box.
#[inline]
pub(super) fn distance_from_box(half: &Vector3<f64>, p: &Vector3<f64>) -> (f64, Point3<f64>, Vector3<f64>) {
    let nearest = Vector3::new(p.x.clamp(-half.x, half.x), p.y.clamp(-half.y, half.y), p.z.clamp(-half.z, half.z));
    let outwards = p - nearest;
    let distance = outwards.norm();
    if distance > 1e-12 {
        return (distance, nearest.into(), outwards / distance);
    }
    let beyond = p.abs() - half;
    let axis = beyond.imax();
    let (mut surface, mut unit) = (*p, Vector3::zeros());
    let side = if p[axis] < 0.0 { -1.0 } else { 1.0 };
    (surface[axis], unit[axis]) = (side * half[axis], side);
    (beyond[axis], surface.into(), unit)
}

/// Corners of a cuboid or convex hull.
fn hull_corners(shape: &SharedShape) -> Vec<Point3<f64>> {
    let corner = |p: &Vector| Point3::from(convert::to_vector(*p));
    match (shape.as_cuboid(), shape.as_convex_polyhedron()) {
        (Some(cuboid), _) => {
            let h: Vector3<f64> = convert::to_vector(cuboid.half_extents);
            let sign = |i: u32, axis: u32| if i >> axis & 1 == 0 { -1.0 } else { 1.0 };
            (0..8).map(|i| Point3::new(sign(i, 0) * h.x, sign(i, 1) * h.y, sign(i, 2) * h.z)).collect()
        }
        (None, Some(hull)) => hull.points().iter().map(corner).collect(),
        (None, None) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_of_a_million_faces_keeps_its_size_with_a_few_hundred_corners() {
        let points: Vec<Point3<f64>> = (0..500_000)
            .map(|i| {
                let height = 1.0 - 2.0 * (f64::from(i) + 0.5) / 500_000.0;
                let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
                Point3::from(
                    Vector3::new(
                        (1.0f64 - height * height).sqrt() * cos,
                        (1.0f64 - height * height).sqrt() * sin,
                        height,
                    ) * 0.05,
                )
            })
            .collect();
        let ball = CollisionShape::new(&ObjectShape::Mesh { points, triangles: Vec::new() }).expect("a body");
        assert!(ball.corners.len() <= DIRECTIONS, "{}", ball.corners.len());
        let inertia = 0.4 * 0.05 * 0.05;
        assert!((ball.unit_inertia[(0, 0)] / inertia - 1.0).abs() < 0.03, "{}", ball.unit_inertia);
    }

    #[test]
    fn the_inertia_of_a_box_is_that_of_its_mesh() {
        let shape = ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) };
        let (points, triangles) = shape.triangles();
        let [boxed, mesh] =
            [shape, ObjectShape::Mesh { points, triangles }].map(|s| CollisionShape::new(&s).expect("it"));
        let off = (boxed.unit_inertia - mesh.unit_inertia).amax();
        assert!(off < 1e-9, "{} {}", boxed.unit_inertia, mesh.unit_inertia);
    }

    #[test]
    fn the_distance_from_a_box_is_the_same_as_that_of_its_hull() {
        let half = Vector3::new(0.04, 0.03, 0.05);
        let boxed = CollisionShape::new(&ObjectShape::Box { half_extents: half }).expect("a box");
        for i in 0..4000u32 {
            // A lattice that no symmetry of the box meets.
            let share = |step: f64| ((f64::from(i) * step).fract() - 0.5) * 0.15;
            let point = Point3::new(share(0.618_034), share(0.414_214), share(0.732_051));
            let (a, surface_a, unit_a) = boxed.signed_distance(&point);
            let (b, surface_b, unit_b) = boxed.distance_from_hull(&point);
            assert!((a - b).abs() < 1e-12, "{point}: {a} {b}");
            assert!((surface_a - surface_b).norm() < 1e-9 && (unit_a - unit_b).norm() < 1e-6, "{point}");
        }
    }
}
