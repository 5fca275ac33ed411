//! Where nothing is known: the camera stands somewhere around the robot, upright, and looks at it.

use super::fit::{BEGIN, Fit, Method, NoFit, fit_shown, plan};
use super::frame::Frame;
use super::kept::{KeptFit, KeptPose, Seen};
use super::lens::Lens;
use super::scan::scan;
use super::search::Reach;
use super::shape::Shape;
use inference::kept::{Fingerprint, Kept};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use shared_mem::progress::{Planned, Progress};

/// Places looked from: around, and from the table's height to far above [rad], away from the robot [m].
const BEARINGS: usize = 16;
const HEIGHTS: [f64; 4] = [0.1, 0.4, 0.7, 1.1];
const DISTANCES: [f64; 4] = [0.9, 1.3, 1.8, 2.5];
/// What is looked at: the middle of an arm [m].
const MIDDLE: f64 = 0.4;
/// The turn within which each place is looked at, and so many places that are followed.
const TURN: f64 = 0.35;
const FOLLOWED: usize = 5;
/// The stage in which they are looked from, beside those of a fit as one photo took them.
const PLACES_STAGE: Planned = ("places", 46.0);

/// The pose that explains the frames best, from anywhere around the robot. Every place and every fit is a step that is kept.
///
/// # Errors
/// As [`fit`].
pub fn search(
    frames: &[Frame],
    shape: &Shape,
    lens: &Lens,
    (method, seed): (Method, u64),
    kept: &Kept,
) -> Result<Fit, NoFit> {
    let reach = Reach { angle: TURN, distance: 0.0 };
    let mut seen = Vec::new();
    let mut drawings = 0;
    let places = BEARINGS * HEIGHTS.len() * DISTANCES.len();
    let followed = std::iter::repeat_n(plan(frames, method), FOLLOWED).flatten();
    let stages: Vec<_> = [BEGIN, PLACES_STAGE].into_iter().chain(followed).collect();
    let bar = Progress::planned("viewpoint", &stages, 1);
    bar.stage(PLACES_STAGE.0, places as u64);
    for place in 0..places {
        let around = std::f64::consts::TAU * (place % BEARINGS) as f64 / BEARINGS as f64;
        let height = HEIGHTS[place / BEARINGS % HEIGHTS.len()];
        // A long lens stands further away: what is far follows from the field of view.
        let away =
            DISTANCES[place / BEARINGS / HEIGHTS.len()] * (lens.focal[1] / (2.0 * lens.centre[1].max(1.0))).max(0.5);
        let from = Vector3::new(around.cos() * height.cos(), around.sin() * height.cos(), height.sin()) * away;
        let Seen { best, drawings: drawn } = kept.once(&Fingerprint::of("place").with(&place), || {
            let (candidates, drawings) = scan(&frames[..1], shape, &looking(&from), &reach, 1, || ());
            let best = candidates.first().map(|best| (KeptPose::of(&best.camera_from_base), best.loss));
            Seen { best, drawings }
        });
        bar.show(place as u64 + 1, PLACES_STAGE.0);
        drawings += drawn;
        seen.extend(best);
    }
    seen.sort_by(|a, b| a.1.total_cmp(&b.1));
    let reach = Reach { angle: 0.3, distance: 0.3 };
    let mut best: Result<Fit, NoFit> = Err(NoFit::OutOfView);
    for (number, (start, _)) in seen.iter().take(FOLLOWED).enumerate() {
        let step = Fingerprint::of("followed").with(&number);
        let follow = || fit_shown(frames, shape, &start.pose(), (&reach, method, seed), &bar).map(KeptFit::of);
        let found = kept.once(&step, follow).map(KeptFit::fit);
        drawings += found.as_ref().map_or(0, |found| found.drawings);
        best = match (best, found) {
            (Ok(best), Ok(found)) if found.confirmed > best.confirmed => Ok(found),
            (Ok(best), _) => Ok(best),
            (Err(_), found) => found,
        };
    }
    best.map(|best| Fit { drawings, ..best })
}

/// Camera pose at `from` the robot's middle, looking at it, upright.
fn looking(from: &Vector3<f64>) -> Isometry3<f64> {
    let middle = Point3::new(0.0, 0.0, MIDDLE);
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    turned * Isometry3::look_at_rh(&(middle + from), &middle, &Vector3::z())
}
