//! From a rough start to the pose: look, refine what looks good, keep the best, shake it, say how sure it is.

use super::frame::Frame;
use super::interval::{Interval, interval};
use super::refine::{self, Refined, refine};
use super::scan::{places, scan};
use super::search::{Moves, Reach, mean};
use super::shape::Shape;
use nalgebra::{Isometry3, Vector6};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shared_mem::progress::{Planned, Progress};
use std::sync::atomic::{AtomicU64, Ordering};
use twin::pose_fit::moved;

/// Which way to go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Scan, then least squares on the outline.
    Outline,
    /// The paper's particle swarm on the share of wrong pixels, with at most so many of them.
    Swarm(usize),
}

/// A pose and how it was found.
#[derive(Debug, Clone)]
pub struct Fit {
    pub camera_from_base: Isometry3<f64>,
    /// Share of wrong pixels (masks), or distance of the outline to edges, 0 to 1 (photos); mean of the frames.
    pub loss: f64,
    /// Share of the outline that the pictures confirm, 0 to 1.
    pub confirmed: f64,
    /// The same of the next best pose that is another one.
    pub rival: Option<f64>,
    /// 95 % interval.
    pub interval: Option<Interval>,
    /// How many times the robot was drawn.
    pub drawings: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum NoFit {
    /// Too little of the robot is where the camera looks.
    #[error(
        "no pose near the start shows the robot: it lies outside of the view; give another --start, a larger --reach, or \
         --start search"
    )]
    OutOfView,
    /// A pose was found, but hardly any of the outline is confirmed.
    #[error(
        "the robot's outline is not in the picture: hardly any of it was found; give a --start nearer to the truth, a mask, \
         or check that picture and joints belong together"
    )]
    NotFound,
}

/// Poses looked at more closely, fully, and tried around the best.
const CANDIDATES: usize = 24;
const FULLY: usize = 4;
const SHAKES: usize = 8;
const SHAKE_ROUNDS: usize = 2;
/// Pictures that the first look uses.
const LOOKED_AT: usize = 3;
/// How far the best pose is shaken [rad, and share of the distance to the robot].
const SHAKEN: f64 = 0.02;
/// Less of the outline confirmed is no answer.
const MIN_CONFIRMED: f64 = 0.3;
/// Poses nearer than this are one [rad, share of the distance].
const SAME_POSE: f64 = 0.01;

/// The pose near `start` that explains the frames best.
///
/// # Errors
/// [`NoFit`] when the robot is not to be seen there.
pub fn fit(
    frames: &[Frame],
    shape: &Shape,
    start: &Isometry3<f64>,
    reach: &Reach,
    method: Method,
    seed: u64,
) -> Result<Fit, NoFit> {
    let bar = Progress::planned("viewpoint", &[&[BEGIN], &plan(frames, method)[..]].concat(), 1);
    fit_shown(frames, shape, start, (reach, method, seed), &bar)
}

/// The same, shown as stages of a longer work.
pub(super) fn fit_shown(
    frames: &[Frame],
    shape: &Shape,
    start: &Isometry3<f64>,
    (reach, method, seed): (&Reach, Method, u64),
    bar: &Progress,
) -> Result<Fit, NoFit> {
    match method {
        Method::Outline => by_outline(frames, shape, start, (reach, seed), bar),
        Method::Swarm(evaluations) => {
            bar.stage(SWARM, evaluations as u64);
            let done = |evaluations: usize| bar.show(evaluations as u64, SWARM);
            let searched = Moves::new(frames, start, reach).swarm(frames, shape, (evaluations, seed), done);
            let there = refine::at(frames, shape, &searched.camera_from_base).ok_or(NoFit::OutOfView)?;
            let confirmed = 1.0 - there.cost;
            Ok(Fit {
                camera_from_base: searched.camera_from_base,
                loss: searched.loss,
                confirmed,
                rival: None,
                interval: interval(&there, frames.len()),
                drawings: searched.evaluations * frames.len(),
            })
        }
    }
}

fn by_outline(
    frames: &[Frame],
    shape: &Shape,
    start: &Isometry3<f64>,
    (reach, seed): (&Reach, u64),
    bar: &Progress,
) -> Result<Fit, NoFit> {
    let few = &frames[..frames.len().min(LOOKED_AT)];
    let rounds = rounds(frames);
    let wanted = if rounds == 0 { CANDIDATES / 3 } else { CANDIDATES };
    bar.stage(SCAN, places(start, reach).len() as u64);
    let looked = AtomicU64::new(0);
    let (candidates, mut drawings) =
        scan(few, shape, start, reach, wanted, || bar.show(looked.fetch_add(1, Ordering::Relaxed) + 1, SCAN));
    let mut poses: Vec<Isometry3<f64>> = candidates.iter().map(|c| c.camera_from_base).collect();
    poses.push(*start);
    bar.stage(COARSE, poses.len() as u64);
    let coarse = refined(&poses, (&mut drawings, bar, COARSE), |pose| refine(few, shape, pose, refine::COARSE));
    let poses: Vec<_> = coarse.iter().take(FULLY).map(|found| found.camera_from_base).collect();
    bar.stage(FINE, poses.len() as u64);
    let mut found = refined(&poses, (&mut drawings, bar, FINE), |pose| refine(frames, shape, pose, refine::FINE));
    let mut random = Pcg64::seed_from_u64(seed);
    for _ in 0..rounds {
        bar.stage(FINE, SHAKES as u64);
        let Some(best) = found.first() else { break };
        let far = best.pivot.coords.norm();
        let shaken: Vec<_> = (0..SHAKES)
            .map(|_| {
                let by = Vector6::from_fn(|i, _| {
                    2.0 * (random.random::<f64>() - 0.5) * SHAKEN * if i < 3 { 1.0 } else { far }
                });
                moved(&best.camera_from_base, &best.pivot, &by)
            })
            .collect();
        found.extend(refined(&shaken, (&mut drawings, bar, FINE), |pose| refine(frames, shape, pose, refine::FINE)));
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    }
    let best = found.first().ok_or(NoFit::OutOfView)?;
    if 1.0 - best.cost < MIN_CONFIRMED {
        return Err(NoFit::NotFound);
    }
    let other = found.iter().find(|other| {
        let (distance, angle) = super::step::apart(&other.camera_from_base, &best.camera_from_base);
        distance > SAME_POSE * best.pivot.coords.norm() || angle > SAME_POSE
    });
    bar.stage(LAST_STAGE, 1);
    let last = refine(frames, shape, &best.camera_from_base, refine::LAST).unwrap_or_else(|| best.clone());
    let pose = last.camera_from_base;
    Ok(Fit {
        camera_from_base: pose,
        loss: mean(frames.iter().map(|frame| frame.wrong(Frame::FINEST, shape, &pose))),
        confirmed: 1.0 - best.cost,
        rival: other.map(|other| 1.0 - other.cost),
        interval: interval(&last, frames.len()),
        drawings: drawings + last.drawings,
    })
}

/// Before the first stage.
pub(super) const BEGIN: Planned = ("begin", 0.0);
const SCAN: &str = "scan";
const COARSE: &str = "coarse";
const FINE: &str = "fine";
const LAST_STAGE: &str = "last";
const SWARM: &str = "swarm";

/// How often the best pose is shaken: a silhouette has one border, a photo many edges, and there the best pose needs more
/// company.
fn rounds(frames: &[Frame]) -> usize {
    if frames.iter().all(Frame::has_mask) { 0 } else { SHAKE_ROUNDS }
}

/// Stages of the search, with how long they took of one photo [s].
pub(super) fn plan(frames: &[Frame], method: Method) -> Vec<Planned> {
    match method {
        Method::Outline => {
            let fine = std::iter::repeat_n((FINE, 1.6), 1 + rounds(frames));
            [(SCAN, 4.6), (COARSE, 2.6)].into_iter().chain(fine).chain([(LAST_STAGE, 0.2)]).collect()
        }
        Method::Swarm(_) => vec![(SWARM, 10.0)],
    }
}

/// Every pose refined, the best first.
fn refined(
    poses: &[Isometry3<f64>],
    (drawings, bar, stage): (&mut usize, &Progress, &str),
    refine: impl Fn(&Isometry3<f64>) -> Option<Refined> + Send + Sync,
) -> Vec<Refined> {
    let done = AtomicU64::new(0);
    let one = |pose: &Isometry3<f64>| {
        let found = refine(pose);
        bar.show(done.fetch_add(1, Ordering::Relaxed) + 1, stage);
        found
    };
    let mut found: Vec<Refined> = poses.par_iter().filter_map(one).collect();
    *drawings += found.iter().map(|found| found.drawings).sum::<usize>();
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found
}
