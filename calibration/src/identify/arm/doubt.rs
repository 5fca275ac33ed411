//! What speaks against trusting a fit although it looks sure of itself: something else acts, the joints come late as a
//! whole, the clips are not of one robot. Each in one sentence with the remedy.

use super::Model;
use crate::answer::identification::{Figures, Identification};
use crate::identify::finding::Finding;
use crate::identify::used::Used;
use inference::controller::start::first_few;
use inference::estimate::{ClipFit, Fit};
use inference::likelihood::Setting;
use inference::statistics::median;
use nalgebra::DMatrix;
use shared_mem::time::seconds_between;
use twin::effects::{Parameter, Search, registry};

/// Residuals this many times as large as their sigmas are no noise (a choice).
const BEYOND_NOISE: f64 = 3.0;
/// An error that is no smaller than this share of what it was before is no better (a choice).
const NO_BETTER: f64 = 0.95;
/// Clips of one robot do not leave so little of their squared error when each may have parameters of its own (a choice).
const SHARE_LEFT_ALONE: f64 = 0.3;
/// A common delay that explains this share of what is left is worth searching (a choice).
const SHARE_OF_A_DELAY: f64 = 0.5;
/// Scaled information on parameters that hang together closer than this is held by as much of its own [1]: far above rounding.
const RIDGE: f64 = 1e-9;

/// Doubts about a fit that began at `before`, most telling first.
pub(super) fn doubts(
    answer: &Identification,
    finding: &Finding<'_>,
    model: &Model<'_>,
    clips: &Used,
    before: &[f64],
) -> Vec<String> {
    let mut doubts = Vec::new();
    let fit = &finding.fit;
    let misfit = fit.misfit().sqrt();
    if misfit < BEYOND_NOISE {
        return doubts;
    }
    if fit.clips.len() > 1 && alone(fit) < SHARE_LEFT_ALONE {
        doubts.push(format!(
            "every clip by itself leaves {:.0} % of the squared error that they leave together: they are not of one robot, \
             or its gains were changed in between; identify them apart",
            100.0 * alone(fit)
        ));
    }
    let is_lateness = |parameter: &Parameter| parameter.search == Search::Lateness;
    let searched = finding.settings.iter().filter_map(Setting::of_effect).any(is_lateness);
    let late = registry().iter().find(|effect| effect.parameters.iter().any(is_lateness));
    // Gains that were turned until they imitate a delay hide it.
    let delays = [&fit.shared[..], before].into_iter().filter_map(|numbers| delay(numbers, model, clips));
    let delay = delays.max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((delay, share)) = delay.filter(|(_, share)| *share > SHARE_OF_A_DELAY) {
        let (share, ms) = (100.0 * share, 1e3 * delay.abs());
        if delay < 0.0 {
            doubts.push(format!(
                "{share:.0} % of the error goes with the joints' speeds, as if they were {ms:.1} ms ahead of their \
                 commands: the two topics are not stamped by one clock; let one machine stamp both"
            ));
        } else if let Some(late) = late.filter(|_| !searched) {
            doubts.push(format!(
                "{share:.0} % of the error goes with the joints' speeds, as if all came {ms:.1} ms late: identify with \
                 `--also {}`",
                late.name
            ));
        }
    }
    let rms = |figures: &Figures| figures.joint_rms_rad.unwrap_or(f64::INFINITY);
    let gap = &answer.gap;
    if !clips.split.confirm.is_empty() && rms(&gap.holdout) > NO_BETTER * rms(&gap.holdout_before) {
        doubts.push(
            "on held-out clips the twin is no better than with the values it began with: `calibration diagnose` \
             says what else acts"
                .into(),
        );
    } else {
        doubts.push(format!(
            "what is left is {misfit:.0} times the encoders' noise, so something else acts: `calibration diagnose` says what"
        ));
    }
    doubts
}

/// Share of its squared error that the middle clip would leave with numbers of its own, as far as slopes tell.
fn alone(fit: &Fit) -> f64 {
    let share = |clip: &ClipFit| {
        let n = clip.information.nrows();
        let scale =
            DMatrix::from_diagonal(&clip.information.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 }));
        let scaled = &scale * &clip.information * &scale + DMatrix::identity(n, n) * RIDGE;
        let gradient = &scale * &clip.gradient;
        // By how much a Newton step of this clip alone would lower its squared error.
        let gain = scaled.cholesky().map_or(0.0, |factor| gradient.dot(&factor.solve(&gradient)));
        (1.0 - gain / clip.chi2.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    median(fit.clips.iter().map(share)).unwrap_or(1.0)
}

/// The delay of all joints together that explains most of what is left of the positions [s], and its share of it; every
/// joint counts alike, and its mean error is left out.
fn delay(numbers: &[f64], model: &Model<'_>, clips: &Used) -> Option<(f64, f64)> {
    let dof = model.arm().dof();
    // Joint by joint: sums of error x speed, speed squared, error squared.
    let mut sums = vec![[0.0; 3]; dof];
    for clip in first_few(&clips.split.train) {
        let predicted = model.predict_in(1, (*clip, numbers, &[])).ok()?;
        let clip = model.clip(*clip);
        let measured = &clip.recorded.measured;
        let rows: Vec<usize> = clip.averaged().map(|bin| bin[0]).collect();
        for (joint, sums) in sums.iter_mut().enumerate() {
            let q = |row: usize| measured.q_row(row)[joint];
            let seconds = |a: usize, b: usize| seconds_between(measured.stamps_ns[a], measured.stamps_ns[b]);
            let pairs = rows
                .windows(3)
                .map(|w| (q(w[1]) - predicted[w[1]].state.q[joint], (q(w[2]) - q(w[0])) / seconds(w[0], w[2])));
            let pairs: Vec<(f64, f64)> = pairs.collect();
            let mean = pairs.iter().map(|(error, _)| error).sum::<f64>() / pairs.len().max(1) as f64;
            for (error, speed) in pairs {
                let error = error - mean;
                sums[0] += error * speed;
                sums[1] += speed * speed;
                sums[2] += error * error;
            }
        }
    }
    // Each joint's sums over its squared error, so that a joint that follows badly does not speak for all.
    let moving: Vec<[f64; 3]> = sums.into_iter().filter(|[_, speed, error]| *speed > 0.0 && *error > 0.0).collect();
    let weighted = |k: usize| moving.iter().map(|sums| sums[k] / sums[2]).sum::<f64>();
    let (cross, speed, all) = (weighted(0), weighted(1), moving.len() as f64);
    (all > 0.0).then(|| (-cross / speed, cross * cross / speed / all))
}
