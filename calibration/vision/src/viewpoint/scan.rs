//! The first look, over everything a start may be mistaken for. A camera that only turns shows the same outline at
//! another place of its picture, so the robot is drawn once for every place of the camera, and the turns are looked up.

use super::frame::Frame;
use super::lens::Lens;
use super::outline::{Outliner, Place};
use super::search::Reach;
use super::shape::Shape;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use shared_mem::ending;

/// A pose that is worth a closer look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    pub camera_from_base: Isometry3<f64>,
    /// How badly it fits, about 0 to 1.
    pub loss: f64,
}

/// Steps of the look: turns [pixel of the coarsest level], rolls [rad], places [share of the distance to the robot].
const PIXELS: f64 = 4.0;
const ROLL: f64 = 0.06;
const SHARE: f64 = 0.07;
/// At most so many places along each axis.
const PLACES: usize = 5;
/// So many places of the outline are looked up.
const LOOKED_UP: usize = 150;

/// Where the camera is looked from, as shifts from `start` [m].
pub(super) fn places(start: &Isometry3<f64>, reach: &Reach) -> Vec<Vector3<f64>> {
    let far = (start * Point3::new(0.0, 0.0, 0.4)).z.max(0.3);
    let count = |half: f64, step: f64, most: usize| (2 * (half / step).ceil() as usize + 1).min(most) as i32;
    let places = count(reach.distance, SHARE * far, PLACES);
    let shift = |number: i32| f64::from(2 * number - places + 1) / f64::from((places - 1).max(1)) * reach.distance;
    (0..places.pow(3))
        .map(|n| Vector3::new(shift(n % places), shift(n / places % places), shift(n / places / places)))
        .filter(|by| by.norm() <= 1.3 * reach.distance)
        .collect()
}

/// The best poses around `start`, the best first and each of its own; and how many times the robot was drawn. `looked` is called
/// of every one of the [`places`] once it was looked from.
pub(super) fn scan(
    frames: &[Frame],
    shape: &Shape,
    start: &Isometry3<f64>,
    reach: &Reach,
    wanted: usize,
    looked: impl Fn() + Sync,
) -> (Vec<Candidate>, usize) {
    let shifts = places(start, reach);
    let from = |by: &Vector3<f64>| {
        let found = look(frames, shape, &(Translation3::from(-by) * start), reach.angle);
        looked();
        found
    };
    let found: Vec<Candidate> = shifts.par_iter().map(from).collect::<Vec<_>>().concat();
    (distinct(found, wanted), shifts.len() * frames.len())
}

/// The best of candidates that differ.
fn distinct(mut found: Vec<Candidate>, wanted: usize) -> Vec<Candidate> {
    found.sort_by(|a, b| a.loss.total_cmp(&b.loss));
    let mut out: Vec<Candidate> = Vec::new();
    for candidate in found {
        let same = |other: &Candidate| {
            let (distance, angle) = super::step::apart(&other.camera_from_base, &candidate.camera_from_base);
            distance < 1e-6 && angle < 0.03
        };
        if out.len() < wanted && !out.iter().any(same) {
            out.push(candidate);
        }
    }
    out
}

/// The best turns of a camera at one place.
fn look(frames: &[Frame], shape: &Shape, camera_from_base: &Isometry3<f64>, angle: f64) -> Vec<Candidate> {
    let templates: Vec<Vec<Place>> = frames.iter().map(|f| template(f, shape, camera_from_base, angle)).collect();
    let Some(lens) = frames.first().map(|frame| frame.lens(Frame::COARSEST)) else { return Vec::new() };
    let rolls = 2 * (angle / ROLL).ceil() as i32 + 1;
    let side = (angle * lens.focal[0] / PIXELS).ceil() as i32;
    let mut found = Vec::new();
    for roll in (0..rolls).take_while(|_| !ending::asked()) {
        let roll = (f64::from(2 * roll + 1) / f64::from(rolls) - 1.0) * angle;
        let mut best: Option<Candidate> = None;
        for number in 0..(2 * side + 1).pow(2) {
            let (x, y) = (number % (2 * side + 1) - side, number / (2 * side + 1) - side);
            let (pan, tilt) = (f64::from(x) * PIXELS / lens.focal[0], -f64::from(y) * PIXELS / lens.focal[1]);
            if pan.hypot(tilt).hypot(roll) > 1.15 * angle {
                continue;
            }
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(tilt, pan, roll));
            let loss = loss(frames, &templates, &turn.to_rotation_matrix());
            if best.is_none_or(|best| loss < best.loss) {
                best = Some(Candidate { camera_from_base: turn * camera_from_base, loss });
            }
        }
        found.extend(best);
    }
    found
}

fn loss(frames: &[Frame], templates: &[Vec<Place>], turn: &Rotation3<f64>) -> f64 {
    let losses = frames.iter().zip(templates).map(|(frame, template)| {
        let lens = frame.lens(Frame::COARSEST);
        let turned = template.iter().map(|place| turned(place, lens, turn.matrix()));
        frame.outline_apart(turned)
    });
    super::search::mean(losses)
}

/// The same place seen by a camera that has turned.
fn turned(place: &Place, lens: &Lens, turn: &Matrix3<f64>) -> Place {
    let point = turn * place.point;
    let pixel = lens.project(&point);
    // A point a little further out, in the camera's frame.
    let out = Vector3::new(place.outward[0] / lens.focal[0], place.outward[1] / lens.focal[1], 0.0) * place.point.z;
    let beside = lens.project(&(point + turn * out));
    let outward = [beside[0] - pixel[0], beside[1] - pixel[1]];
    let length = outward[0].hypot(outward[1]).max(1e-9);
    Place { point, pixel, outward: outward.map(|v| v / length), ..*place }
}

/// The outline as a camera with a wider picture sees it, thinned out.
fn template(frame: &Frame, shape: &Shape, camera_from_base: &Isometry3<f64>, angle: f64) -> Vec<Place> {
    let (lens, size) = (frame.lens(Frame::COARSEST), frame.size(Frame::COARSEST));
    let more = (1.3 * angle * lens.focal[0]).ceil();
    let wider = Lens { focal: lens.focal, centre: lens.centre.map(|c| c + more) };
    let mut outliner = Outliner::new(size[0] + 2 * more as usize, size[1] + 2 * more as usize, wider);
    let mut outline = Vec::new();
    outliner.outline(&shape.coarse, &frame.placed(camera_from_base), &mut outline);
    let every = outline.len().div_ceil(LOOKED_UP).max(1);
    let thinned = outline.iter().step_by(every);
    thinned.map(|place| Place { length: place.length * every as f64, ..*place }).collect()
}
