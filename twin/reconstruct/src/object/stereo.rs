//! How far behind a surface the views agree best: stereo of many views, swept along the normals of the surface that there is, as planes
//! are swept by Collins ("A space-sweep approach to true multi-image matching", CVPR 1996).
//!
//! What is compared is the variance of the views' colours about a place: even parts of a picture say nothing about depth and have none
//! that counts beside the edges around them, whose variance their neighbours on the surface take over.

use super::corners;
use super::neighbours::Neighbours;
use crate::field::Field;
use crate::mesh::Mesh;
use crate::scan::{Camera, Frame};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use shared_mem::ending;

/// Distance of the depths that are tried [voxel].
pub(super) const STEP: f64 = 0.5;
/// A pixel of the pictures that are compared is about so wide [voxel]: depths a step apart differ by what is seen, and poses a pixel off
/// do not.
const PIXEL: f64 = 0.4;
/// Colours of fewer views say nothing.
const MIN_VIEWS: usize = 3;
/// Colours of so many views are tried for a place's own.
const REFERENCES: usize = 6;
/// A variance rests on the colours of so many corners that share no pixel, of those that are averaged. More make the standard error
/// smaller: a hollow is opened farther, and a right shape loses more where few views see it (1: 1 % of the test's in hollow.rs, 4: 2 %,
/// 8: 3 %).
const CORNERS: f64 = 4.0;
/// Variance that is noise of the pixels [of 255, squared].
const NOISE: f64 = 1.0;
/// Where at each depth more than this share of the variance is left [1], and more than this of it [of 255, squared], the views agree
/// nowhere near, and the surface goes back by so many steps. Over a filled hollow of the objects of `tests/peers/scan.py` seven tenths
/// and more are left, some 1,200, on a surface that is right within a voxel three tenths. Colours that are
/// less than 12 of 255 apart may be so by the light.
const NOWHERE: f64 = 0.5;
const NOWHERE_LEAST: f64 = 144.0;
const FURTHER: f64 = 2.0;
/// Rounds in which corners that look alike at many depths follow their neighbours: some eight corners far.
const FOLLOWED: usize = 64;

type Colour = [f32; 3];
/// Colours of a pixel and of the eight around it; `None` outside of picture or mask.
type Window = [Option<Colour>; 9];
const MIDDLE: usize = 4;

/// Variance of colour [of 255, squared]: what is left where each view takes the pixel that agrees best, and all of it.
type Variance = [f64; 2];

/// The views of a scan with pictures of fewer pixels.
pub(super) struct Stereo<'a> {
    frames: &'a [Frame],
    poses: &'a [Isometry3<f64>],
    views: Vec<View>,
}

impl<'a> Stereo<'a> {
    /// For surfaces in a grid of such voxels [m] around `middle`.
    pub(super) fn new(
        (frames, poses): (&'a [Frame], &'a [Isometry3<f64>]),
        (voxel, middle): (f64, &Point3<f64>),
    ) -> Self {
        let per_metre = |(frame, pose): (&Frame, &Isometry3<f64>)| {
            frame.camera.focal[0] / (middle - Point3::from(pose.translation.vector)).norm()
        };
        let pixels = PIXEL * voxel * frames.iter().zip(poses).map(per_metre).sum::<f64>() / frames.len().max(1) as f64;
        let by = pixels.round().max(1.0) as u32;
        let views = frames.par_iter().zip(poses).map(|view| View::of(view, by)).collect();
        Self { frames, poses, views }
    }

    /// Whether the views do not say where each corner of a mesh on the surface of `field` is: they agree better at one of the `tried` depths
    /// behind it, or as well at all of them.
    pub(super) fn ambiguous(&self, field: &Field<f32>, mesh: &Mesh, tried: usize) -> Vec<bool> {
        let normals = corners::normals(mesh);
        let seen = corners::seen_by((field, mesh, &normals), (self.frames, self.poses));
        let variances = self.variances((field, mesh, &normals), &Neighbours::of(mesh), &seen, tried);
        let is_ambiguous = |(variances, seen): (&Vec<Option<Variance>>, &Vec<u16>)| {
            let is_certain = matches!(best(variances, seen.len()), Best::At([0, last]) if last + 1 < tried);
            !is_certain || variances.iter().all(Option::is_none)
        };
        variances.iter().zip(&seen).map(is_ambiguous).collect()
    }

    /// How far behind each corner of a mesh on the surface of `field` the views agree best [step], of `tried` depths of which the
    /// surface's own is the first; 0 where they do so on it, or say nothing.
    pub(super) fn depths(&self, field: &Field<f32>, mesh: &Mesh, tried: usize) -> Vec<f64> {
        let normals = corners::normals(mesh);
        let neighbours = Neighbours::of(mesh);
        let seen = corners::seen_by((field, mesh, &normals), (self.frames, self.poses));
        let variances = self.variances((field, mesh, &normals), &neighbours, &seen, tried);
        let best: Vec<Best> = variances.iter().zip(&seen).map(|(all, seen)| best(all, seen.len())).collect();
        // What fills a hollow is smaller than what is around it: views that agree hardly anywhere cannot be compared by colour.
        if 2 * best.iter().filter(|best| **best == Best::Nowhere).count() > best.len() {
            return vec![0.0; best.len()];
        }
        let depths = best.into_iter().map(|best| match best {
            Best::At(range) => range.map(|number| number as f64),
            Best::Nowhere => [FURTHER; 2],
        });
        smoothest(&neighbours, &depths.collect::<Vec<_>>())
    }

    /// Of each corner and those around it, at so many depths behind it.
    fn variances(
        &self,
        (field, mesh, normals): (&Field<f32>, &Mesh, &[Vector3<f64>]),
        neighbours: &Neighbours,
        seen: &[Vec<u16>],
        tried: usize,
    ) -> Vec<Vec<Option<Variance>>> {
        let step = STEP * field.grid.voxel;
        let mut variances = vec![Vec::with_capacity(tried); mesh.points.len()];
        for number in 0..tried {
            let variance = |corner: usize| {
                self.variance(&(mesh.points[corner] - normals[corner] * (number as f64 * step)), &seen[corner])
            };
            let all: Vec<Option<Variance>> = (0..mesh.points.len()).into_par_iter().map(variance).collect();
            let [left, whole] = [0, 1].map(|i| neighbours.smoothed(all.iter().map(|v| v.map(|v| v[i])).collect()));
            for ((variances, left), whole) in variances.iter_mut().zip(left).zip(whole) {
                variances.push(left.zip(whole).map(|(left, whole)| [left, whole]));
            }
        }
        variances
    }

    /// Of the views that show a place, or what lies before it.
    fn variance(&self, point: &Point3<f64>, views: &[u16]) -> Option<Variance> {
        // All that follows is thrown away then: an end that was asked for comes within a second.
        if ending::asked() {
            return None;
        }
        let windows: Vec<Window> = views.iter().filter_map(|v| self.views[usize::from(*v)].window(point)).collect();
        // A place that most of these views have outside of the object is not in it.
        (windows.len() >= MIN_VIEWS && 2 * windows.len() >= views.len()).then(|| [left(&windows), whole(&windows)])
    }
}

/// A camera with its picture, of fewer pixels.
struct View {
    camera: Camera,
    camera_from_scan: Isometry3<f64>,
    colour: Vec<Option<Colour>>,
}

impl View {
    fn of((frame, pose): (&Frame, &Isometry3<f64>), by: u32) -> Self {
        let camera = frame.camera.reduced(by);
        let width = camera.width as usize;
        let colour = |at: usize| corners::mean(frame, [at % width, at / width], by).map(|c| c.map(|c| c as f32));
        let colour = (0..width * camera.height as usize).map(colour).collect();
        Self { camera, camera_from_scan: pose.inverse(), colour }
    }

    /// `None` where the place's own pixel is not in the mask.
    fn window(&self, point: &Point3<f64>) -> Option<Window> {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let [u, v] = self.camera.project(&(self.camera_from_scan * point))?;
        if !(u >= 0.0 && v >= 0.0 && (u as usize) < width && (v as usize) < height) {
            return None;
        }
        let (u, v) = (u as usize, v as usize);
        self.colour[v * width + u]?;
        Some(std::array::from_fn(|i| {
            let (column, row) = ((u + i % 3).checked_sub(1)?, (v + i / 3).checked_sub(1)?);
            if column < width && row < height { self.colour[row * width + column] } else { None }
        }))
    }
}

/// The smoothest depths of corners, each between its own two as far as they agree with those of its neighbours: parts of the surface that
/// look alike at many depths follow those around them.
fn smoothest(neighbours: &Neighbours, between: &[[f64; 2]]) -> Vec<f64> {
    let firsts: Vec<Option<f64>> = between.iter().map(|[first, last]| (first == last).then_some(*first)).collect();
    let means = neighbours.smoothed(firsts);
    let least: Vec<f64> =
        between.iter().zip(means).map(|([own, _], mean)| if *own > 0.0 { mean.unwrap_or(*own) } else { 0.0 }).collect();
    let mut depths = least.clone();
    for _ in 0..FOLLOWED {
        let means = neighbours.means(&depths.iter().copied().map(Some).collect::<Vec<_>>());
        for (corner, mean) in means.into_iter().enumerate() {
            let least = least[corner];
            depths[corner] = mean.unwrap_or(least).clamp(least, between[corner][1].max(least));
        }
    }
    depths
}

/// Where the views agree best.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Best {
    /// At the depth of the first of these numbers, or as well up to that of the second; 0 where they say nothing.
    At([usize; 2]),
    /// At none of those that were tried.
    Nowhere,
}

/// The first depth about which so many views agree as well as about the best: within one standard error of a variance, which is the
/// square root of two over the number of colours (the rule of Breiman et al., Classification and Regression Trees, 1984).
fn best(variances: &[Option<Variance>], views: usize) -> Best {
    let lefts = || variances.iter().map(|v| v.map_or(f64::INFINITY, |[left, _]| left));
    let least = lefts().fold(f64::INFINITY, f64::min);
    let is_wrong = |[left, all]: &Variance| *left > (NOWHERE * all).max(NOWHERE_LEAST);
    if least == f64::INFINITY {
        return Best::At([0, 0]);
    }
    if variances.iter().flatten().all(is_wrong) {
        return Best::Nowhere;
    }
    let as_good = 1.0 + (2.0 / (CORNERS * views.max(1) as f64)).sqrt();
    let enough = as_good * least + NOISE;
    let first = lefts().position(|left| left <= enough).unwrap_or(0);
    let more = lefts().skip(first).take_while(|left| *left <= enough).count();
    // A surface that has moved by less than the views can show would do so again and again.
    let last = if 2 * more > variances.len() { first + more - 1 } else { first };
    Best::At([first, last])
}

/// Mean squared distance of the views' colours from that of the view with which they agree best, where each takes the pixel that agrees
/// best of its own and those beside it (r-consistency; Kutulakos, "Approximate N-view stereo", ECCV 2000): poses are known to a pixel.
fn left(windows: &[Window]) -> f64 {
    let from = |reference: Colour| {
        let away = |colour: &Colour| (0..3).map(|c| (colour[c] - reference[c]).powi(2)).sum::<f32>() / 3.0;
        let nearest = |window: &Window| window.iter().flatten().map(away).fold(f32::INFINITY, f32::min);
        f64::from(windows.iter().map(nearest).sum::<f32>()) / windows.len() as f64
    };
    let references = windows.iter().step_by(windows.len().div_ceil(REFERENCES)).filter_map(|window| window[MIDDLE]);
    references.map(from).fold(f64::INFINITY, f64::min)
}

/// Variance of all their colours, mean of the channels.
fn whole(windows: &[Window]) -> f64 {
    let (mut count, mut sum, mut squares) = (0.0, [0.0; 3], 0.0);
    for colour in windows.iter().flatten().flatten() {
        count += 1.0;
        (0..3).for_each(|c| sum[c] += f64::from(colour[c]));
        squares += colour.iter().map(|c| f64::from(c * c)).sum::<f64>();
    }
    (squares / count - sum.iter().map(|sum| (sum / count).powi(2)).sum::<f64>()) / 3.0
}

#[cfg(test)]
mod tests {
    use super::super::evidence::tests::{body, scan};
    use super::*;
    use crate::mesh::surface;
    use shared_mem::statistics::median;

    /// Middle depth [step] of the corners for which it counts.
    fn middle(depths: &[f64], mesh: &Mesh, counts: impl Fn(&Point3<f64>) -> bool) -> f64 {
        let counted = depths.iter().zip(&mesh.points).filter(|(_, p)| counts(p)).map(|(depth, _)| *depth);
        median(counted).expect("corners")
    }

    #[test]
    fn views_agree_behind_what_stands_before_the_surface_and_on_what_is_right() {
        let (frames, poses) = scan();
        let depths = |by: f32| {
            let mut field = body(true);
            field.distance.iter_mut().for_each(|distance| *distance -= by);
            let (mesh, _) = surface(&field).expect("a body");
            let stereo = Stereo::new((&frames, &poses), (field.grid.voxel, &Point3::origin()));
            let depths = stereo.depths(&field, &mesh, 8);
            [
                middle(&depths, &mesh, |p| p.z > -0.02 && p.z < 0.0 && p.x.abs().max(p.y.abs()) < 0.02),
                middle(&depths, &mesh, |p| p.z.abs() < 0.02 && p.x.abs().max(p.y.abs()) > 0.038),
            ]
        };
        assert_eq!(depths(0.0), [0.0, 0.0]);
        // A voxel and a half too high are three steps; pixels beside the right one agree a step or two before it.
        let [floor, side] = depths(1.5);
        assert!((1.0..=3.5).contains(&floor) && (1.0..=3.5).contains(&side), "{floor} {side}");
    }

    #[test]
    fn what_looks_alike_at_all_depths_follows_what_is_around_it() {
        const EDGE: usize = 12;
        let point = |i: usize| Point3::new((i % EDGE) as f64, (i / EDGE) as f64, 0.0);
        let squares = (0..EDGE * (EDGE - 1)).filter(|i| i % EDGE + 1 < EDGE).map(|i| i as u32);
        let next = EDGE as u32;
        let mesh = Mesh {
            points: (0..EDGE * EDGE).map(point).collect(),
            triangles: squares.flat_map(|i| [[i, i + 1, i + next], [i + 1, i + next + 1, i + next]]).collect(),
        };
        let neighbours = Neighbours::of(&mesh);
        let is_even = |i: usize| [i % EDGE, i / EDGE].iter().all(|at| (3..9).contains(at));
        let middle = |around: f64| {
            let between = |i: usize| if is_even(i) { [0.0, 15.0] } else { [around; 2] };
            smoothest(&neighbours, &(0..EDGE * EDGE).map(between).collect::<Vec<_>>())[5 * EDGE + 5]
        };
        assert!((middle(4.0) - 4.0).abs() < 0.5, "{}", middle(4.0));
        assert_eq!(middle(0.0), 0.0);
    }

    #[test]
    fn the_first_depth_of_those_as_good_as_the_best_counts() {
        let at = |lefts: &[f64], all: f64| best(&lefts.iter().map(|left| Some([*left, all])).collect::<Vec<_>>(), 32);
        assert_eq!(at(&[40.0, 30.0, 10.0, 9.0, 20.0], 100.0), Best::At([2, 2]));
        assert_eq!(at(&[0.4, 0.1, 0.0], 0.5), Best::At([0, 2]));
        assert_eq!(at(&[800.0, 700.0, 900.0], 1000.0), Best::Nowhere);
        // Light that changes, on something without a print.
        assert_eq!(at(&[100.0, 99.0, 101.0], 105.0), Best::At([0, 2]));
        assert_eq!(best(&[None, None], 0), Best::At([0, 0]));
        assert_eq!(best(&[None, Some([3.0, 100.0])], 3), Best::At([1, 1]));
    }
}
