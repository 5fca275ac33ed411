//! What follows from the volume inside a closed surface.

use super::Mesh;
use nalgebra::{Matrix3, Point3, Vector3};

/// The body inside a closed mesh, as if of one material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// Volume [m³].
    pub volume: f64,
    /// Its centre [m].
    pub centroid: Point3<f64>,
    /// Inertia of one kilogram spread evenly, about the centroid [m²].
    pub unit_inertia: Matrix3<f64>,
}

impl Solid {
    /// From the tetrahedra between the middle of the mesh's box and each triangle.
    pub fn of(mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds();
        // Near to the mesh: far from it, differences of large numbers would be left.
        let origin = nalgebra::center(&low, &high);
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for number in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(number).map(|corner| corner - origin);
            let (sixth, sum) = (a.dot(&b.cross(&c)), a + b + c);
            volume += sixth / 6.0;
            first += sum * (sixth / 24.0);
            let products = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
            second += products * (sixth / 120.0);
        }
        let centre = first / volume;
        let spread = second / volume - centre * centre.transpose();
        let unit_inertia = Matrix3::from_diagonal_element(spread.trace()) - spread;
        Self { volume, centroid: origin + centre, unit_inertia }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_far_from_the_origin_has_the_volume_and_inertia_of_its_formula() {
        let corner = |i: usize| {
            let sign = |axis: usize| if i >> axis & 1 == 0 { -0.5 } else { 0.5 };
            Point3::new(7.0 + 0.2 * sign(0), 0.4 * sign(1), 0.6 * sign(2))
        };
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let solid = Solid::of(&Mesh { points: (0..8).map(corner).collect(), triangles });
        assert!((solid.volume - 0.048).abs() < 1e-12 && (solid.centroid - Point3::new(7.0, 0.0, 0.0)).norm() < 1e-9);
        let about_z = (0.04 + 0.16) / 12.0;
        assert!((solid.unit_inertia[(2, 2)] / about_z - 1.0).abs() < 1e-9, "{}", solid.unit_inertia);
    }
}
