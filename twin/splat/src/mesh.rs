//! Triangles with one colour, and the few shapes the cell is made of. Body frame, metres.

use nalgebra::{Point3, UnitQuaternion, Vector3};

/// Facets around a capsule: at 1.3 m the corners stand out by less than half a pixel.
const FACETS: u32 = 24;
/// Rings of each half-sphere.
const RINGS: u32 = 5;

/// A body's surface.
///
/// ```
/// use nalgebra::{Isometry3, Point3};
/// use splat::Mesh;
///
/// let link = Mesh::capsule(&Point3::origin(), &Point3::new(0.0, 0.0, 0.3), 0.05, [200, 200, 200]);
/// let highest = link.points.iter().map(|point| point.z).fold(0.0, f32::max);
/// assert!((highest - 0.35).abs() < 1e-3); // m
/// assert!(link.triangles.iter().flatten().all(|corner| (*corner as usize) < link.points.len()));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Corners [m].
    pub points: Vec<Point3<f32>>,
    /// Indices into `points`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Red, green, blue under full light.
    pub color: [u8; 3],
}

impl Mesh {
    /// From corners and triangles in double precision.
    pub fn new((points, triangles): (Vec<Point3<f64>>, Vec<[u32; 3]>), color: [u8; 3]) -> Self {
        Self { points: points.iter().map(|p| p.cast::<f32>()).collect(), triangles, color }
    }

    /// A rectangle facing +z, around the point (x, y, z), with these half edges.
    pub fn plate(centre: [f32; 3], half: [f32; 2], color: [u8; 3]) -> Self {
        let corner = |sx: f32, sy: f32| Point3::new(centre[0] + sx * half[0], centre[1] + sy * half[1], centre[2]);
        let points = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Self { points, triangles: vec![[0, 1, 2], [0, 2, 3]], color }
    }

    /// All points within `radius` of the segment from `a` to `b`.
    pub fn capsule(a: &Point3<f64>, b: &Point3<f64>, radius: f64, color: [u8; 3]) -> Self {
        let axis = b - a;
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &axis)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let mut points = Vec::new();
        for ring in 0..2 * RINGS {
            // From the pole below `a` to the pole above `b`; the two equators are the ends of the cylinder.
            let (latitude, centre) = if ring < RINGS {
                (f64::from(ring) / f64::from(RINGS - 1) - 1.0, a)
            } else {
                (f64::from(ring - RINGS) / f64::from(RINGS - 1), b)
            };
            let (height, width) = (latitude * std::f64::consts::FRAC_PI_2).sin_cos();
            for step in 0..FACETS {
                let (sin, cos) = (f64::from(step) / f64::from(FACETS) * std::f64::consts::TAU).sin_cos();
                let offset = Vector3::new(width * cos, width * sin, height) * radius;
                points.push((centre + turn * offset).cast::<f32>());
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..2 * RINGS - 1 {
            for step in 0..FACETS {
                let next = (step + 1) % FACETS;
                let [a, b] = [ring * FACETS + step, ring * FACETS + next];
                let [c, d] = [a + FACETS, b + FACETS];
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        Self { points, triangles, color }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capsule_encloses_nearly_its_exact_volume() {
        for b in [Point3::new(0.3, -0.2, 0.5), Point3::new(0.0, 0.0, -0.4)] {
            let mesh = Mesh::capsule(&Point3::origin(), &b, 0.1, [0; 3]);
            let volume: f64 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| mesh.points[i as usize].coords.cast::<f64>());
                    a.dot(&b.cross(&c)) / 6.0
                })
                .sum();
            let exact = std::f64::consts::PI * 0.01 * (b.coords.norm() + 4.0 / 3.0 * 0.1);
            assert!((volume / exact - 1.0).abs() < 0.03, "{volume} instead of {exact}");
        }
    }
}
