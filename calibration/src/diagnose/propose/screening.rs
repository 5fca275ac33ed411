//! Which candidates are worth a fit.

use crate::answer::diagnosis::SensorGap;
use crate::diagnose::criteria::{JOINTS_EXCESS, MOST_OF_IT, OBJECT_EXCESS};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::shortlist::{Scored, TESTABLE};
use crate::diagnose::judge::gap::Typical;
use crate::diagnose::judge::trial::Step;
use crate::diagnose::select::criteria::EFFECTS;
use twin::effects::Stage;

/// So many candidates are fitted besides because they stand out at the least scatter, and so many trials of a step once more with the
/// object found anew under them (a choice).
pub(in crate::diagnose) const MAX_FURTHER: usize = 2;
/// An object's gap beyond this, half of what two engines differ by, has all effects on the slide fitted: which of them it is
/// shows in how far fits get.
const SLIDE_EXCESS: f64 = 0.5 * OBJECT_EXCESS.value;

/// Candidates worth a fit, the arm's and the object's each among themselves: those that the score test cannot rule out, the
/// best first; of the others only partners that the best is easily taken for. While the arm has a gap of its own, only what the arm feels
/// is: how an object is hit by an arm that is elsewhere tells nothing of the object. Where the object's gap is not small all effects
/// on the slide are fitted, where it is large all on the hit and of the camera as well: an impact answers so unevenly that slopes at one
/// point tell little.
pub(in crate::diagnose) fn to_fit(
    bench: &Bench<'_>,
    from: &Hypothesis,
    scored: &[Scored],
    whole: &[Typical],
    left: &[Typical],
) -> Vec<usize> {
    let effect = |s: &Scored| bench.library.candidates[s.candidate].effect;
    let mut all = Vec::new();
    let beyond = |of_object: bool| {
        let group = left.iter().find(|group| group.of_object == of_object);
        group.map_or(0.0, |group| group.mean_square - group.floor)
    };
    // An arm without a gap is not the cause of what an object does.
    let quiet = left.len() > 1 && beyond(false) < JOINTS_EXCESS.value;
    let arm_open = arm_gap_is_open(whole, left);
    for of_arm in [true, false].into_iter().filter(|of_arm| if *of_arm { !quiet } else { !arm_open }) {
        let of_group = |s: &&Scored| {
            let is_of_arm = bench.library.is_of_arm(s.candidate);
            is_of_arm == of_arm || (arm_open && bench.library.arm_may_feel(s.candidate))
        };
        let group: Vec<&Scored> = scored.iter().filter(of_group).collect();
        let Some(best) = group.first() else { continue };
        let likely = |s: &&&Scored| {
            let visible = !bench.negligible(s.candidate, &bench.begun(from.full.clone(), s));
            EFFECTS.promises(s.p, s.gain, best.gain) && visible
        };
        let partners = effect(best).confusable_with;
        let first = group.iter().filter(likely).take(EFFECTS.max_fitted);
        let confusable = group
            .iter()
            .filter(|s| partners.contains(&effect(s).name) && EFFECTS.promises(s.p, s.gain, 0.5 * best.gain));
        all.extend(first.chain(confusable).map(|s| s.candidate));
    }
    let more = |wanted: &dyn Fn(&Scored) -> bool| -> Vec<usize> {
        let wanted = scored.iter().filter(|s| s.signal > TESTABLE && wanted(s));
        wanted.map(|s| s.candidate).collect()
    };
    if arm_open {
        return all;
    }
    if beyond(true) > SLIDE_EXCESS {
        all.extend(more(&|s| effect(s).stage == Stage::Slide && !all.contains(&s.candidate)));
    }
    if beyond(true) > OBJECT_EXCESS.value {
        all.extend(more(&|s| matches!(effect(s).stage, Stage::Hit | Stage::Camera) && !all.contains(&s.candidate)));
    }
    all
}

/// Whether the arm's gap is larger than numerics beside an object.
pub(in crate::diagnose) fn arm_gap_is_open(whole: &[Typical], left: &[Typical]) -> bool {
    left.len() > 1 && much_of_arm_is_left(whole, left)
}

/// Whether more of the arm's gap is left than numerics are, and than a cause leaves of it.
fn much_of_arm_is_left(whole: &[Typical], left: &[Typical]) -> bool {
    SensorGap::of_groups(whole, left).iter().any(|left| !left.of_object() && left.too_much(false))
}

/// The object's candidates that stand out once clips are held to the least scatter, whatever else the score test says.
pub(in crate::diagnose) fn seen_at_the_least_scatter<'a>(
    bench: &Bench<'_>,
    from: &Hypothesis,
    narrow: &'a [Scored],
) -> Vec<&'a Scored> {
    let of_object = |s: &&Scored| !bench.library.is_of_arm(s.candidate);
    let object: Vec<&Scored> = narrow.iter().filter(of_object).collect();
    let Some(best) = object.first() else { return Vec::new() };
    let likely = |s: &&&Scored| {
        s.p < 0.01
            && s.gain > MOST_OF_IT * best.gain
            && !bench.negligible(s.candidate, &bench.begun(from.full.clone(), s))
    };
    object.iter().filter(likely).take(MAX_FURTHER).copied().collect()
}

/// Candidates on the arm that the score test passed over although a gap remains there that none of the others explains:
/// what acts only from some size on, as play does, has no slope at its neutral point. Those on the object all have one, or are
/// fitted in any case.
pub(in crate::diagnose) fn overlooked(bench: &Bench<'_>, step: &Step) -> Vec<usize> {
    if !much_of_arm_is_left(&step.whole, &step.left) {
        return Vec::new();
    }
    let rest = step.trials.iter().filter(|trial| trial.fitted.is_none() && trial.scored.signal > TESTABLE);
    let of_arm = |candidate: &usize| bench.library.is_of_arm(*candidate);
    rest.map(|trial| trial.scored.candidate).filter(of_arm).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::{ONCE, nothing_said_of, on_strokes, shipped};
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn a_gap_of_the_object_has_every_effect_on_the_slide_fitted_though_slopes_do_not_point_there() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |bench, even| {
            let from = bench.fit(&[], bench.library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            let scored = |candidate| Scored { signal: 2.0 * TESTABLE, ..nothing_said_of(bench.library, candidate) };
            let all: Vec<Scored> = (0..bench.library.candidates.len()).map(scored).collect();
            let fitted = |mean_square: f64| {
                let group = |of_object, mean_square| Typical { mean_square, floor: 1.5, of_object };
                let left = [group(false, 1.5), group(true, mean_square)];
                to_fit(bench, &from, &all, &left, &left)
            };
            let slides = bench.library.candidates.iter().filter(|c| c.effect.stage == Stage::Slide).count();
            assert_eq!(fitted(1.5 + 0.9 * SLIDE_EXCESS).len(), 0);
            assert_eq!(fitted(1.5 + 1.1 * SLIDE_EXCESS).len(), slides);
            let beside = |stage| bench.library.candidates.iter().filter(|c| c.effect.stage == stage).count();
            let all_beyond = slides + beside(Stage::Hit) + beside(Stage::Camera);
            assert_eq!(
                fitted(1.5 + 1.1 * OBJECT_EXCESS.value).len(),
                all_beyond,
                "those of the hit and the camera as well"
            );
        });
    }

    #[test]
    fn while_the_arm_has_a_gap_only_what_it_feels_is_fitted() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |bench, even| {
            let from = bench.fit(&[], bench.library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            // All of them stand out alike by the score test.
            let scored = |candidate: usize| {
                let probe = &bench.library.candidates[candidate].alternatives[0].probes[0];
                let mut said =
                    Scored { gain: 100.0, signal: 30.0, p: 0.0, ..nothing_said_of(bench.library, candidate) };
                said.units[0] = if probe.one_sided { probe.largest } else { 0.5 * probe.largest };
                said
            };
            let all: Vec<Scored> = (0..bench.library.candidates.len()).map(scored).collect();
            let fitted = |arm: f64| -> Vec<Stage> {
                let group = |of_object, mean_square| Typical { mean_square, floor: 1.5, of_object };
                let left = [group(false, arm), group(true, 100.0)];
                let fitted = to_fit(bench, &from, &all, &left, &left);
                fitted.into_iter().map(|c| bench.library.candidates[c].effect.stage).collect()
            };
            assert!(fitted(3.0).contains(&Stage::Slide));
            let with_gap = fitted(50.0);
            assert!(with_gap.contains(&Stage::Control) && !with_gap.contains(&Stage::Slide), "{with_gap:?}");
        });
    }
}
