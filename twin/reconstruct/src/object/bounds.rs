//! Where the object is: a box around what all masks see. A scan whose masks and poses do not belong together shows here.

use super::start::{self, Seen};
use crate::field::Grid;
use crate::scan::{Frame, ScanError};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Nodes of the coarse hull.
const COARSE: f64 = 64.0 * 64.0 * 64.0;
/// The hull must fill this share of the masks, seen from the views.
const FILLED: f64 = 0.8;
/// Below this share poses that are meant otherwise are looked at too: an object that is nearly its own mirror image fills most of its
/// masks even in mirrored poses.
const PLAIN: f64 = 0.97;

/// A box that holds the object [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: Point3<f64>,
    pub(crate) high: Point3<f64>,
}

impl Bounds {
    pub(crate) fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }
}

/// Finds the box.
///
/// # Errors
/// [`ScanError::Missing`] when there is no place inside the masks, with what the poses look like instead.
pub(crate) fn find(frames: &[Frame]) -> Result<Bounds, ScanError> {
    let Some((bounds, filled)) = fit(frames) else { return Err(none_found(frames)) };
    // Poses that leave half as much of the masks empty are the right ones.
    let is_meant_otherwise = || filled < PLAIN && otherwise_better(frames, 0.5 * (1.0 + filled)).is_some();
    if filled < FILLED || is_meant_otherwise() { Err(inconsistent(frames, filled)) } else { Ok(bounds) }
}

/// The box and how much of the masks its content fills; `None` where nothing is inside them.
fn fit(frames: &[Frame]) -> Option<(Bounds, f64)> {
    let (centre, radius) = sphere(frames)?;
    let seen = Seen::all(frames, None);
    let around = |low: Point3<f64>, high: Point3<f64>| {
        let grid = Grid::filling(&low, &high, COARSE, 2);
        let level = start::hull(&grid, &seen);
        (grid, level)
    };
    let reach = Vector3::repeat(1.3 * radius);
    let (grid, level) = around(centre - reach, centre + reach);
    let (low, high) = start::bounds(&grid, &level)?;
    // Once more, with nodes where the object is.
    let step = Vector3::repeat(grid.voxel);
    let (grid, level) = around(low - step, high + step);
    let (low, high) = start::bounds(&grid, &level)?;
    let step = Vector3::repeat(grid.voxel);
    let filled = filled(frames, &grid, &level);
    Some((Bounds { low: low - step, high: high + step }, filled))
}

/// Sphere around the place that the masks' middles point to; `None` where the views' rays meet nowhere before them.
fn sphere(frames: &[Frame]) -> Option<(Point3<f64>, f64)> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let mut extents = Vec::new();
    for frame in frames {
        let width = frame.camera.width as usize;
        let pixels = frame.mask.iter().enumerate().filter(|(_, m)| **m).map(|(at, _)| [at % width, at / width]);
        let (mut sum, mut count, mut low, mut high) = ([0.0; 2], 0.0, [usize::MAX; 2], [0; 2]);
        for pixel in pixels {
            for axis in 0..2 {
                sum[axis] += pixel[axis] as f64 + 0.5;
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
            count += 1.0;
        }
        if count < 1.0 {
            continue;
        }
        let [x, y] = frame.camera.direction(sum.map(|s| s / count));
        let ray = (frame.scan_from_camera.rotation * Vector3::new(x, y, 1.0)).normalize();
        let across = Matrix3::identity() - ray * ray.transpose();
        normal += across;
        right += across * frame.scan_from_camera.translation.vector;
        let diagonal = (0..2).map(|axis| (high[axis] + 1 - low[axis]) as f64 / frame.camera.focal[axis]);
        extents.push((frame, 0.5 * diagonal.map(|d| d * d).sum::<f64>().sqrt()));
    }
    let centre = Point3::from(normal.try_inverse()? * right);
    let radius = extents.iter().filter_map(|(frame, extent)| {
        let z = frame.scan_from_camera.inverse_transform_point(&centre).z;
        (z > 0.0).then_some(extent * z)
    });
    let radius = radius.fold(0.0, f64::max);
    (radius > 0.0).then_some((centre, radius))
}

/// Which share of the masks' pixels the nodes inside cover, on a raster as coarse as they are.
fn filled(frames: &[Frame], grid: &Grid, level: &[f32]) -> f64 {
    let inside: Vec<Point3<f64>> =
        (0..grid.len()).filter(|index| level[*index] < 0.0).map(|index| grid.position(grid.node(index))).collect();
    let (mut covered, mut all) = (0usize, 0usize);
    for frame in frames {
        let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
        let z = frame.scan_from_camera.inverse_transform_point(&grid.position(grid.dims.map(|n| n / 2))).z;
        let pixels = (1.5 * grid.voxel * frame.camera.focal[0] / z.max(1e-6)).clamp(1.0, 64.0) as usize;
        let (columns, rows) = (width.div_ceil(pixels), height.div_ceil(pixels));
        let mut hit = vec![false; columns * rows];
        for point in &inside {
            let local = frame.scan_from_camera.inverse_transform_point(point);
            if let Some([u, v]) = frame.camera.project(&local)
                && u >= 0.0
                && v >= 0.0
                && (u as usize) < width
                && (v as usize) < height
            {
                hit[v as usize / pixels * columns + u as usize / pixels] = true;
            }
        }
        for (at, inside) in frame.mask.iter().enumerate().filter(|(_, inside)| **inside) {
            all += usize::from(*inside);
            covered += usize::from(hit[at / width / pixels * columns + at % width / pixels]);
        }
    }
    covered as f64 / all.max(1) as f64
}

/// The poses as they would be had their axes been meant otherwise.
fn otherwise(frames: &[Frame], turn: &Matrix3<f64>, of_world: bool) -> Vec<Frame> {
    let turned = |frame: &Frame| {
        let rotation = frame.scan_from_camera.rotation.to_rotation_matrix();
        let (rotation, place) = if of_world {
            // Mirrored in the world and in the picture: a rotation again.
            (turn * rotation.matrix() * turn, turn * frame.scan_from_camera.translation.vector)
        } else {
            (rotation.matrix() * turn, frame.scan_from_camera.translation.vector)
        };
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Frame { scan_from_camera: Isometry3::from_parts(place.into(), rotation), ..frame.clone() }
    };
    frames.iter().map(turned).collect()
}

/// What the poses look like, had the cameras' axes been meant as OpenGL has them, or the poses been mirrored, where the masks then
/// agree to `least`.
fn otherwise_better(frames: &[Frame], least: f64) -> Option<&'static str> {
    let good = |frames: &[Frame]| fit(frames).is_some_and(|(_, filled)| filled >= least);
    if good(&otherwise(frames, &Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)), false)) {
        return Some(
            "the cameras look the other way: give poses whose cameras look along -z with y up (transforms.json), \
             or along z with y down (COLMAP, poses.json)",
        );
    }
    if good(&otherwise(frames, &Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0)), true)) {
        return Some(
            "the poses are mirrored: their frame is left-handed; change the sign of one axis of positions and rotations",
        );
    }
    None
}

fn guess(frames: &[Frame], least: f64) -> &'static str {
    otherwise_better(frames, least).unwrap_or("look whether poses, pictures and masks belong together")
}

fn none_found(frames: &[Frame]) -> ScanError {
    ScanError::Missing(format!("no place lies inside the masks of all views: {}", guess(frames, FILLED)))
}

fn inconsistent(frames: &[Frame], filled: f64) -> ScanError {
    let share = filled * 100.0;
    ScanError::Missing(format!(
        "the masks do not agree: what is inside all of them fills {share:.0} % of them; {}",
        guess(frames, FILLED.max(filled))
    ))
}
