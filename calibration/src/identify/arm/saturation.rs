//! Where the search for the joints' torque limits begins. Without a limit nothing depends on it, so that no slope leads
//! there; a limit that already clips some torque has one.

use super::Model;
use inference::controller::start::{costs, first_few};
use inference::estimate::{ClipModel, Fit, Schedule, Subset, Unknown, fit};
use inference::interrupt::Interrupt;
use inference::likelihood::Setting;
use rayon::prelude::*;
use twin::effects::Search;

/// Limits that are tried, each this many times lower than the one before [1] (a choice)...
const LADDER_RATIO: f64 = 1.4;
/// ...from the highest that an arm of this size has [N m]: joints 1 to 4 of an FR3 (its data sheet).
const HIGHEST_LIMIT: f64 = 87.0;
/// A limit is there when it leaves less than this share of its joint's squared error (a choice).
const ERROR_LEFT_BY_A_LIMIT: f64 = 0.9;
/// Iterations of the rough fit before (a choice).
const ROUGH_ITERATIONS: usize = 4;

/// Moves the start of each joint's limit, one after the other, to the best of a ladder; where none is better it stays without.
pub(super) fn improve(
    model: &Model<'_>,
    train: &[usize],
    settings: &[Setting],
    unknowns: &mut [Unknown],
    interrupt: &Interrupt,
) {
    let clips = first_few(train);
    if settings.iter().all(|setting| limited(setting).is_none()) {
        return;
    }
    bring_near(model, clips, settings, unknowns, interrupt);
    for k in 0..settings.len() {
        let Some(joint) = limited(&settings[k]) else { continue };
        // Limits that were found before are among them: a joint that is clipped moves what hangs on it.
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let cost = |inverse: f64| {
            let mut numbers = numbers.clone();
            numbers[k] = inverse;
            if interrupt.asked() { f64::INFINITY } else { costs(model, clips, &numbers)[joint] }
        };
        let ladder: Vec<f64> =
            std::iter::successors(Some(HIGHEST_LIMIT.recip()), |inverse| Some(inverse * LADDER_RATIO))
                .take_while(|inverse| *inverse <= unknowns[k].upper)
                .collect();
        let tried: Vec<(f64, f64)> = ladder.into_par_iter().map(|inverse| (inverse, cost(inverse))).collect();
        let best = tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let without = cost(numbers[k]);
        if let Some((inverse, _)) = best.filter(|(_, with)| *with < ERROR_LEFT_BY_A_LIMIT * without) {
            unknowns[k].start = inverse;
        }
    }
}

/// Takes away limits without which the twin is as good where the search ended: they say nothing there, and elsewhere they
/// would clip.
pub(super) fn forget_unreached(model: &Model<'_>, settings: &[Setting], fit: &mut Fit) {
    let all: Vec<usize> = (0..model.clips()).collect();
    for (k, setting) in settings.iter().enumerate() {
        let Some(joint) = limited(setting).filter(|_| fit.shared[k] > 0.0) else { continue };
        let mut without = fit.shared.clone();
        without[k] = 0.0;
        let [with, none] = [&fit.shared, &without].map(|numbers| costs(model, first_few(&all), numbers)[joint]);
        if with >= ERROR_LEFT_BY_A_LIMIT * none {
            fit.shared = without;
        }
    }
}

/// Moves the starts of all other numbers to a rough fit without limits: a gain that is off by a fifth looks like a limit.
fn bring_near(
    model: &Model<'_>,
    clips: &[usize],
    settings: &[Setting],
    unknowns: &mut [Unknown],
    interrupt: &Interrupt,
) {
    let without = unknowns.iter().zip(settings).map(|(unknown, setting)| match limited(setting) {
        Some(_) => Unknown { lower: unknown.start, upper: unknown.start, ..unknown.clone() },
        None => unknown.clone(),
    });
    let without: Vec<Unknown> = without.collect();
    let schedule = Schedule::of(ROUGH_ITERATIONS);
    let rough = fit(&Subset { model, clips }, &without, &model.random(), &schedule, |_, _| !interrupt.asked());
    // Where the twin cannot be simulated the search itself says so.
    for (unknown, near) in unknowns.iter_mut().zip(rough.map(|fit| fit.shared).unwrap_or_default()) {
        unknown.start = near;
    }
}

/// The joint whose limit a number is.
fn limited(setting: &Setting) -> Option<usize> {
    setting.joint().filter(|_| setting.search() == Some(Search::Limit))
}
