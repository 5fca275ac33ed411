//! The robot's surface made ready for outlines: corners joined, edges with the triangles at either side of them, and a
//! coarse copy for searches. Part frames, metres.

use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::HashMap;
use twin::arm::Joints;
use twin::render::{Mesh, RobotSurface};

/// Corners nearer than this are one [m].
const SAME_CORNER: f32 = 2e-6;
/// Grid of the coarse copy [m]: at 1.3 m and 150 pixels of focal length a pixel and a half.
const COARSE: f32 = 0.012;

/// All parts of the robot.
#[derive(Debug)]
pub struct Shape {
    surface: RobotSurface,
    /// As fine as the meshes are.
    pub fine: Vec<Part>,
    /// Corners moved together in a grid.
    pub coarse: Vec<Part>,
}

#[derive(Debug)]
pub struct Part {
    /// Its triangles, for the rasteriser.
    pub mesh: Mesh,
    /// Corners [m].
    pub corners: Vec<Point3<f64>>,
    /// Outward normals of the triangles, not normalised, and one corner of each.
    pub planes: Vec<(Vector3<f64>, u32)>,
    pub edges: Vec<Edge>,
    /// The link it moves with.
    pub link: usize,
}

/// An edge of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    pub ends: [u32; 2],
    /// The triangle on one side, and its third corner.
    pub one: (u32, u32),
    /// The triangle on the other side; `None` at the border of an open surface.
    pub other: Option<(u32, u32)>,
}

impl Shape {
    /// From the robot's surface.
    pub fn new(surface: RobotSurface) -> Self {
        let links = surface.links();
        let parts = |grid: f32| -> Vec<Part> {
            surface.parts().iter().zip(&links).map(|(mesh, link)| Part::new(mesh, grid, *link)).collect()
        };
        let (fine, coarse) = (parts(SAME_CORNER), parts(COARSE));
        Self { surface, fine, coarse }
    }

    /// Every part's frame in the base at joint positions `q` [rad], in the order of the parts.
    pub fn place(&self, q: &Joints) -> Vec<Isometry3<f64>> {
        let mut out = vec![Isometry3::identity(); self.fine.len()];
        self.surface.for_each(q, |part, frame| out[part] = frame);
        out
    }

    pub fn surface(&self) -> &RobotSurface {
        &self.surface
    }
}

impl Part {
    fn new(mesh: &Mesh, grid: f32, link: usize) -> Self {
        let (points, triangles) = joined(mesh, grid);
        let corners: Vec<Point3<f64>> = points.iter().map(|p| p.cast()).collect();
        let planes = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            ((b - a).cross(&(c - a)), t[0])
        });
        let planes = planes.collect();
        let mut edges: Vec<Edge> = Vec::new();
        let mut known: HashMap<[u32; 2], usize> = HashMap::new();
        for (number, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                let [a, b, third] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                let ends = [a.min(b), a.max(b)];
                let side = (number as u32, third);
                match known.get(&ends) {
                    Some(&edge) if edges[edge].other.is_none() => edges[edge].other = Some(side),
                    _ => {
                        known.insert(ends, edges.len());
                        edges.push(Edge { ends, one: side, other: None });
                    }
                }
            }
        }
        Self { mesh: Mesh { points, triangles, color: mesh.color }, corners, planes, edges, link }
    }
}

/// Corners within a cell of the grid become their mean; triangles that vanish by that are left out.
fn joined(mesh: &Mesh, grid: f32) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
    let mut cells: HashMap<[i32; 3], u32> = HashMap::new();
    let mut sums: Vec<(Vector3<f32>, f32)> = Vec::new();
    let cell = |p: &Point3<f32>| [p.x, p.y, p.z].map(|v| (v / grid).round() as i32);
    let numbers: Vec<u32> = (mesh.points.iter())
        .map(|p| {
            let number = *cells.entry(cell(p)).or_insert_with(|| {
                sums.push((Vector3::zeros(), 0.0));
                sums.len() as u32 - 1
            });
            sums[number as usize].0 += p.coords;
            sums[number as usize].1 += 1.0;
            number
        })
        .collect();
    let triangles = (mesh.triangles.iter().map(|t| t.map(|i| numbers[i as usize])))
        .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
        .collect();
    (sums.iter().map(|(sum, count)| Point3::from(sum / *count)).collect(), triangles)
}
