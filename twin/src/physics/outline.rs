//! What a model file for another simulator needs of the object: its hull, its inertia, and where its base presses.

use super::material::Material;
use super::shape::{CollisionShape, FlatMesh};
use crate::scene::ObjectModel;
use crate::sliding::{BASE, Patch};
use nalgebra::{Matrix3, Point3, Vector2};

/// The object around its geometric centre, object frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Corners of the convex hull [m].
    pub corners: Vec<Point3<f64>>,
    /// Inertia about the centre of mass, along the object's axes [kg m²].
    pub inertia: Matrix3<f64>,
    /// Places on which it stands, in the plane of its base, each with its share of an even pressure [m].
    pub places: Vec<(Vector2<f64>, f64)>,
    /// Height of that plane below the geometric centre [m].
    pub depth: f64,
}

impl Outline {
    /// Of an object of the model's shape in its nominal upright pose.
    ///
    /// # Errors
    /// [`FlatMesh`] when a mesh encloses no volume or has no base to stand on.
    pub fn of<F>(model: &ObjectModel, made_of: &Material<F>) -> Result<Self, FlatMesh> {
        let CollisionShape { corners, unit_inertia, .. } = CollisionShape::new(&model.shape)?;
        let mut inertia = unit_inertia * made_of.parameters.mass;
        inertia[(2, 2)] *= made_of.yaw_inertia_factor;
        let lowest = corners.iter().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
        let base = corners.iter().filter(|corner| corner.z < lowest + BASE).map(|corner| corner.coords.xy());
        let patch = Patch::under(base, model.support).map_err(|_| FlatMesh)?;
        let places = patch.reaching(made_of.pressure_reach).places().collect();
        Ok(Self { corners, inertia, places, depth: -lowest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shipped::shipped;

    #[test]
    fn the_shipped_box_stands_on_its_four_corners_with_a_homogeneous_inertia() {
        let model = ObjectModel::new(&shipped(), None).expect("a box").expect("an object");
        let outline = Outline::of(&model, &Material::nominal(model.parameters())).expect("a box has a volume");
        assert_eq!((outline.corners.len(), outline.places.len(), outline.depth), (8, 4, 0.05));
        assert!(outline.places.iter().all(|(place, share)| {
            (place.x.abs() - 0.04).abs() < 1e-12 && (place.y.abs() - 0.03).abs() < 1e-12 && *share == 0.25
        }));
        let about_z = model.mass / 12.0 * (0.08 * 0.08 + 0.06 * 0.06);
        assert!((outline.inertia[(2, 2)] - about_z).abs() < 1e-12);
    }
}
