//! A coloured mesh, and the files that it is written to.

use nalgebra::{Point3, Vector3};
use std::collections::HashMap;
use std::fmt::Write as _;

/// A surface of triangles.
///
/// ```
/// use fusion::Surface;
/// use nalgebra::Point3;
///
/// let corner = |x: f32, y: f32| Point3::new(x, y, 0.0); // m
/// let points = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
/// let surface = Surface { points, colors: vec![[0.5; 3]; 3], triangles: vec![[0, 1, 2]] };
/// assert_eq!(surface.normals()[0].z, 1.0, "counter-clockwise from outside");
/// assert!(surface.without_islands(2).triangles.is_empty());
/// assert!(surface.obj().contains("f 1 2 3"));
/// ```
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

    /// The parts that hang together and have at least so many triangles.
    pub fn without_islands(&self, least: usize) -> Self {
        let mut root: Vec<u32> = (0..self.points.len() as u32).collect();
        let find = |root: &mut Vec<u32>, mut i: u32| {
            while root[i as usize] != i {
                root[i as usize] = root[root[i as usize] as usize];
                i = root[i as usize];
            }
            i
        };
        for [a, b, c] in &self.triangles {
            let first = find(&mut root, *a);
            for other in [*b, *c] {
                let other = find(&mut root, other);
                root[other as usize] = first;
            }
        }
        let mut count = vec![0usize; self.points.len()];
        for triangle in &self.triangles {
            count[find(&mut root, triangle[0]) as usize] += 1;
        }
        let part: Vec<u32> = (0..self.points.len() as u32).map(|i| find(&mut root, i)).collect();
        self.only(|i| count[part[i] as usize] >= least)
    }

    /// Coarser: the corners in each cell of so wide a grid become their mean, with its colour.
    pub fn clustered(&self, cell: f32) -> Self {
        let mut numbers: HashMap<[i32; 3], u32> = HashMap::new();
        let mut sums: Vec<([f32; 6], f32)> = Vec::new();
        let number = |(point, color): (&Point3<f32>, &[f32; 3])| {
            let place = [0, 1, 2].map(|i| (point[i] / cell).floor() as i32);
            let number = *numbers.entry(place).or_insert(sums.len() as u32);
            if number as usize == sums.len() {
                sums.push(([0.0; 6], 0.0));
            }
            let (sum, count) = &mut sums[number as usize];
            (0..3).for_each(|i| (sum[i], sum[i + 3]) = (sum[i] + point[i], sum[i + 3] + color[i]));
            *count += 1.0;
            number
        };
        let cluster: Vec<u32> = self.points.iter().zip(&self.colors).map(number).collect();
        let mean = |(sum, count): &([f32; 6], f32)| sum.map(|value| value / count);
        let means: Vec<[f32; 6]> = sums.iter().map(mean).collect();
        let mut triangles: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.map(|i| cluster[i as usize])).collect();
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        triangles.sort_unstable();
        triangles.dedup();
        let points = means.iter().map(|[x, y, z, ..]| Point3::new(*x, *y, *z)).collect();
        Self { points, colors: means.iter().map(|[.., r, g, b]| [*r, *g, *b]).collect(), triangles }.only(|_| true)
    }

    /// As a Wavefront OBJ; colours stand behind the corners, as MeshLab, Open3D and Blender read them.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// So many squares of 1 cm beside each other along x, from a place on.
    fn strip(x: f32, squares: u32) -> Surface {
        let points = (0..=squares).flat_map(|i| [0.0, 0.01].map(|y| Point3::new(x + 0.01 * i as f32, y, 0.005)));
        let pair = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]];
        let points: Vec<_> = points.collect();
        Surface { colors: vec![[0.5; 3]; points.len()], points, triangles: (0..squares).flat_map(pair).collect() }
    }

    #[test]
    fn islands_go_and_coarser_corners_are_means() {
        let (mut both, island) = (strip(0.001, 40), strip(1.001, 2));
        let first = both.points.len() as u32;
        both.points.extend(&island.points);
        both.colors.extend(&island.colors);
        both.triangles.extend(island.triangles.iter().map(|t| t.map(|i| i + first)));
        let large = both.without_islands(5);
        assert_eq!((large.triangles.len(), large.points.len()), (80, 82));
        assert_eq!(both.without_islands(4).triangles.len(), 84);
        // Two columns of corners in each cell along x, both rows in one or in two along y.
        let coarse = large.clustered(0.02);
        assert!(coarse.points.is_empty(), "a row of single corners has no triangle");
        let coarse = strip(0.001, 40).clustered(0.0099);
        assert!(coarse.normals().iter().all(|normal| normal.z > 0.999) && coarse.points.len() > 70);
    }
}
