//! Where the object is: a box around what all masks see. A scan whose masks and poses do not belong together shows here.

use super::extent::Bounds;
use super::start::{self, Seen};
use crate::field::Grid;
use crate::remark::Remark;
use crate::scan::{Frame, ScanError, Table};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Nodes of the coarse hull.
const COARSE: f64 = 64.0 * 64.0 * 64.0;
/// The hull must fill this share of the masks, seen from the views.
const FILLED: f64 = 0.8;
/// Below this share poses that are meant otherwise are looked at too: an object that is nearly its own mirror image fills most of its
/// masks even in mirrored poses.
const PLAIN: f64 = 0.97;

/// Shares of the views that must say whether a place is in their mask. Where pictures cut the object off, places beside the cameras are in
/// the pictures of a few views alone, of which none has them outside of its mask. Of close-ups each shows a part: the share is halved
/// for as long as the places that are left fill less of the masks than all do, by more than the last number.
const SEEN_BY: [f64; 3] = [1.0 / 3.0, 1.0 / 6.0, 1.0 / 12.0];
const UNFILLED: f64 = 0.02;
/// A table cuts off the tip that no picture shows beneath an object, and by rounding to nodes some pixels more; one that takes more than
/// this share of the masks away lies too high.
const CUT: f64 = 0.05;
/// What the outlines leave open beneath an object reaches below its table: one that lies deeper than this under all of it is another's
/// [voxel of the coarse hull].
const BENEATH: f64 = 2.0;

/// Why an object does not stand on a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Misplaced {
    /// So much of what the masks show lies below it [1].
    CutsOff(f64),
    /// All of the object lies higher than this above it [m].
    Beneath(f64),
}

impl Bounds {
    /// The box of what stands on a table.
    ///
    /// # Errors
    /// [`Misplaced`] where that cannot be.
    pub(super) fn above(&self, frames: &[Frame], table: Table) -> Result<Self, Misplaced> {
        let seen = Seen::all(frames, None);
        let grid = Grid::filling(&self.low, &self.high, COARSE, 2);
        let within = Self { table: Some(table), ..*self };
        let (whole, rest) = (start::hull(&grid, &seen, self), start::hull(&grid, &seen, &within));
        let inside = (0..grid.len()).filter(|node| whole[*node] < 0.0).map(|node| grid.position(grid.node(node)));
        let lowest = inside.map(|place| table.height(&place)).fold(f64::INFINITY, f64::min);
        if lowest > BENEATH * grid.voxel {
            return Err(Misplaced::Beneath(lowest));
        }
        let lost = filled(frames, &grid, &whole) - filled(frames, &grid, &rest);
        if lost > CUT {
            return Err(Misplaced::CutsOff(lost));
        }
        within.around(&grid, &rest).ok_or(Misplaced::CutsOff(1.0))
    }

    /// What is to be said where less than a third of the views had to do.
    pub(crate) fn remark(&self, views: usize) -> Option<Remark> {
        (self.fewest < fewest(SEEN_BY[0], views)).then(|| {
            Remark(format!(
                "the views show parts of the object: of its places some are seen by fewer than a third of the {views} views, so those that {} \
                 see count, too",
                self.fewest
            ))
        })
    }

    /// With the box around the nodes inside, and room of a node.
    fn around(&self, grid: &Grid, level: &[f32]) -> Option<Self> {
        let (low, high) = start::bounds(grid, level)?;
        let step = Vector3::repeat(grid.voxel);
        Some(Self { low: low - step, high: high + step, ..*self })
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
    let reach = Vector3::repeat(1.3 * radius);
    let grid = Grid::filling(&(centre - reach), &(centre + reach), COARSE, 2);
    let anywhere = Bounds { low: centre - reach, high: centre + reach, fewest: 1, table: None };
    let (within, level) = seen_by_many(frames, &grid, &seen, &anywhere);
    let within = within.around(&grid, &level)?;
    // Once more, with nodes where the object is.
    let grid = Grid::filling(&within.low, &within.high, COARSE, 2);
    let level = start::hull(&grid, &seen, &within);
    let filled = filled(frames, &grid, &level);
    Some((within.around(&grid, &level)?, filled))
}

/// So many of all views, one at least.
fn fewest(share: f64, views: usize) -> usize {
    ((share * views as f64).ceil() as usize).max(1)
}

/// The hull of the places that as many views see as may be asked for.
fn seen_by_many(frames: &[Frame], grid: &Grid, seen: &[Seen<'_>], anywhere: &Bounds) -> (Bounds, Vec<f32>) {
    let hull = |within: Bounds| (within, start::hull(grid, seen, &within));
    let all = hull(*anywhere);
    let least = filled(frames, grid, &all.1) - UNFILLED;
    let mut stricter = SEEN_BY.iter().map(|share| hull(Bounds { fewest: fewest(*share, frames.len()), ..*anywhere }));
    stricter.find(|(_, level)| filled(frames, grid, level) >= least).unwrap_or(all)
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

#[cfg(test)]
mod tests {
    use super::super::evidence::tests::{body, seen_from};
    use super::*;

    /// Rounds from above at these distances from the object's middle [m]; each camera looks past it by so much along its own x [m].
    fn rounds(away: f64, aside: impl Fn(usize) -> f64) -> Vec<Frame> {
        let pose = |number: usize| {
            let (high, turn) = ([0.25f64, 0.63, 1.08][number % 3], number as f64 * 0.45);
            let way = Vector3::new(high.cos() * turn.cos(), high.cos() * turn.sin(), high.sin());
            let past = way.cross(&Vector3::z()).normalize() * aside(number);
            Isometry3::face_towards(&Point3::from(way * away + past), &Point3::from(past), &-Vector3::z())
        };
        seen_from(&body(false), &(0..42).map(pose).collect::<Vec<_>>())
    }

    fn assert_around_the_body(bounds: &Bounds) {
        // What the outlines leave open beneath it is a tip.
        for (axis, half) in [0.04, 0.04, 0.03].into_iter().enumerate() {
            let beneath = if axis == 2 { 0.02 } else { 0.0 };
            let (low, high) = (-bounds.low[axis] - half, bounds.high[axis] - half);
            assert!((0.0..0.008 + beneath).contains(&low) && (0.0..0.008).contains(&high), "{bounds:?}");
        }
    }

    #[test]
    fn an_object_that_fills_pictures_from_above_is_all_that_the_box_holds() {
        let frames = rounds(0.25, |_| 0.0);
        let bounds = find(&frames).expect("a box");
        assert_around_the_body(&bounds);
    }

    #[test]
    fn close_ups_of_parts_make_the_whole() {
        // Ten views of the whole, and in the others a side of it: some of its places are seen by less than a third of all.
        let aside = |number: usize| {
            if number < 10 {
                0.0
            } else if number.is_multiple_of(2) {
                0.06
            } else {
                -0.06
            }
        };
        let frames = rounds(0.17, aside);
        let bounds = find(&frames).expect("a box");
        assert!(filled_by(&frames, &bounds) > 0.97, "{bounds:?}");
    }

    fn filled_by(frames: &[Frame], bounds: &Bounds) -> f64 {
        let grid = Grid::filling(&bounds.low, &bounds.high, COARSE, 2);
        filled(frames, &grid, &start::hull(&grid, &Seen::all(frames, None), bounds))
    }

    #[test]
    fn a_table_ends_the_box_and_one_through_the_object_is_refused() {
        let frames = rounds(0.25, |_| 0.0);
        let bounds = find(&frames).expect("a box");
        let above = bounds.above(&frames, Table::at_height(-0.03)).expect("above the table");
        assert!((above.low.z + 0.03).abs() < 4e-3 && above.low.z > bounds.low.z, "{above:?} of {bounds:?}");
        let through = bounds.above(&frames, Table::at_height(-0.015));
        assert!(matches!(through, Err(Misplaced::CutsOff(share)) if (0.05..0.3).contains(&share)), "{through:?}");
        let over = bounds.above(&frames, Table::at_height(0.2));
        assert_eq!(over, Err(Misplaced::CutsOff(filled_by(&frames, &bounds))));
        let beneath = bounds.above(&frames, Table::at_height(-0.08));
        assert!(matches!(beneath, Err(Misplaced::Beneath(height)) if (0.02..0.05).contains(&height)), "{beneath:?}");
    }
}
