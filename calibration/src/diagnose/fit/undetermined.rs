//! Numbers on which nothing depends: a vertical joint's encoder may be off by any angle, because the arm turned about the
//! vertical is the same arm. A search leaves such a number anywhere, and its curvature is one of rounding.

use super::bench::{Bench, FittedClip, Hypothesis};
use super::floor;
use inference::likelihood::random_effects::OwnNumbers;
use twin::effects::Search;

/// What a number may change of the clips' squared residuals, as a share and at least, and still be one that nothing depends
/// on.
const MAX_CHANGE_SHARE: f64 = 1e-6;
const MIN_CHANGE: f64 = 1.0;

/// The hypothesis with the sizes of its effects on the arm at rest that nothing depends on, and no longer free.
pub fn without(bench: &Bench<'_>, hypothesis: &Hypothesis) -> Hypothesis {
    let mut out = hypothesis.clone();
    for effect in &hypothesis.effects {
        for k in sizes(bench, hypothesis, *effect) {
            out = held(out, k, bench.library.unknowns[k].start);
        }
    }
    out
}

/// The sizes of an effect on the arm that nothing depends on.
pub fn sizes<O: OwnNumbers>(bench: &Bench<'_, O>, hypothesis: &Hypothesis<O>, effect: usize) -> Vec<usize> {
    let candidate = &bench.library.candidates[effect];
    // Of one number it is known that something depends on it: it was found.
    if !candidate.is_of_arm() || candidate.sizes.len() < 2 {
        return Vec::new();
    }
    let even = floor::sensors_alone(bench.evidence);
    let clips = hypothesis.clips();
    let cost = |full: &[f64]| bench.plain_cost(&clips, full, &even).unwrap_or(f64::INFINITY);
    let now = cost(&hypothesis.full);
    let mut full = hypothesis.full.clone();
    let mut unseen = Vec::new();
    for k in &candidate.sizes {
        let resting = bench.library.unknowns[*k].start;
        let at = |value: f64| {
            let mut full = full.clone();
            full[*k] = value;
            full
        };
        let alike = |value: f64| (cost(&at(value)) - now).abs() < MIN_CHANGE.max(MAX_CHANGE_SHARE * now);
        // A number that was found to be at rest is known: what it does elsewhere tells. A limit that is never reached is none,
        // wherever it is.
        let never_reached = candidate.is_searched(Search::Limit);
        if alike(resting) && (never_reached || candidate.strongest(*k, resting).is_some_and(alike)) {
            full[*k] = resting;
            unseen.push(*k);
        }
    }
    unseen
}

/// The hypothesis with a number that has another value and is no longer free.
fn held(mut hypothesis: Hypothesis, number: usize, value: f64) -> Hypothesis {
    let Some(place) = hypothesis.free.iter().position(|free| *free == number) else { return hypothesis };
    hypothesis.full[number] = value;
    let less = |clip: FittedClip| {
        let mut reduced = clip.reduced;
        reduced.form = reduced.form.remove_row(place + 1).remove_column(place + 1);
        FittedClip { reduced, ..clip }
    };
    let free = hypothesis.free.iter().copied().filter(|free| *free != number).collect();
    Hypothesis { free, fitted: hypothesis.fitted.into_iter().map(less).collect(), ..hypothesis }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::theta::Theta;
    use twin::arm::MAX_JOINTS;
    use worlds::world::{Kind, World};

    #[test]
    fn a_vertical_joint_s_encoder_may_be_off_by_any_angle_and_no_other_s() {
        let cell = shipped();
        let world = with_effect("joint_encoder_offset", 14, Kind::Excitation, &cell);
        let library = Library::new(&cell, &setting::complete(&cell, None).expect("a cell"), None, &[10.0; MAX_JOINTS]);
        let effect = library.find("joint_encoder_offset").expect("a candidate");
        let offsets = library.candidates[effect].sizes.clone();
        let truth = truth(&library, &world);
        let mut full = truth.clone();
        full[offsets[0]] = 0.04;
        let kept = |world: &World, full: Vec<f64>| {
            on_bench((&cell, world), &library, |bench, even| {
                without(bench, &bench.fit(&[effect], full, &[0, 1], even, None, ONCE).expect("a fit"))
            })
        };
        let off = kept(&world, full);
        assert_eq!(off.full[offsets[0]], 0.0);
        let free: Vec<bool> = offsets.iter().map(|k| off.free.contains(k)).collect();
        assert_eq!(free, [false, true, true, true, true, true, true]);
        assert_eq!(off.fitted[0].reduced.form.ncols(), off.free.len() + 1);
        let rest = World { hidden: Theta { effects: Vec::new(), ..world.hidden.clone() }, ..world };
        let mut full = truth;
        offsets.iter().for_each(|k| full[*k] = 0.0);
        let resting = kept(&rest, full);
        let free: Vec<bool> = offsets.iter().map(|k| resting.free.contains(k)).collect();
        assert_eq!(free, [false, true, true, true, true, true, true], "what is known to rest is known");
    }
}
