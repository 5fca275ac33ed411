//! The object's collision shape: a box or the convex hull of a mesh. Object frame, SI.

use super::convert;
use crate::scene::ObjectShape;
use nalgebra::{Matrix3, Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::SharedShape;

/// The mesh encloses no volume, so it cannot be a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the object's mesh is flat or empty; give a mesh that encloses a volume")]
pub struct FlatMesh;

/// Shape and what follows from it alone: made once, shared by clones.
#[derive(Clone)]
pub(super) struct CollisionShape {
    pub(super) shape: SharedShape,
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
        let shape = match outline {
            ObjectShape::Box { half_extents: h } => SharedShape::cuboid(h.x, h.y, h.z),
            ObjectShape::Mesh { points, .. } => {
                let points: Vec<Vector> = points.iter().map(convert::point).collect();
                SharedShape::convex_hull(&points).ok_or(FlatMesh)?
            }
        };
        let mut properties = shape.mass_properties(1.0);
        properties.set_mass(1.0, true);
        let unit_inertia = convert::to_matrix(&properties.reconstruct_inertia_matrix());
        unit_inertia.try_inverse().ok_or(FlatMesh)?;
        let corners = hull_corners(&shape);
        Ok(Self { shape, bounding_radius: outline.bounding_radius(), corners, unit_inertia })
    }
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
