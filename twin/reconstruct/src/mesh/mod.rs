//! Triangle meshes: out of a field, checked, reduced, and what follows from their volume.
//!
//! | file | owns |
//! |---|---|
//! | `tetrahedra` | the surface of a field: closed by construction |
//! | `distance` | signed distance of a closed mesh |
//! | `check` | closed, oriented, genus, volume: what a body needs, or why it has it not |
//! | `reduce` | fewer triangles that stay closed |
//! | `solid` | volume, centroid, inertia |
//! | `files` | OBJ and PLY |

mod check;
mod distance;
mod files;
mod reduce;
mod solid;
mod tetrahedra;

pub use check::{Flaw, Topology};
pub use distance::distances;
pub use files::{obj, ply};
pub use reduce::reduced;
pub use solid::Solid;
pub use tetrahedra::{Islands, surface};

use nalgebra::{Point3, Vector3};

/// Corners [m] and triangles, counter-clockwise seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Corners [m].
    pub points: Vec<Point3<f64>>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Places of a triangle's corners.
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|corner| self.points[corner as usize])
    }

    /// A triangle's area [m²].
    pub fn area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// The smallest box along the axes that holds the mesh: low and high corner [m].
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let low = self.points.iter().fold(Vector3::repeat(f64::INFINITY), |m, p| m.inf(&p.coords));
        let high = self.points.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |m, p| m.sup(&p.coords));
        (low.into(), high.into())
    }

    /// Middle of that box [m].
    pub fn middle(&self) -> Point3<f64> {
        let (low, high) = self.bounds();
        nalgebra::center(&low, &high)
    }

    /// The mesh without corners that no triangle has.
    pub(crate) fn compact(self, triangles: impl IntoIterator<Item = [u32; 3]>) -> Self {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut out = Self::default();
        for triangle in triangles {
            out.triangles.push(triangle.map(|corner| {
                let number = &mut number[corner as usize];
                if *number == u32::MAX {
                    *number = out.points.len() as u32;
                    out.points.push(self.points[corner as usize]);
                }
                *number
            }));
        }
        out
    }
}
