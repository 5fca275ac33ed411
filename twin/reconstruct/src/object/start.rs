//! Where the optimisation starts: the masks' visual hull and, where there is depth, the depths fused into it.
//!
//! Hull: a node is as far outside as the view says that has it furthest outside its mask (Laurentini 1994), but for the few that
//! noise of the masks may have put there; where too few views look, or below the table, nothing is. A view whose mask ends within its picture
//! shows all of the object, and has nothing of it beside the picture. Fusion: mean of truncated distances along the rays (Curless and Levoy 1996), weighted by the
//! variance of depth, which grows with its fourth power.

use super::extent::Bounds;
use crate::field::Grid;
use crate::scan::Frame;
use crate::sweep;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

/// Pixels beyond this from a mask's border are simply inside or outside.
const REACH: i16 = 40;
/// Background must be this far from a mask's border to say that a place is free [pixel].
const CLEAR: i16 = 4;

/// A frame as the start needs it.
pub(crate) struct Seen<'a> {
    frame: &'a Frame,
    camera_from_scan: Isometry3<f64>,
    border: Vec<i16>,
    /// Whether all of the object is in the picture: its mask ends within.
    is_whole: bool,
}

impl<'a> Seen<'a> {
    /// All frames, from the scan's poses or from others.
    pub(crate) fn all(frames: &'a [Frame], poses: Option<&[Isometry3<f64>]>) -> Vec<Self> {
        let seen = |(number, frame): (usize, &'a Frame)| {
            let pose = poses.map_or(frame.scan_from_camera, |poses| poses[number]);
            let is_whole = !frame.is_cut_off();
            Self { frame, camera_from_scan: pose.inverse(), border: frame.border_distance(REACH), is_whole }
        };
        frames.par_iter().enumerate().map(seen).collect()
    }

    /// Pixel and distance along the axis [m] of a place; `None` outside the picture.
    fn pixel(&self, point: &Point3<f64>) -> Option<(usize, f64)> {
        let local = self.camera_from_scan * point;
        let [u, v] = self.frame.camera.project(&local)?;
        let (width, height) = (self.frame.camera.width, self.frame.camera.height);
        let inside = u >= 0.0 && v >= 0.0 && u < f64::from(width) && v < f64::from(height);
        inside.then(|| (v as usize * width as usize + u as usize, local.z))
    }

    /// How far outside the mask a place appears [m], negative inside; `None` outside of a picture that does not show all of the object.
    pub(crate) fn outside(&self, point: &Point3<f64>) -> Option<f64> {
        let Some((pixel, z)) = self.pixel(point) else { return self.is_whole.then(|| self.beside(point)) };
        let pixels = match self.border[pixel] {
            // The border lies between the pixels beside it.
            steps if steps > 0 => 0.5 - f64::from(steps),
            steps => -0.5 - f64::from(steps),
        };
        Some(pixels * z / self.frame.camera.focal[0])
    }

    /// How far a place outside of the picture is from its edge [m], at most as far as pixels are counted.
    fn beside(&self, point: &Point3<f64>) -> f64 {
        let (camera, local) = (&self.frame.camera, self.camera_from_scan * point);
        let past = |at: f64, size: u32| (-at).max(at - f64::from(size)).max(0.0);
        let pixels =
            camera.project(&local).map_or(f64::INFINITY, |[u, v]| past(u, camera.width).max(past(v, camera.height)));
        (pixels + 1.0).min(f64::from(REACH)) * local.coords.norm() / camera.focal[0]
    }
}

/// Of so many views that see a place how many may see it outside their mask though it is inside.
fn allowed(views: usize) -> usize {
    match views {
        ..16 => 0,
        16..32 => 1,
        _ => 2,
    }
}

/// How far outside the masks' hull each node is [m], negative inside.
pub(crate) fn hull(grid: &Grid, seen: &[Seen<'_>], within: &Bounds) -> Vec<f32> {
    let node = |index: usize| {
        let point = grid.position(grid.node(index));
        let (mut views, mut largest) = (0, [f64::NEG_INFINITY; 3]);
        for outside in seen.iter().filter_map(|view| view.outside(&point)) {
            views += 1;
            let mut value = outside;
            for slot in &mut largest {
                if value > *slot {
                    std::mem::swap(&mut value, slot);
                }
            }
        }
        // A place that too few views see is taken for outside.
        let level = if views < within.fewest { grid.voxel } else { largest[allowed(views)] };
        level.max(within.below(&point)) as f32
    };
    (0..grid.len()).into_par_iter().map(node).collect()
}

/// How far before a surface a place is for a view that measures it `apart` behind the place [m], and the weight of that. What lies deep
/// behind a surface says the less, the deeper: the next surface may begin there. Just behind it counts as much as just before it, else
/// noise of depth would draw the surface inwards.
fn vote(apart: f64, cut: f64) -> (f64, f64) {
    (apart.min(cut), (2.0 + 2.0 * apart / cut).clamp(0.0, 1.0))
}

/// Depth fused into the hull: the level [m] of each node. `spread`: standard deviation of depth at one metre [m].
fn fused(grid: &Grid, seen: &[Seen<'_>], (hull, within): (&[f32], &Bounds), spread: f64) -> Vec<f32> {
    let node = |index: usize| {
        let point = grid.position(grid.node(index));
        let (mut sum, mut total) = (0.0, 0.0);
        for view in seen.iter().filter(|view| !view.frame.depth.is_empty()) {
            let Some((pixel, z)) = view.pixel(&point) else { continue };
            let cut = (2.5 * grid.voxel).max(3.0 * spread * z * z);
            let weight = z.powi(-4);
            let measured = f64::from(view.frame.depth[pixel]);
            let (apart, weight) = if !view.frame.mask[pixel] {
                // Nothing stands before the background.
                if view.border[pixel] > -CLEAR {
                    continue;
                }
                (cut, weight)
            } else if measured <= 0.0 {
                continue;
            } else {
                let (apart, share) = vote(measured - z, cut);
                (apart, weight * share)
            };
            sum += weight * apart;
            total += weight;
        }
        if total > 0.0 { (sum / total).max(within.below(&point)) as f32 } else { hull[index] }
    };
    (0..grid.len()).into_par_iter().map(node).collect()
}

/// The signed distance [voxel] that the optimisation begins with: of the hull, or of depth fused into it.
pub(crate) fn distance(grid: &Grid, seen: &[Seen<'_>], within: &Bounds, depth_spread: Option<f64>) -> Vec<f32> {
    let hull = hull(grid, seen, within);
    let mut level = match depth_spread {
        Some(spread) => fused(grid, seen, (&hull, within), spread),
        None => hull,
    };
    without_rim(grid, &mut level);
    sweep::signed_distance(grid, &level)
}

/// Takes away parts at the rim of the box, where hardly a view looks, but never the largest part: no ray would find that nothing is there.
fn without_rim(grid: &Grid, level: &mut [f32]) {
    let (mut part_of, mut sizes, mut at_rim) = (vec![0usize; level.len()], vec![0usize], vec![false]);
    let mut open = Vec::new();
    for start in 0..level.len() {
        if level[start] >= 0.0 || part_of[start] > 0 {
            continue;
        }
        let part = sizes.len();
        sizes.push(0);
        at_rim.push(false);
        part_of[start] = part;
        open.push(start);
        while let Some(index) = open.pop() {
            sizes[part] += 1;
            if grid.is_rim(grid.node(index)) {
                at_rim[part] = true;
            }
            for (axis, stride) in grid.strides().into_iter().enumerate() {
                let place = grid.node(index)[axis];
                let before = (place > 0).then(|| index - stride);
                let after = (place + 1 < grid.dims[axis]).then(|| index + stride);
                for next in before.into_iter().chain(after) {
                    if level[next] < 0.0 && part_of[next] == 0 {
                        part_of[next] = part;
                        open.push(next);
                    }
                }
            }
        }
    }
    let largest = sizes.iter().copied().max().unwrap_or(0);
    for (level, part) in level.iter_mut().zip(part_of) {
        if at_rim[part] && sizes[part] < largest {
            *level = grid.voxel as f32;
        }
    }
}

/// The smallest box that holds all nodes inside; `None` where none is.
pub(crate) fn bounds(grid: &Grid, level: &[f32]) -> Option<(Point3<f64>, Point3<f64>)> {
    let inside = (0..grid.len()).filter(|index| level[*index] < 0.0).map(|index| grid.node(index));
    let (low, high) = inside.fold(([usize::MAX; 3], [0; 3]), |(low, high), node| {
        ([0, 1, 2].map(|a| low[a].min(node[a])), [0, 1, 2].map(|a| high[a].max(node[a])))
    });
    (low[0] != usize::MAX).then(|| (grid.position(low), grid.position(high)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_at_the_rim_go_and_the_largest_stays() {
        let grid = Grid { dims: [12; 3], origin: Point3::origin(), voxel: 0.01 };
        let boxes = [([3, 3, 3], [8, 8, 8]), ([0, 0, 0], [2, 2, 2]), ([10, 5, 5], [11, 6, 6])];
        let inside = |node: [usize; 3], (low, high): &([usize; 3], [usize; 3])| {
            (0..3).all(|axis| (low[axis]..high[axis]).contains(&node[axis]))
        };
        let mut level: Vec<f32> =
            (0..grid.len()).map(|i| if boxes.iter().any(|b| inside(grid.node(i), b)) { -0.01 } else { 0.01 }).collect();
        without_rim(&grid, &mut level);
        let left = |b| (0..grid.len()).filter(|i| level[*i] < 0.0 && inside(grid.node(*i), b)).count();
        assert_eq!([left(&boxes[0]), left(&boxes[1]), left(&boxes[2])], [125, 0, 1]);
    }

    #[test]
    fn noise_of_depth_hardly_shifts_the_surface() {
        let (spread, cut) = (1.0, 3.0);
        // Normal noise of depth at a place on the surface.
        let votes = (-500..=500).map(|i| {
            let noise = f64::from(i) * 0.01;
            let (apart, weight) = vote(noise, cut);
            (apart, weight * (-0.5 * noise * noise).exp())
        });
        let (sum, total) =
            votes.fold((0.0, 0.0), |(sum, total), (apart, weight)| (sum + weight * apart, total + weight));
        assert!((sum / total).abs() < 0.05 * spread, "{}", sum / total);
        assert_eq!([vote(-3.5, cut).1, vote(10.0, cut).0], [0.0, cut]);
    }
}
