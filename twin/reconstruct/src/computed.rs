//! Depth of a scan that was taken without: computed from its pictures and poses, and said to be so.

use crate::scan::{Camera, Frame, Scan};
use depth::View;
use nalgebra::Point3;
use rayon::prelude::*;
use shared_mem::lens::Distortion;
use shared_mem::progress::{Planned, Progress};

/// Numbers of the random planes that the search tries.
const SEED: u64 = 1;
/// The stage of the work, and how often the share of it that is done may change.
pub(crate) const DEPTH: &str = "depth";
const DEPTH_STEPS: u64 = 1000;

/// How much depth was computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Computed {
    /// Of the pixels of which depth was wanted, the share that got one [1].
    pub share: f64,
}

/// What is wanted of a frame.
pub(crate) struct Wanted {
    /// All that is seen lies between these depths along the camera's axis [m].
    pub(crate) range: [f64; 2],
    /// Pixels of which depth is wanted finely, row by row; empty: all.
    pub(crate) fine: Vec<bool>,
}

/// The stages of work on a scan, of all that there may be: depth is computed where none was measured alone.
pub(crate) fn stages(all: &[Planned], scan: &Scan) -> Vec<Planned> {
    all.iter().filter(|(name, _)| *name != DEPTH || !scan.has_depth()).copied().collect()
}

/// Gives frames the depth that their pictures say, 0 where they say none, in a stage of its own. `None` once the end was asked for, and the
/// frames are as they were.
pub(crate) fn fill(bar: &Progress, frames: &mut [Frame], wanted: impl Fn(&Frame) -> Wanted + Sync) -> Option<Computed> {
    bar.stage(DEPTH, DEPTH_STEPS);
    let done = |share: f64| bar.show((share * DEPTH_STEPS as f64) as u64, DEPTH);
    let views: Vec<View> = frames.par_iter().map(|frame| view(frame, wanted(frame))).collect();
    let depths = depth::estimate(&views, SEED, &done)?;
    let (mut known, mut all) = (0usize, 0usize);
    for ((frame, view), depth) in frames.iter_mut().zip(&views).zip(depths) {
        frame.depth = bent(&frame.camera, &depth.depth);
        let is_wanted = |at: usize| view.fine.is_empty() || (view.fine[at] && frame.mask[at]);
        let pixels = (0..frame.depth.len()).filter(|at| is_wanted(*at));
        for at in pixels {
            all += 1;
            known += usize::from(frame.depth[at] > 0.0);
        }
    }
    Some(Computed { share: known as f64 / all.max(1) as f64 })
}

/// A frame as a pinhole camera would have taken it.
fn view(frame: &Frame, wanted: Wanted) -> View {
    let Camera { width, height, focal, centre, lens } = frame.camera;
    let size = [width as usize, height as usize];
    let grey: Vec<f32> = frame.rgb.iter().map(|rgb| rgb.iter().map(|c| f32::from(*c)).sum::<f32>() / 3.0).collect();
    let straight = Camera { lens: Distortion::NONE, ..frame.camera };
    let seen = |at: usize| {
        let [x, y] = straight.direction(middle(at, size[0]));
        frame.camera.project(&Point3::new(x, y, 1.0))
    };
    let grey = if lens == Distortion::NONE {
        grey
    } else {
        (0..grey.len()).into_par_iter().map(|at| seen(at).map_or(0.0, |place| between(&grey, size, place))).collect()
    };
    let fine = if lens == Distortion::NONE || wanted.fine.is_empty() {
        wanted.fine
    } else {
        let is_fine = |at: usize| seen(at).and_then(|place| pixel(place, size)).is_some_and(|at| wanted.fine[at]);
        (0..size[0] * size[1]).map(is_fine).collect()
    };
    View {
        camera: depth::Camera { size, focal, centre },
        camera_from_world: frame.scan_from_camera.inverse(),
        grey,
        fine,
        range: wanted.range,
    }
}

/// Depth of a pinhole camera's pixels at those of the camera with its lens; 0 where there is none.
fn bent(camera: &Camera, depth: &[f32]) -> Vec<f32> {
    let size = [camera.width as usize, camera.height as usize];
    let of = |at: usize| {
        let [x, y] = camera.direction(middle(at, size[0]));
        let place = [0, 1].map(|i| [x, y][i] * camera.focal[i] + camera.centre[i]);
        pixel(place, size).map_or(0.0, |at| if depth[at].is_finite() { depth[at] } else { 0.0 })
    };
    (0..depth.len()).map(of).collect()
}

fn middle(at: usize, width: usize) -> [f64; 2] {
    [(at % width) as f64 + 0.5, (at / width) as f64 + 0.5]
}

/// The pixel that holds a place; `None` outside.
fn pixel([u, v]: [f64; 2], [width, height]: [usize; 2]) -> Option<usize> {
    let inside = u >= 0.0 && v >= 0.0 && u < width as f64 && v < height as f64;
    inside.then(|| v as usize * width + u as usize)
}

/// Brightness at a place, between the four pixels around it; beyond the edge the last pixels go on.
fn between(grey: &[f32], [width, height]: [usize; 2], [u, v]: [f64; 2]) -> f32 {
    let (u, v) = ((u - 0.5).clamp(0.0, (width - 1) as f64), (v - 0.5).clamp(0.0, (height - 1) as f64));
    let (column, row) = (u as usize, v as usize);
    let (right, down) = ((u - column as f64) as f32, (v - row as f64) as f32);
    let at = |x: usize, y: usize| grey[y.min(height - 1) * width + x.min(width - 1)];
    let above = at(column, row) * (1.0 - right) + at(column + 1, row) * right;
    let below = at(column, row + 1) * (1.0 - right) + at(column + 1, row + 1) * right;
    above * (1.0 - down) + below * down
}
