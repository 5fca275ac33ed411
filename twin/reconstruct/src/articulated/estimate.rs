//! The joint out of two states: poses of the whole, for each of them poses of a part, each as a hinge and as a slide; what explains
//! both surfaces best.

use super::body::{Body, Place, Sample};
use super::fit::{Pair, Points, carried};
use super::motion::{Joint, Motion};
use super::search::{Open, apart, poses};
use super::{ArticulatedError, go_on};
use nalgebra::{DMatrix, Isometry3, Point3, Translation3, Vector3};
use rayon::prelude::*;
use shared_mem::progress::Progress;
use shared_mem::statistics::robust_sigma;

/// Poses of the whole that are looked at, and poses of a part for each.
const WHOLES: usize = 5;
const PARTS: usize = 8;
/// Points of each state: in the search, in its fits, at the end.
const SEARCHED: usize = 2000;
const SKETCHED: usize = 600;
const REFINED: usize = 5000;
/// Tolerances of the fits, of the object's size.
const COARSE: f64 = 0.02;
const MIDDLE: f64 = 0.0125;
const FIT_STEPS: usize = 12;
/// Noise with which candidates are compared, of the object's size.
const NOISE: f64 = 0.003;
/// Points further away than so many standard deviations are not on the surface.
const WITHIN: f64 = 4.0;
/// Least tolerance, of the object's size.
const MIN_TOLERANCE: f64 = 0.004;
/// Costs of a point that is hidden or in the open, in the units of half a squared standard deviation's ratio.
const HIDDEN: f64 = 3.0;
const FREE: f64 = 7.0;
/// Points of which neighbours share their error: so many of them count as one.
const TOGETHER: f64 = 8.0;
/// A pose that leaves the object where it was, of its size.
const UNMOVED: f64 = 0.03;
/// Cost of an axis away from the parts: this share for each size of the object.
const LOOSE: f64 = 1.5;
/// The frame is common to both states if that costs at most so much more [share].
const COMMON: f64 = 0.03;

/// The joint, and how sure it is.
#[derive(Debug, Clone)]
pub(super) struct Estimate {
    /// From the first state to the second, with the joint in the first state's frame.
    pub(super) motion: Motion,
    /// Noise of both surfaces together [m], and up to which distance a point is on a surface [m].
    pub(super) sigma: f64,
    pub(super) tolerance: f64,
    /// How much better it explains the states than a joint of the other kind, as the difference of BIC.
    pub(super) evidence: f64,
    /// Standard deviations: of the direction [rad], of the axis' place across it near the part [m], of the travel [rad or m].
    pub(super) deviations: [f64; 3],
    /// Share of both surfaces that no motion explains.
    pub(super) unexplained: f64,
    /// Share of the surfaces that moves with the part.
    pub(super) share: f64,
}

struct Candidate {
    motion: Motion,
    joint: Joint,
    cost: f64,
}

pub(super) fn estimate(pair: &Pair<'_>, bar: &Progress) -> Result<Estimate, ArticulatedError> {
    let size = pair.size();
    let points = pair.points(SEARCHED);
    let aligned = Isometry3::from_parts(Translation3::from(pair.second.middle - pair.first.middle), nalgebra::one());
    let wholes = poses(pair, &Open::all(&points), &[Isometry3::identity(), aligned], WHOLES);
    let mut candidates: Vec<Candidate> = Vec::new();
    for (number, (_, whole)) in wholes.iter().enumerate() {
        go_on()?;
        bar.show(1 + number as u64, "search");
        candidates.extend(parts(pair, &points, whole));
    }
    go_on()?;
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let best = candidates.first().ok_or(ArticulatedError::Still { noise: MIDDLE * size })?;
    let in_place = |candidate: &&Candidate| {
        let still = |pose: &Isometry3<f64>| apart(pair.first, pose, &Isometry3::identity()) < UNMOVED * size;
        candidate.motion.poses().iter().any(still)
    };
    let common = candidates.iter().find(in_place).filter(|c| c.cost < (1.0 + COMMON) * best.cost);
    let chosen = common.unwrap_or(best);
    refined(pair, chosen.motion, chosen.joint)
}

/// Candidates for the part when the whole has a pose.
fn parts(pair: &Pair<'_>, points: &Points<'_>, whole: &Isometry3<f64>) -> Vec<Candidate> {
    let size = pair.size();
    let open = Open::beside(pair, points, whole, MIDDLE * size);
    let found = poses(pair, &open, &[*whole], PARTS);
    let sketch = pair.points(SKETCHED);
    let tried: Vec<(Isometry3<f64>, bool)> =
        found.iter().flat_map(|(_, part)| [(*part, true), (*part, false)]).collect();
    let candidate = |(part, turns): (Isometry3<f64>, bool)| {
        let near = middle_of(pair, &open, &part);
        let rel = whole.inverse() * part;
        let joint = if turns { Joint::hinge(&rel, &near) } else { Joint::slide(&rel, &near) };
        let mut motion = Motion::Jointed(*whole, joint);
        for share in [COARSE, MIDDLE] {
            motion = pair.fitted(motion, &sketch, share * size, FIT_STEPS);
        }
        let Motion::Jointed(_, joint) = motion else { return None };
        let apart = 1.0 + LOOSE * gap(pair, &motion, &joint, points);
        let cost = cost(pair, &motion.poses(), points, NOISE * size) * apart;
        (cost.is_finite() && plausible(&joint, pair.first)).then_some(Candidate { motion, joint, cost })
    };
    tried.into_par_iter().filter_map(candidate).collect()
}

/// An axis far away from the object is none.
fn plausible(joint: &Joint, body: &Body) -> bool {
    match joint.near(&body.middle) {
        Joint::Revolute { point, .. } => (point - body.middle).norm() < 10.0 * body.size,
        Joint::Prismatic { travel } => travel.norm() < 2.0 * body.size,
    }
}

/// How far a hinge's axis is from what stays or from what moves, whichever is further [share of the object's size]: plates that are
/// turned over look alike, but the axis of such a motion lies where nothing is.
fn gap(pair: &Pair<'_>, motion: &Motion, joint: &Joint, points: &Points<'_>) -> f64 {
    let Joint::Revolute { point, axis, .. } = joint else { return 0.0 };
    let poses = motion.poses();
    let mut nearest = [f64::INFINITY; 2];
    for sample in points.first {
        if let Some((which, ..)) = carried(sample, pair.second, &poses, MIDDLE * pair.size()) {
            nearest[which] = nearest[which].min(axis.cross(&(sample.point - point)).norm());
        }
    }
    nearest[0].max(nearest[1]).min(pair.size()) / pair.size()
}

/// Middle of the open points of the first state that a pose explains.
fn middle_of(pair: &Pair<'_>, open: &Open, part: &Isometry3<f64>) -> Point3<f64> {
    let on = |sample: &Sample| matches!(pair.second.place_of(sample, part, MIDDLE * pair.size()), Place::On(..));
    let on: Vec<Vector3<f64>> = open.first.iter().filter(|(s, _)| on(s)).map(|(s, _)| s.point.coords).collect();
    if on.is_empty() { pair.first.middle } else { (on.iter().sum::<Vector3<f64>>() / on.len() as f64).into() }
}

/// Negative logarithm of the likelihood, up to a constant: each point on its surface with noise, hidden, or in the open.
fn cost(pair: &Pair<'_>, poses: &[Isometry3<f64>; 2], points: &Points<'_>, sigma: f64) -> f64 {
    let tolerance = WITHIN * sigma;
    let back = poses.map(|pose| pose.inverse());
    let of = |samples: &[Sample], other: &Body, poses: &[Isometry3<f64>; 2]| {
        let place = |sample: &Sample, pose: &Isometry3<f64>| match other.place_of(sample, pose, tolerance) {
            Place::On(distance, _) => (0.5 * (distance / sigma).powi(2)).min(HIDDEN),
            Place::Hidden => HIDDEN,
            Place::Free => FREE,
        };
        samples.iter().map(|s| place(s, &poses[0]).min(place(s, &poses[1]))).sum::<f64>()
    };
    (of(points.first, pair.second, poses) + of(points.second, pair.first, &back)) / TOGETHER
}

/// Residuals of the points on surfaces, and which of them move with the part.
fn residuals(pair: &Pair<'_>, poses: &[Isometry3<f64>; 2], points: &Points<'_>, tolerance: f64) -> Vec<(usize, f64)> {
    let back = poses.map(|pose| pose.inverse());
    let of = |samples: &[Sample], other: &Body, poses: &[Isometry3<f64>; 2]| {
        samples.iter().filter_map(|s| carried(s, other, poses, tolerance)).map(|(which, r, _)| (which, r)).collect()
    };
    let mut all: Vec<(usize, f64)> = of(points.first, pair.second, poses);
    all.extend::<Vec<_>>(of(points.second, pair.first, &back));
    all
}

/// Standard deviation of the residuals [m].
fn noise(pair: &Pair<'_>, motion: &Motion, points: &Points<'_>, tolerance: f64) -> f64 {
    robust_sigma(residuals(pair, &motion.poses(), points, tolerance).into_iter().map(|(_, r)| r)).unwrap_or(0.0)
}

/// The joint with all points, as both kinds.
fn refined(pair: &Pair<'_>, motion: Motion, joint: Joint) -> Result<Estimate, ArticulatedError> {
    let (size, points) = (pair.size(), pair.points(REFINED));
    let [whole, part] = pair.fitted(motion, &points, MIDDLE * size, FIT_STEPS).poses();
    let least = MIN_TOLERANCE * size;
    let tolerance = (WITHIN * noise(pair, &motion, &points, MIDDLE * size)).clamp(least, MIDDLE * size);
    let rel = whole.inverse() * part;
    let near = middle_of(pair, &Open::beside(pair, &points, &whole, tolerance), &part);
    let fit = |joint: Joint| pair.fitted(Motion::Jointed(whole, joint), &points, tolerance, 3 * FIT_STEPS);
    let slide = fit(Joint::slide(&rel, &near));
    let turn = match joint {
        Joint::Revolute { .. } => fit(joint),
        Joint::Prismatic { .. } => fit(Joint::hinge(&rel, &near)),
    };
    let sigma = noise(pair, &turn, &points, tolerance).min(noise(pair, &slide, &points, tolerance)).max(1e-4 * size);
    let count = (points.first.len() + points.second.len()) as f64 / TOGETHER;
    let criterion =
        |motion: &Motion| 2.0 * cost(pair, &motion.poses(), &points, sigma) + motion.freedoms() as f64 * count.ln();
    // A hinge whose axis is many sizes of the object away is a slide.
    let turns = matches!(turn, Motion::Jointed(_, joint) if plausible(&joint, pair.first));
    let evidence = if turns { criterion(&slide) - criterion(&turn) } else { f64::NEG_INFINITY };
    let motion = in_place(pair, if evidence > 0.0 { turn } else { slide });
    Ok(Estimate::of(pair, motion, (sigma, tolerance), evidence.abs()))
}

impl Estimate {
    fn of(pair: &Pair<'_>, motion: Motion, (sigma, tolerance): (f64, f64), evidence: f64) -> Self {
        let points = pair.points(REFINED);
        let poses = motion.poses();
        let on = residuals(pair, &poses, &points, tolerance);
        let total = (points.first.len() + points.second.len()) as f64;
        let covariance = pair.covariance(&motion, &points, tolerance, sigma);
        Self {
            motion,
            sigma,
            tolerance,
            evidence,
            deviations: deviations(&motion, &covariance, 0.5 * pair.size()),
            unexplained: free(pair, &poses, &points, tolerance) / total,
            share: on.iter().filter(|(which, _)| *which == 1).count() as f64 / on.len().max(1) as f64,
        }
    }

    /// The same fitted again, once it is known which points move.
    pub(super) fn again(&self, pair: &Pair<'_>) -> Self {
        let motion = pair.fitted(self.motion, &pair.points(REFINED), self.tolerance, 3 * FIT_STEPS);
        Self::of(pair, motion, (self.sigma, self.tolerance), self.evidence)
    }
}

/// If the part is what stays where it was, the names are exchanged: what stays is the whole.
fn in_place(pair: &Pair<'_>, motion: Motion) -> Motion {
    let Motion::Jointed(whole, joint) = motion else { return motion };
    let [one, other] = motion.poses().map(|pose| apart(pair.first, &pose, &Isometry3::identity()));
    if other < UNMOVED * pair.size() && one > other {
        return Motion::Jointed(whole * joint.motion(), joint.reversed());
    }
    motion
}

/// Points that are in the open whatever moves them.
fn free(pair: &Pair<'_>, poses: &[Isometry3<f64>; 2], points: &Points<'_>, tolerance: f64) -> f64 {
    let back = poses.map(|pose| pose.inverse());
    let of = |samples: &[Sample], other: &Body, poses: &[Isometry3<f64>; 2]| {
        let is = |s: &&Sample| poses.iter().all(|pose| matches!(other.place_of(s, pose, 2.0 * tolerance), Place::Free));
        samples.iter().filter(is).count()
    };
    (of(points.first, pair.second, poses) + of(points.second, pair.first, &back)) as f64
}

/// Standard deviations of direction, place and travel.
fn deviations(motion: &Motion, covariance: &DMatrix<f64>, reach: f64) -> [f64; 3] {
    let variance = |i: usize| covariance[(6 + i, 6 + i)].max(0.0);
    match motion {
        Motion::Pose(_) => [f64::INFINITY; 3],
        Motion::Jointed(_, Joint::Revolute { .. }) => [
            (variance(0).max(variance(1))).sqrt() / reach,
            variance(2).max(variance(3)).sqrt(),
            variance(4).sqrt() / reach,
        ],
        Motion::Jointed(_, Joint::Prismatic { travel }) => {
            let largest = (0..3).map(variance).fold(0.0, f64::max).sqrt();
            [largest / travel.norm().max(1e-9), 0.0, largest]
        }
    }
}
