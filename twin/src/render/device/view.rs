//! What changes with every picture, in the bytes that `shared.wgsl` describes.

use super::upload::Part;
use nalgebra::{Isometry3, Point3};
use shared_mem::lens::Distortion;
use splat::{Lens, Straight, Surroundings, slope_ends};

/// Bytes of `View` and of `Body`.
pub(super) const VIEW: u64 = 160;
pub(super) const BODY: u64 = 80;

/// What `View` is made of.
pub(super) struct Facts<'a> {
    pub(super) lens: &'a Lens,
    pub(super) size: [usize; 2],
    pub(super) tiles: [u32; 2],
    pub(super) straight: &'a Straight,
    pub(super) around: &'a Surroundings,
    pub(super) splats: u32,
    pub(super) room: u32,
    pub(super) has_meshes: bool,
    pub(super) row_of_groups: u32,
}

pub(super) fn view_bytes(facts: &Facts<'_>) -> Vec<u8> {
    let Facts { lens, straight, around, .. } = facts;
    let [fx, fy] = lens.focal;
    let [cx, cy] = lens.centre;
    // k1, k2, p1, p2, k3, k4, k5, k6 of a polynomial, or k1, k2, k3, k4 of a fisheye.
    let (bend, is_fisheye) = match lens.distortion {
        Distortion::Polynomial(eight) => (eight, false),
        Distortion::Fisheye([k1, k2, k3, k4]) => ([k1, k2, k3, k4, 0.0, 0.0, 0.0, 0.0], true),
    };
    let [bend, more] = [0, 4].map(|from| [0, 1, 2, 3].map(|i| bend[from + i]));
    let [[left, right], [top, bottom]] = slope_ends(lens, facts.size);
    let [r, g, b] = around.background;
    let light = around.light.normalize();
    let pinhole = &straight.pinhole;
    let mut out = Vec::with_capacity(VIEW as usize);
    let numbers = [
        [fx, fy, cx, cy],
        bend,
        more,
        [left, right, top, bottom],
        [r, g, b, 0.0],
        [light.x, light.y, light.z, 0.0],
        [pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy].map(f64::from),
    ];
    numbers.iter().flatten().for_each(|number| out.extend((*number as f32).to_ne_bytes()));
    let [size, straight_size] = [facts.size, straight.size].map(|size| size.map(|pixels| pixels as u32));
    let flags = u32::from(facts.has_meshes) | u32::from(!straight.lookup.is_empty()) << 1 | u32::from(is_fisheye) << 2;
    let words = [size, facts.tiles, straight_size, [facts.splats, facts.room], [flags, facts.row_of_groups], [0, 0]];
    words.iter().flatten().for_each(|word| out.extend(word.to_ne_bytes()));
    out
}

/// One body; without a pose it is not shown.
pub(super) fn body_bytes(part: &Part, pose: Option<&Isometry3<f64>>, out: &mut Vec<u8>) {
    let shown = f64::from(u8::from(pose.is_some()));
    let pose = pose.copied().unwrap_or_else(Isometry3::identity);
    let rows = pose.to_homogeneous();
    let eye = pose.inverse_transform_point(&Point3::origin());
    for row in 0..3 {
        (0..4).for_each(|column| out.extend((rows[(row, column)] as f32).to_ne_bytes()));
    }
    [eye.x, eye.y, eye.z, shown].iter().for_each(|number| out.extend((*number as f32).to_ne_bytes()));
    [part.instance, part.degree, part.first, part.harmonics].iter().for_each(|word| out.extend(word.to_ne_bytes()));
}
