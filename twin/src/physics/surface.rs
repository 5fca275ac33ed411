//! The object's surface as it is drawn, hollows and all, asked how far a point is from it. Object frame, SI.

use super::convert;
use super::shape::distance_from_box;
use crate::scene::ObjectShape;
use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use std::sync::Arc;

/// A surface; clones share a mesh.
#[derive(Clone)]
pub enum Surface {
    /// A box by half its edge lengths [m].
    Box(Vector3<f64>),
    Mesh(Arc<TriMesh>),
}

impl Surface {
    /// `None` when a mesh has no triangles.
    pub fn new(shape: &ObjectShape) -> Option<Self> {
        match shape {
            ObjectShape::Box { half_extents } => Some(Self::Box(*half_extents)),
            ObjectShape::Mesh { points, triangles } => {
                let points: Vec<Vector> = points.iter().map(convert::point).collect();
                TriMesh::new(points, triangles.clone()).ok().map(|mesh| Self::Mesh(Arc::new(mesh)))
            }
        }
    }

    /// From a point to the closest one of the surface, inside and outside alike [m].
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Box(half) => distance_from_box(half, &point.coords).0.abs(),
            Self::Mesh(mesh) => mesh.distance_to_local_point(convert::point(point), false).abs(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_and_its_triangles_are_equally_far_from_any_point() {
        let shape = ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) };
        let (points, triangles) = shape.triangles();
        let boxed = Surface::new(&shape).expect("a box");
        let mesh = Surface::new(&ObjectShape::Mesh { points, triangles }).expect("triangles");
        for i in 0..4000u32 {
            // A lattice that no symmetry of the box meets.
            let share = |step: f64| ((f64::from(i) * step).fract() - 0.5) * 0.15;
            let point = Point3::new(share(0.618_034), share(0.414_214), share(0.732_051));
            let (a, b) = (boxed.distance(&point), mesh.distance(&point));
            assert!(a >= 0.0 && (a - b).abs() < 1e-12, "{point}: {a} {b}");
        }
    }

    #[test]
    fn corners_without_triangles_are_no_surface() {
        assert!(Surface::new(&ObjectShape::Mesh { points: vec![Point3::origin()], triangles: Vec::new() }).is_none());
    }
}
