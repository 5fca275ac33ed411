//! A coloured mesh, and the files that it is written to.

use nalgebra::{Point3, Vector3};
use std::fmt::Write as _;

/// A surface of triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// Corners [m].
    pub points: Vec<Point3<f32>>,
    /// Red, green, blue of each corner, 0 to 1.
    pub colors: Vec<[f32; 3]>,
    /// Indices into `points`, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Outward normals of the corners, of length 1, from the triangles around each by their area; 0 for a corner of none.
    #[must_use]
    pub fn normals(&self) -> Vec<Vector3<f32>> {
        let mut normals = vec![Vector3::zeros(); self.points.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.points[i as usize]);
            let normal = (b - a).cross(&(c - a));
            triangle.iter().for_each(|i| normals[*i as usize] += normal);
        }
        normals.iter_mut().for_each(|normal| *normal = normal.try_normalize(0.0).unwrap_or_default());
        normals
    }

    /// The triangles all of whose corners `keep` wants, with their corners.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut part = Self::default();
        let mut numbers = vec![u32::MAX; self.points.len()];
        for triangle in self.triangles.iter().filter(|triangle| triangle.iter().all(|i| keep(*i as usize))) {
            part.triangles.push(triangle.map(|i| {
                let number = &mut numbers[i as usize];
                if *number == u32::MAX {
                    *number = part.points.len() as u32;
                    part.points.push(self.points[i as usize]);
                    part.colors.push(self.colors[i as usize]);
                }
                *number
            }));
        }
        part
    }

    /// As a Wavefront OBJ; colours stand behind the corners, as MeshLab, Open3D and Blender read them.
    #[must_use]
    pub fn obj(&self) -> String {
        let mut out = String::new();
        for (p, [r, g, b]) in self.points.iter().zip(&self.colors) {
            // Writing into a string cannot fail.
            let _ = writeln!(out, "v {} {} {} {r:.4} {g:.4} {b:.4}", p.x, p.y, p.z);
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        out
    }
}
