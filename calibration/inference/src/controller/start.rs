//! Where the search begins when cell.toml states gains only by wide ranges, or a delay is searched: least squares find the
//! bottom of a valley, not the valley.

use crate::estimate::{ClipModel as _, Unknown};
use crate::interrupt::Interrupt;
use crate::likelihood::arm::ArmClips;
use crate::likelihood::{Likelihood as _, Setting};
use rayon::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::theta::Theta;
use twin::effects::Search;

/// Gains are tried at these powers of two times where they begin (a choice: ranges span two decades at most).
const GAIN_POWERS: std::ops::RangeInclusive<i32> = -4..=4;
/// Delays that are tried [s] (a choice).
const DELAYS: [f64; 6] = [0.0, 0.005, 0.01, 0.02, 0.04, 0.08];
/// So many clips say where the valley is (a choice), whatever is looked for coarsely.
const CLIPS_OF_A_COARSE_LOOK: usize = 3;

/// The first few of some clips, by which it is looked coarsely.
pub fn first_few(clips: &[usize]) -> &[usize] {
    &clips[..clips.len().min(CLIPS_OF_A_COARSE_LOOK)]
}

/// One place of the coarse grid: what was tried, and each joint's sum of squares there.
struct Tried {
    delay: f64,
    numbers: Vec<f64>,
    costs: Joints,
}

/// Moves the starts of gains that are known by range alone, joint by joint, and of a delay, to the best of a coarse grid.
pub fn improve<F: Fn(&[f64]) -> Theta + Sync>(
    cell: &Cell,
    model: &ArmClips<F>,
    train: &[usize],
    settings: &[Setting],
    unknowns: &mut [Unknown],
    interrupt: &Interrupt,
) {
    let ranged = is_ranged(cell);
    let delayed = settings.iter().any(is_delay);
    if !ranged && !delayed {
        return;
    }
    // Of what is not searched the grid holds the one value that changes nothing: a power of 0, a delay of 0.
    let powers: Vec<i32> = if ranged { GAIN_POWERS.collect() } else { vec![0] };
    let delays = if delayed { &DELAYS[..] } else { &DELAYS[..1] };
    let grid: Vec<(f64, i32)> = delays.iter().flat_map(|delay| powers.iter().map(|power| (*delay, *power))).collect();
    let clips = first_few(train);
    let all: Vec<Tried> = grid
        .par_iter()
        .map(|(delay, power)| {
            let numbers = place(settings, unknowns, *delay, *power);
            let costs = if interrupt.asked() { [f64::INFINITY; MAX_JOINTS] } else { costs(model, clips, &numbers) };
            Tried { delay: *delay, numbers, costs }
        })
        .collect();
    choose(model.arm().dof(), &all, settings, unknowns);
}

/// Whether cell.toml knows gains by range alone.
pub fn is_ranged(cell: &Cell) -> bool {
    let controller = cell.controller.as_ref();
    let ranged = |values: &[f64], range: bool| range || values.is_empty();
    controller.is_some_and(|law| {
        ranged(&law.stiffness, law.stiffness_range.is_some()) || ranged(&law.damping, law.damping_range.is_some())
    })
}

fn is_delay(setting: &Setting) -> bool {
    setting.search() == Some(Search::Lateness)
}

fn place(settings: &[Setting], unknowns: &[Unknown], delay: f64, power: i32) -> Vec<f64> {
    let number = |(unknown, setting): (&Unknown, &Setting)| {
        let value = match setting {
            Setting::Stiffness(_) => unknown.start * 2.0_f64.powi(power),
            // The damping follows so that the joint stays as damped as it was.
            Setting::Damping(_) => unknown.start * 2.0_f64.powi(power).sqrt(),
            setting if is_delay(setting) => delay,
            _ => unknown.start,
        };
        value.clamp(unknown.lower, unknown.upper)
    };
    unknowns.iter().zip(settings).map(number).collect()
}

/// Of the delay that is best for all joints together, each joint takes the gains that are best for it.
fn choose(dof: usize, all: &[Tried], settings: &[Setting], unknowns: &mut [Unknown]) {
    let best = |delay: f64, joint: usize| {
        let with = all.iter().filter(|tried| tried.delay == delay);
        with.min_by(|a, b| a.costs[joint].total_cmp(&b.costs[joint]))
    };
    let total =
        |delay: f64| (0..dof).map(|joint| best(delay, joint).map_or(f64::INFINITY, |t| t.costs[joint])).sum::<f64>();
    let delays = all.iter().map(|tried| tried.delay);
    let Some(delay) = delays.min_by(|a, b| total(*a).total_cmp(&total(*b))) else { return };
    // The delay is one for all joints, so its column is taken from the first.
    for (k, (setting, unknown)) in settings.iter().zip(unknowns).enumerate() {
        let joint = setting.joint().unwrap_or(0);
        if let Some(tried) = best(delay, joint).filter(|tried| tried.costs[joint].is_finite()) {
            unknown.start = tried.numbers[k];
        }
    }
}

/// Sum of squared residuals of each joint; infinite where the twin cannot be simulated.
pub fn costs<F: Fn(&[f64]) -> Theta + Sync>(model: &ArmClips<F>, clips: &[usize], numbers: &[f64]) -> Joints {
    let mut sums = [0.0; MAX_JOINTS];
    let mut out = Vec::new();
    for clip in clips {
        if model.residuals(*clip, numbers, &[], &mut out).is_err() {
            return [f64::INFINITY; MAX_JOINTS];
        }
        for (row, residual) in model.rows(*clip).iter().zip(&out) {
            sums[row.channel] += residual * residual;
        }
    }
    sums
}
