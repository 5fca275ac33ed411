//! The convex pieces of a body: boxes, cylinders, meshes that are convex and closed already.

use super::file::{PieceEntry, ShapeEntry};
use crate::physics::Hull;
use crate::scene::{MeshFileError, ObjectShape, open_edges, read_mesh};
use crate::world::{Piece, box_hull, cylinder_hull};
use nalgebra::{Isometry3, Point3, UnitQuaternion};
use std::path::Path;

/// Most corners of a mesh: a step asks each of them.
const MOST_CORNERS: usize = 200;
/// Corners of a convex mesh lie behind each of its faces but for this share of its size.
const CONVEX: f64 = 1e-3;
/// Height of a triangle below which it has no direction, over the distance of the farthest corner.
const SLIVER: f64 = 1e-5;
/// Sizes that a piece can have [m].
const SIZES: std::ops::RangeInclusive<f64> = 1e-4..=100.0;

/// A position and roll, pitch, yaw as a pose.
pub(super) fn pose(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(position.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

impl PieceEntry {
    /// The piece; else the key that is at fault, and what is wrong.
    pub(super) fn piece(&self, folder: &Path) -> Result<Piece, (&'static str, String)> {
        let hull = match (self.shape, &self.mesh) {
            (Some(ShapeEntry::Box), None) => {
                let Some(size) = self.size else {
                    return Err(("shape", "a box needs `size = [x, y, z]` in metres".into()));
                };
                sized("size", &size)?;
                box_hull(size)
            }
            (Some(ShapeEntry::Cylinder), None) => {
                let (Some(radius), Some(length)) = (self.radius, self.length) else {
                    return Err(("shape", "a cylinder needs `radius` and `length` in metres".into()));
                };
                sized("radius", &[radius])?;
                sized("length", &[length])?;
                cylinder_hull(radius, length)
            }
            (None, Some(file)) => Some(mesh(&folder.join(file))?),
            _ => {
                return Err((
                    "piece",
                    "give exactly one of `shape = \"box\"`, `\"cylinder\"` or `mesh = \"file\"`".into(),
                ));
            }
        };
        let hull = hull.ok_or(("piece", "it has no volume; give it one".to_owned()))?;
        Ok(Piece::new(hull, pose(self.position, self.rotation)))
    }
}

fn sized(key: &'static str, values: &[f64]) -> Result<(), (&'static str, String)> {
    match values.iter().find(|value| !SIZES.contains(value)) {
        Some(bad) => Err((key, format!("`{key}` holds {bad}; give metres from {} to {}", SIZES.start(), SIZES.end()))),
        None => Ok(()),
    }
}

fn mesh(path: &Path) -> Result<Hull, (&'static str, String)> {
    let fault = |what: String| Err(("mesh", what));
    let (points, triangles) = match read_mesh(path) {
        Ok(ObjectShape::Mesh { points, triangles }) => (points, triangles),
        Ok(ObjectShape::Box { .. }) => return fault(format!("{}: it holds no triangles", path.display())),
        Err(MeshFileError::Input(error)) => return fault(error.to_string()),
        Err(error) => return fault(error.to_string()),
    };
    // Corners inside a plane face fall away in the hull; with far more the check below takes long.
    if points.len() > MOST_CORNERS * 3 {
        return fault(format!(
            "{} has {} corners; a piece has at most {MOST_CORNERS}: reduce it",
            path.display(),
            points.len()
        ));
    }
    let open = open_edges(&points, &triangles);
    if open > 0 {
        return fault(format!("{} is open at {open} edges; close it, or give pieces that are closed", path.display()));
    }
    let beyond = most_beyond(&points, &triangles);
    if beyond > CONVEX {
        return fault(format!(
            "{} is not convex (a corner stands out of a face by {:.1} % of its size); cut it into convex pieces, for \
             example with CoACD, and list each under `piece`",
            path.display(),
            beyond * 100.0
        ));
    }
    match Hull::of(&points) {
        Some(hull) if hull.corners.len() <= MOST_CORNERS => Ok(hull),
        Some(hull) => fault(format!(
            "{} has {} corners; a piece has at most {MOST_CORNERS}: reduce it",
            path.display(),
            hull.corners.len()
        )),
        None => fault(format!("{} has no volume; give it one", path.display())),
    }
}

/// How far a corner lies in front of a face at most, over the distance of the farthest corner. Slivers are left out: their normals
/// depend on the file's last digit.
fn most_beyond(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let size = points.iter().map(|p| p.coords.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| points[i as usize]);
        let across = (b - a).cross(&(c - a));
        let longest = (b - a).norm().max((c - a).norm()).max((c - b).norm());
        let normal = across.try_normalize(SLIVER * size * longest)?;
        Some(points.iter().map(|p| (p - a).dot(&normal)).fold(0.0, f64::max))
    };
    triangles.iter().filter_map(of).fold(0.0, f64::max) / size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sliver_that_looks_inwards_makes_nothing_hollow() {
        let places = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [0.05, 1e-7, 1e-7]];
        let points = places.map(Point3::from);
        let closed = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert!(most_beyond(&points, &closed) < CONVEX);
        let with_sliver = [closed.as_slice(), &[[0, 1, 4]], &[[0, 4, 1]]].concat();
        assert!(most_beyond(&points, &with_sliver) < CONVEX);
        let hollow = [places[0], places[1], places[2], places[3], [0.02, 0.02, 0.02]].map(Point3::from);
        assert!(most_beyond(&hollow, &[[0, 2, 1], [0, 1, 4], [1, 3, 4], [0, 4, 3], [0, 3, 2], [1, 2, 3]]) > CONVEX);
    }
}
