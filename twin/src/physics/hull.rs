//! A convex piece of a body: corners, plane faces, edges, and the inertia of its homogeneous volume. Made once; whoever
//! looks for contacts of many bodies ([`crate::world`]) reads nothing else of it. Own axes, SI.

use super::convert;
use nalgebra::{Matrix3, Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::SharedShape;

/// Directions of edges nearer to each other than this angle are one [rad].
const PARALLEL: f64 = 1e-6;
/// Volume over the cube of the radius below which there is none.
const FLAT: f64 = 1e-9;

/// A convex polyhedron.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    /// Corners [m].
    pub corners: Vec<Point3<f64>>,
    pub faces: Vec<Face>,
    /// Directions of its edges, parallel ones once.
    pub edges: Vec<Vector3<f64>>,
    /// Of a sphere around the origin that holds it [m].
    pub radius: f64,
    /// Volume [m³].
    pub volume: f64,
    /// Centre of the volume [m].
    pub centroid: Point3<f64>,
    /// Inertia of one kilogram spread evenly, about [`Hull::centroid`] [m²].
    pub unit_inertia: Matrix3<f64>,
}

/// A plane face.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Outwards, of length one.
    pub normal: Vector3<f64>,
    /// Distance of its plane from the origin along the normal [m].
    pub offset: f64,
    /// Its corners, counter-clockwise seen from outside.
    pub rim: Vec<u32>,
}

impl Hull {
    /// The convex hull of points; `None` where they span no volume.
    pub fn of(points: &[Point3<f64>]) -> Option<Self> {
        let points: Vec<Vector> = points.iter().map(convert::point).collect();
        let shape = SharedShape::convex_hull(&points)?;
        let hull = shape.as_convex_polyhedron()?;
        let corners: Vec<Point3<f64>> = hull.points().iter().map(|p| convert::to_vector(*p).into()).collect();
        let rims = hull.vertices_adj_to_face();
        let faces = hull.faces().iter().map(|face| {
            let first = face.first_vertex_or_edge as usize;
            let rim = rims[first..first + face.num_vertices_or_edges as usize].to_vec();
            Face::through(&corners, rim, convert::to_vector(face.normal))
        });
        let faces: Vec<Face> = faces.collect();
        let radius = corners.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
        let (volume, centroid, unit_inertia) = mass_properties(&corners, &faces);
        let edges = directions(&faces, &corners);
        let is_solid = volume > FLAT * radius.powi(3);
        is_solid.then_some(Self { corners, faces, edges, radius, volume, centroid, unit_inertia })
    }
}

/// Volume, centroid and the inertia of one kilogram about it, from the tetrahedra between the origin and each face. parry's
/// own exchange the principal moments of a box.
fn mass_properties(corners: &[Point3<f64>], faces: &[Face]) -> (f64, Point3<f64>, Matrix3<f64>) {
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for face in faces {
        let place = |i: usize| corners[face.rim[i] as usize].coords;
        for i in 1..face.rim.len() - 1 {
            let [a, b, c] = [place(0), place(i), place(i + 1)];
            let (sixth, sum) = (a.dot(&b.cross(&c)), a + b + c);
            volume += sixth / 6.0;
            first += sum * (sixth / 24.0);
            let products = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
            second += products * (sixth / 120.0);
        }
    }
    let centroid = first / volume;
    let spread = second / volume - centroid * centroid.transpose();
    (volume, centroid.into(), Matrix3::from_diagonal_element(spread.trace()) - spread)
}

impl Face {
    /// With a normal out of all corners (Newell), which rounding in the hull's triangles does not lean.
    fn through(corners: &[Point3<f64>], rim: Vec<u32>, roughly: Vector3<f64>) -> Self {
        let place = |i: usize| corners[rim[i % rim.len()] as usize].coords;
        let first = place(0);
        let sum: Vector3<f64> =
            (1..rim.len()).map(|i| (place(i) - first).cross(&(place(i + 1) - first))).sum::<Vector3<f64>>();
        let normal = sum.try_normalize(0.0).unwrap_or(roughly);
        let offset = (0..rim.len()).map(|i| place(i).dot(&normal)).sum::<f64>() / rim.len() as f64;
        Self { normal, offset, rim }
    }
}

fn directions(faces: &[Face], corners: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let mut found: Vec<Vector3<f64>> = Vec::new();
    let ends = |face: &Face, i: usize| [i, (i + 1) % face.rim.len()].map(|i| corners[face.rim[i] as usize]);
    let edges = faces.iter().flat_map(|face| (0..face.rim.len()).map(move |i| ends(face, i)));
    for [a, b] in edges {
        let Some(direction) = (b - a).try_normalize(0.0) else { continue };
        if found.iter().all(|other| other.cross(&direction).norm() > PARALLEL) {
            found.push(direction);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_six_faces_of_four_corners_that_look_outwards_and_three_edges() {
        let signs = [-1.0, 1.0];
        let corners = signs.iter().flat_map(|x| signs.iter().flat_map(move |y| signs.map(|z| (*x, *y, z))));
        let points: Vec<Point3<f64>> = corners.map(|(x, y, z)| Point3::new(0.04 * x, 0.03 * y, 0.05 * z)).collect();
        let hull = Hull::of(&points).expect("a box");
        assert_eq!((hull.corners.len(), hull.faces.len()), (8, 6));
        assert!((hull.volume - 0.08 * 0.06 * 0.1).abs() < 1e-12);
        for face in &hull.faces {
            assert_eq!(face.rim.len(), 4);
            let [a, b, c] = [0, 1, 2].map(|i| hull.corners[face.rim[i] as usize]);
            assert!((b - a).cross(&(c - b)).dot(&face.normal) > 0.0 && face.offset > 0.0);
        }
        // The hull's triangles have diagonals, which are no edges of the box.
        let axes = hull.edges.iter().filter(|edge| edge.amax() > 1.0 - 1e-9).count();
        assert_eq!((axes, hull.edges.len()), (3, 3), "{:?}", hull.edges);
        let about_z = (0.08 * 0.08 + 0.06 * 0.06) / 12.0;
        assert!((hull.unit_inertia[(2, 2)] / about_z - 1.0).abs() < 1e-9, "{} {about_z}", hull.unit_inertia);
    }

    #[test]
    fn points_in_a_plane_span_no_volume() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point3::new(x, y, 0.0));
        assert!(Hull::of(&square).is_none());
    }
}
