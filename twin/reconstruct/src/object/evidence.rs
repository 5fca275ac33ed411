//! What the views show of the surface: how many of them each corner of its mesh, and, without depth, whether they say where it is.
//! Where the surface is not where it seems to be, as over a hollow that was filled because no silhouette shows it, each view sees another
//! place, and their colours contradict each other; where it has no print, they are as alike behind it, and only an outline says where it
//! is.

use super::corners::{COARSER, mean, normals, seen};
use super::neighbours::Neighbours;
use super::start::Seen;
use super::stereo::Stereo;
use crate::field::Field;
use crate::mesh::Mesh;
use crate::scan::Frame;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use shared_mem::statistics::median;

/// A corner is seen that so many views show.
pub(super) const SEEN: u8 = 2;
/// Colours of fewer views say nothing about whether they agree.
const MIN_VIEWS: usize = 3;
/// Colours further apart contradict each other [of 255].
const CONTRADICTORY: f64 = 16.0;
/// Depths behind the surface that are compared with it, half a voxel apart: two voxels, over which pixels differ where there is a print.
const TRIED: usize = 5;
/// So near to a mask's border, seen from a view that it faces no more than by this cosine, an outline shows a corner [voxel].
const OUTLINED: f64 = 1.5;
const GRAZED: f64 = 0.3;
/// Depth that was computed is on the surface so near to it [voxel]: as near as depths are compared with it.
const THERE: f64 = 2.0;

/// Whether the views say where a corner of the surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Certainty {
    /// They do.
    Known,
    /// Fewer than two show it.
    Unseen,
    /// Their colours there are of several places.
    Contradicted,
    /// Their colours are as alike, or more, up to two voxels behind it, and no outline shows it, nor computed depth.
    Ambiguous,
}

/// What views show of each corner.
#[derive(Debug)]
pub(super) struct Evidence {
    /// How many views show it.
    pub(super) views: Vec<u8>,
    /// Whether they say where it is.
    pub(super) certainty: Vec<Certainty>,
}

impl Evidence {
    /// Of a mesh on the surface of `field`, from the poses that the frames have by now. Depth that was measured says where the surface is;
    /// depth that was computed does so where views have it on the surface.
    pub(super) fn of(
        field: &Field<f32>,
        mesh: &Mesh,
        (frames, poses): (&[Frame], &[Isometry3<f64>]),
        is_measured: bool,
    ) -> Self {
        let normals = normals(mesh);
        let (mut views, mut colours) = (vec![0u8; mesh.points.len()], vec![Vec::new(); mesh.points.len()]);
        let mut depths = vec![0u8; mesh.points.len()];
        for (frame, pose) in frames.iter().zip(poses) {
            for (corner, pixel) in seen((field, mesh, &normals), (frame, pose)).into_iter().enumerate() {
                views[corner] = views[corner].saturating_add(u8::from(pixel.is_some()));
                colours[corner].extend(pixel.and_then(|pixel| mean(frame, pixel, COARSER)));
                let z = pose.inverse_transform_point(&mesh.points[corner]).z;
                let depth = pixel.and_then(|pixel| depth(frame, pixel));
                let is_there = depth.is_some_and(|depth| (depth - z).abs() < THERE * field.grid.voxel);
                depths[corner] = depths[corner].saturating_add(u8::from(is_there));
            }
        }
        let seen = |corner: usize| if views[corner] < SEEN { Certainty::Unseen } else { Certainty::Known };
        let mut certainty: Vec<Certainty> = (0..views.len()).map(seen).collect();
        if !is_measured {
            let apart = Neighbours::of(mesh).smoothed(colours.iter().map(|colours| apart(colours)).collect());
            let middle = mesh.middle();
            let stereo = Stereo::new((frames, poses), (field.grid.voxel, &middle));
            let ambiguous = stereo.ambiguous(field, mesh, TRIED);
            let outlined = outlined((field, mesh, &normals), (frames, poses));
            for (corner, certainty) in certainty.iter_mut().enumerate().filter(|(_, c)| **c == Certainty::Known) {
                if depths[corner] >= SEEN {
                    continue;
                }
                if apart[corner].is_some_and(|apart| apart > CONTRADICTORY) {
                    *certainty = Certainty::Contradicted;
                } else if ambiguous[corner] && !outlined[corner] {
                    *certainty = Certainty::Ambiguous;
                }
            }
        }
        Self { views, certainty }
    }

    /// Which share of the mesh that it is of is so [1].
    pub(super) fn share(&self, mesh: &Mesh, is: Certainty) -> f64 {
        share(mesh, |corner| self.certainty[corner] == is)
    }
}

/// Depth of the middle one of the pixels that are one in a picture reduced by [`COARSER`] [m]; `None` where there is none.
fn depth(frame: &Frame, [column, row]: [usize; 2]) -> Option<f64> {
    let [x, y] = [column, row].map(|at| at * COARSER as usize + COARSER as usize / 2);
    frame.depth.get(y * frame.camera.width as usize + x).filter(|z| **z > 0.0).map(|z| f64::from(*z))
}

/// Whether each corner of a mesh on the surface of a field lies in the outline of some view's mask.
fn outlined(
    (field, mesh, normals): (&Field<f32>, &Mesh, &[Vector3<f64>]),
    (frames, poses): (&[Frame], &[Isometry3<f64>]),
) -> Vec<bool> {
    let seen = Seen::all(frames, Some(poses));
    let near = OUTLINED * field.grid.voxel;
    let is_outlined = |(point, normal): (&Point3<f64>, &Vector3<f64>)| {
        seen.iter().zip(poses).any(|(seen, pose)| {
            let towards = (Point3::from(pose.translation.vector) - point).normalize();
            normal.dot(&towards).abs() < GRAZED && seen.outside(point).is_some_and(|away| away.abs() < near)
        })
    };
    mesh.points.par_iter().zip(normals).map(is_outlined).collect()
}

/// Share of the area of triangles with such a corner.
pub(super) fn share(mesh: &Mesh, is: impl Fn(usize) -> bool) -> f64 {
    let (mut part, mut all) = (0.0, 0.0);
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        let area = mesh.area(number);
        all += area;
        if triangle.iter().any(|corner| is(*corner as usize)) {
            part += area;
        }
    }
    part / all
}

/// Mean distance of colours from their middle one, channel by channel.
fn apart(colours: &[[f64; 3]]) -> Option<f64> {
    if colours.len() < MIN_VIEWS {
        return None;
    }
    let mut sum = 0.0;
    for c in 0..3 {
        let middle = median(colours.iter().map(|colour| colour[c]))?;
        sum += colours.iter().map(|colour| (colour[c] - middle).abs()).sum::<f64>();
    }
    Some(sum / (3 * colours.len()) as f64)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::view::draw;
    use super::*;
    use crate::field::Grid;
    use crate::mesh::surface;
    use crate::scan::Camera;
    use shared_mem::lens::Distortion;

    const WIDTH: u32 = 120;
    const HEIGHT: u32 = 90;

    /// Sixteen views from above of the box with its hollow.
    pub(in crate::object) fn scan() -> (Vec<Frame>, Vec<Isometry3<f64>>) {
        let pose = |i: u32| {
            let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
            let high = 0.9 - 0.06 * f64::from(i);
            let eye = Point3::new((1.0 - high * high).sqrt() * cos, (1.0 - high * high).sqrt() * sin, high) * 0.3;
            Isometry3::face_towards(&eye, &Point3::origin(), &-Vector3::z())
        };
        let poses: Vec<_> = (0..16).map(pose).collect();
        (seen_from(&body(true), &poses), poses)
    }

    /// Pictures and masks of a field.
    pub(in crate::object) fn seen_from(field: &Field<f32>, poses: &[Isometry3<f64>]) -> Vec<Frame> {
        let centre = [f64::from(WIDTH) / 2.0, f64::from(HEIGHT) / 2.0];
        let camera = Camera { width: WIDTH, height: HEIGHT, focal: [180.0; 2], centre, lens: Distortion::NONE };
        let frame = |pose: &Isometry3<f64>| {
            let drawn = draw(field, &camera, pose);
            let mask = drawn.opacity.iter().map(|o| *o > 0.5).collect();
            Frame { name: String::new(), camera, scan_from_camera: *pose, rgb: drawn.rgb, mask, depth: Vec::new() }
        };
        poses.iter().map(frame).collect()
    }

    /// A box of 80 x 80 x 60 mm, with a hollow of 60 x 60 x 40 mm that opens upwards or without.
    pub(in crate::object) fn body(hollow: bool) -> Field<f32> {
        let grid = Grid { dims: [41, 41, 41], origin: Point3::new(-0.06, -0.06, -0.06), voxel: 0.003 };
        let inside = |p: Point3<f64>, half: [f64; 3]| (0..3).map(|i| p[i].abs() - half[i]).fold(f64::MIN, f64::max);
        let points: Vec<Point3<f64>> = (0..grid.len()).map(|i| grid.position(grid.node(i))).collect();
        let distance = |p: &Point3<f64>| {
            let outside = inside(*p, [0.04, 0.04, 0.03]);
            // Its floor is 40 mm below the rim.
            let free = -inside(*p - Vector3::new(0.0, 0.0, 0.03), [0.03, 0.03, 0.04]);
            (if hollow { outside.max(free) } else { outside } / grid.voxel) as f32
        };
        let colour = |p: &Point3<f64>| [0, 1, 2].map(|i| (0.5 + 0.4 * (150.0 * p[i]).sin()) as f32);
        Field { grid, distance: points.iter().map(distance).collect(), colour: points.iter().map(colour).collect() }
    }

    #[test]
    fn views_into_a_hollow_contradict_each_other_where_it_is_filled() {
        let (frames, poses) = scan();
        let shares = |hollow: bool| {
            let field = body(hollow);
            let (mesh, _) = surface(&field).expect("a body");
            let Evidence { views, certainty } = Evidence::of(&field, &mesh, (&frames, &poses), false);
            let share = |counts: &dyn Fn(&Point3<f64>) -> bool| {
                let all: Vec<usize> = (0..views.len()).filter(|i| counts(&mesh.points[*i]) && views[*i] > 3).collect();
                all.iter().filter(|i| certainty[**i] != Certainty::Known).count() as f64 / all.len() as f64
            };
            let over = |p: &Point3<f64>| p.z > 0.029 && p.x.abs() < 0.025 && p.y.abs() < 0.025;
            [share(&over), share(&|p| p.z < 0.02 && p.z > -0.025 && p.x.abs().max(p.y.abs()) > 0.038)]
        };
        let filled = shares(false);
        assert!(filled[0] > 0.9 && filled[1] < 0.1, "{filled:?}");
        let right = shares(true);
        assert!(right[1] < 0.1, "{right:?}");
    }
}
