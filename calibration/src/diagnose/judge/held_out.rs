//! Numbers for clips that they were not fitted to. Clips kept for confirming are seen by no fit at all; where there are too few
//! commands to keep any, every command is left out of a fit of its own in turn, and judged by that.

use super::gap::Residuals;

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::THOROUGH;
use crate::diagnose::fit::left_out::numbers_without;
use inference::admit::Split;
use inference::likelihood::Evidence;

/// A hypothesis for every clip that is judged: numbers, and clips that they were not fitted to.
pub(in crate::diagnose) type Fits = Vec<(Hypothesis, Vec<usize>)>;

/// `None` where the twin has no answer without one of the commands.
pub(in crate::diagnose) fn fits<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    hypothesis: &Hypothesis,
    weights: &[f64],
) -> Option<Fits> {
    if split.in_turn.is_empty() {
        return Some(vec![(hypothesis.clone(), split.confirm.clone())]);
    }
    let without = |out: &Vec<usize>| {
        let others: Vec<usize> = split.train.iter().copied().filter(|clip| !out.contains(clip)).collect();
        let full = hypothesis.full.clone();
        Some((bench.fit(&hypothesis.effects, full, &others, weights, Some(hypothesis), THOROUGH)?, out.clone()))
    };
    split.in_turn.iter().map(without).collect()
}

/// What a hypothesis leaves on clips that its numbers were not fitted to.
pub(in crate::diagnose) fn residuals<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    hypothesis: &Hypothesis,
    weights: &[f64],
) -> Option<Residuals> {
    Residuals::of(bench, &fits(bench, split, hypothesis, weights)?)
}

/// The same for effects that are not named: where commands are left out in turn, its numbers are taken one Newton step away from
/// the fit to all of them, which takes no simulation. A fit of each would be most of the work of a diagnosis.
pub(in crate::diagnose) fn estimated<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    hypothesis: &Hypothesis,
    weights: &[f64],
) -> Option<Residuals> {
    if split.in_turn.is_empty() {
        return residuals(bench, split, hypothesis, weights);
    }
    let without = |out: &Vec<usize>| {
        let full = numbers_without(bench, hypothesis, out);
        (Hypothesis { full, ..hypothesis.clone() }, out.clone())
    };
    Residuals::of(bench, &split.in_turn.iter().map(without).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    #[test]
    fn a_command_is_judged_by_numbers_that_were_found_without_it() {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("payload", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let split = Split::new(&[vec![0], vec![1]], 0);
            assert_eq!(split.in_turn.len(), 2);
            let all = bench.fit(&[], truth(&library, &world), &split.train, even, None, ONCE).expect("a fit");
            let fits = fits(bench, &split, &all, even).expect("two fits");
            for (fit, out) in &fits {
                let seen: Vec<usize> = fit.fitted.iter().map(|clip| clip.clip).collect();
                assert!(seen.len() == 1 && !out.contains(&seen[0]), "{seen:?} {out:?}");
            }
            let left = Residuals::of(bench, &fits).expect("residuals");
            assert_eq!(left.clips.iter().map(|(clip, _)| *clip).collect::<Vec<_>>(), [0, 1]);
            let near = estimated(bench, &split, &all, even).expect("residuals");
            let at_all = Residuals::at(bench, &all, &[0, 1]).expect("residuals");
            let [fitted, near, at_all] = [&left, &near, &at_all].map(Residuals::mean_square);
            // One step goes most of the way that fits go.
            assert!((near - fitted).abs() < 0.5 * (fitted - at_all).abs(), "{fitted} {near} {at_all}");
        });
    }
}
