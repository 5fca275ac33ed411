//! The cloud that a surface begins as: a disc on every vertex, as wide as the vertices are apart.

use crate::cloud::{Splat, SplatCloud};
use crate::harmonics::FIRST;
use nalgebra::{Point3, UnitQuaternion, Vector3};

/// Sigma along the surface, in lengths of an edge, and across it, in those along.
const ALONG: f32 = 0.5;
const ACROSS: f32 = 0.2;
/// What a disc keeps back at first.
const OPACITY: f32 = 0.7;

impl SplatCloud {
    /// Discs on the vertices of a mesh: `points` [m], `triangles` counter-clockwise from outside, a colour for every vertex
    /// (red, green, blue, 0 to 1), harmonics of a degree from 0 to 3. Vertices of no triangle are left out.
    pub fn on_mesh(points: &[Point3<f32>], triangles: &[[u32; 3]], colors: &[[f32; 3]], degree: usize) -> Self {
        let mut normals = vec![Vector3::zeros(); points.len()];
        let mut edges = vec![(0.0f32, 0u32); points.len()];
        for triangle in triangles {
            let corners = triangle.map(|i| points[i as usize]);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            for (k, i) in triangle.iter().enumerate() {
                let edge = (corners[(k + 1) % 3] - corners[k]).norm();
                let (sum, count) = &mut edges[*i as usize];
                (*sum, *count) = (*sum + edge, *count + 1);
                normals[*i as usize] += normal;
            }
        }
        let mut cloud = Self { degree, ..Self::default() };
        let count = cloud.coefficients();
        for (((point, normal), (sum, edges)), color) in points.iter().zip(&normals).zip(&edges).zip(colors) {
            if *edges == 0 || normal.norm() <= 0.0 || *sum <= 0.0 {
                continue;
            }
            let along = ALONG * sum / *edges as f32;
            let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f32::consts::PI);
            cloud.splats.push(Splat {
                centre: *point,
                rotation: UnitQuaternion::rotation_between(&Vector3::z(), normal).unwrap_or(half_turn),
                sigma: Vector3::new(along, along, ACROSS * along),
                opacity: OPACITY,
            });
            cloud.harmonics.push(color.map(|value| (value - 0.5) / FIRST as f32));
            cloud.harmonics.extend(std::iter::repeat_n([0.0; 3], count - 1));
        }
        cloud
    }
}
