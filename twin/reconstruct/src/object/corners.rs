//! Which views show the corners of a mesh on the surface of a field, where in their pictures, and in which colour.

use super::view::draw;
use crate::field::Field;
use crate::mesh::Mesh;
use crate::scan::{Camera, Frame};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

/// Pictures of fewer pixels do.
pub(super) const COARSER: u32 = 3;
/// A corner is shown by a view that it faces (cosine).
const FACING: f64 = 0.25;

/// Numbers of the views that show each corner of a mesh on the surface of a field, of which these are the normals.
pub(super) fn seen_by(
    surface: (&Field<f32>, &Mesh, &[Vector3<f64>]),
    (frames, poses): (&[Frame], &[Isometry3<f64>]),
) -> Vec<Vec<u16>> {
    let pixels: Vec<_> = frames.par_iter().zip(poses).map(|view| seen(surface, view)).collect();
    let of = |corner: usize| (0..frames.len()).filter(|f| pixels[*f][corner].is_some()).map(|f| f as u16).collect();
    (0..surface.1.points.len()).map(of).collect()
}

/// Pixels of a picture reduced by [`COARSER`] at which a view shows the corners; `None` where a corner faces away from it, or something
/// stands before it.
pub(super) fn seen(
    (field, mesh, normals): (&Field<f32>, &Mesh, &[Vector3<f64>]),
    (frame, pose): (&Frame, &Isometry3<f64>),
) -> Vec<Option<[usize; 2]>> {
    let camera: Camera = frame.camera.reduced(COARSER);
    let drawn = draw(field, &camera, pose);
    let near = 2.5 * field.grid.voxel;
    let at = |(point, normal): (&Point3<f64>, &Vector3<f64>)| {
        let local = pose.inverse_transform_point(point);
        let [u, v] = camera.project(&local)?;
        if !(u >= 0.0 && v >= 0.0 && u < f64::from(camera.width) && v < f64::from(camera.height)) {
            return None;
        }
        let pixel = [u as usize, v as usize];
        let towards = (Point3::from(pose.translation.vector) - point).normalize();
        let depth = f64::from(drawn.depth[pixel[1] * camera.width as usize + pixel[0]]);
        let slack = near + 2.0 * local.z / camera.focal[0];
        (normal.dot(&towards) > FACING && depth > 0.0 && local.z < depth + slack).then_some(pixel)
    };
    mesh.points.iter().zip(normals).map(at).collect()
}

/// Mean colour [of 255] of the pixels that are one in a picture reduced by `by`; `None` where not all of them are in the mask.
pub(super) fn mean(frame: &Frame, [column, row]: [usize; 2], by: u32) -> Option<[f64; 3]> {
    let by = by as usize;
    let first = row * by * frame.camera.width as usize + column * by;
    let pixels = (0..by * by).map(|i| first + i / by * frame.camera.width as usize + i % by);
    let mut sum = [0.0; 3];
    for at in pixels.clone() {
        (0..3).for_each(|c| sum[c] += f64::from(frame.rgb[at][c]));
    }
    pixels.clone().all(|at| frame.mask[at]).then(|| sum.map(|sum| sum / (by * by) as f64))
}

/// Normals of a mesh at its corners, outwards.
pub(super) fn normals(mesh: &Mesh) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.points.len()];
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(number);
        let normal = (b - a).cross(&(c - a));
        triangle.iter().for_each(|corner| normals[*corner as usize] += normal);
    }
    normals.iter().map(|n| n.try_normalize(0.0).unwrap_or_else(Vector3::z)).collect()
}
