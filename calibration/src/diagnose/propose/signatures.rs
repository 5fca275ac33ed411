//! All candidates' signatures around a hypothesis, and what the score test says of each.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::shortlist::{self, Scored};
use crate::diagnose::fit::sweep::{Point, Precision, Swept, sweep};
use crate::diagnose::fit::{floor, stages};
use inference::admit::Split;
use inference::likelihood::random_effects_scale;
use shared_mem::progress::Progress;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Weights of the channels, and what the score test says of all candidates, best first: with the usual scatter, and with
/// little of it.
pub(in crate::diagnose) type Signatures = (Vec<f64>, Vec<Scored>, Vec<Scored>);

/// The signatures on the clips that are fitted; `None` where the twin has no answer, or the time is spent before all are there.
pub(in crate::diagnose) fn around(
    bench: &Bench<'_>,
    split: &Split,
    from: &Hypothesis,
    bar: &Progress,
) -> Option<Signatures> {
    let step = bench.step("signatures").with(&from.effects).with_numbers(&from.full);
    let step = step.with_numbers(from.fitted.iter().flat_map(|clip| &clip.own));
    bench.trail.0.once(&step, || taken(bench, split, from, bar))
}

fn taken(bench: &Bench<'_>, split: &Split, from: &Hypothesis, bar: &Progress) -> Option<Signatures> {
    let mut swept = swept(bench, split, from, bar)?;
    let weights = weights(bench, &[&swept])?;
    let scores = |swept: &Swept| {
        let sum = swept.total(bench.evidence, &weights).ok()?;
        Some(shortlist::score(swept, &sum, bench.library))
    };
    let scored = scores(&swept)?;
    // Where clips of the right hypothesis scatter little, the usual scatter hides a small effect altogether.
    swept.scatter = bench.scatter.narrowed(random_effects_scale::MIN_SCALE);
    let narrow = scores(&swept)?;
    Some((weights, scored, narrow))
}

/// Factors on the channels under which what the richest model leaves in some sweeps looks like noise.
pub(in crate::diagnose) fn weights(bench: &Bench<'_>, sweeps: &[&Swept]) -> Option<Vec<f64>> {
    let mut weights = vec![1.0; bench.evidence.channels().len()];
    // Weights depend on what the richest hypothesis leaves, and that on the weights: twice is enough.
    for _ in 0..2 {
        let left = |swept: &&Swept| floor::richest_residuals(swept, bench.evidence, bench.library, &weights).ok();
        let left: Option<Vec<_>> = sweeps.iter().map(left).collect();
        weights = floor::weights(bench.evidence, &left?.concat());
    }
    Some(weights)
}

fn swept(bench: &Bench<'_>, split: &Split, from: &Hypothesis, bar: &Progress) -> Option<Swept> {
    let clips = bench.with_own(&split.train, Some(from));
    let probed: Vec<usize> = (0..bench.library.candidates.len()).filter(|k| !from.effects.contains(k)).collect();
    let point =
        Point { full: &from.full, free: &from.free, probed: &probed, clips: &clips, precision: Precision::Joints };
    let done = AtomicUsize::new(0);
    bar.stage(stages::SIGNATURES, 100);
    let goes_on = |part: f64| {
        let done = done.fetch_add(1, Ordering::Relaxed) as f64;
        bar.show((100.0 * done * part / clips.len() as f64) as u64, stages::SIGNATURES);
        !bench.interrupt.asked()
    };
    sweep(bench.evidence, bench.library, &point, &bench.scatter, &goes_on).ok()
}
