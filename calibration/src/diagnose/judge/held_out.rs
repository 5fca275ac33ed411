//! Numbers for clips that they were not fitted to: every command is left out of a fit to all others in turn, and judged by that.
//!
//! Of few commands each is left out of a fit of its own. Of many, one more or less moves the numbers little: there they are those of
//! the fit to all, one Newton step away (the influence of the clips that are left out), which takes no simulation.

use super::gap::Residuals;

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{REFINEMENT, THOROUGH};
use crate::diagnose::fit::left_out::numbers_without;
use crate::diagnose::work::DiagnoseError;
use inference::admit::Split;

/// A hypothesis for every clip that is judged: numbers, and clips that they were not fitted to.
pub(in crate::diagnose) type Fits = Vec<(Hypothesis, Vec<usize>)>;

/// Numbers for clips that they were not fitted to.
#[derive(Debug, Clone)]
pub(in crate::diagnose) struct HeldOut {
    pub(in crate::diagnose) fits: Fits,
    /// What they leave there.
    pub(in crate::diagnose) left: Residuals,
}

impl HeldOut {
    /// `None` where the twin has no answer.
    pub(in crate::diagnose) fn of(bench: &Bench<'_>, fits: Fits) -> Option<Self> {
        Some(Self { left: Residuals::of(bench, &fits)?, fits })
    }
}

/// A hypothesis measured on all clips.
#[derive(Debug, Clone)]
pub(in crate::diagnose) struct Measured {
    /// Fitted to all of them: its numbers are the answer.
    pub(in crate::diagnose) of_all: Hypothesis,
    pub(in crate::diagnose) held_out: HeldOut,
}

impl Measured {
    /// # Errors
    /// [`DiagnoseError::NoBaseline`] where the twin has no answer without one of the commands.
    pub(in crate::diagnose) fn of(
        bench: &Bench<'_>,
        split: &Split,
        hypothesis: &Hypothesis,
        weights: &[f64],
    ) -> Result<Self, DiagnoseError> {
        let measured = || {
            let of_all = of_all(bench, split, hypothesis, weights)?;
            let held_out = HeldOut::of(bench, fits(bench, split, &of_all, weights)?)?;
            Some(Self { of_all, held_out })
        };
        measured().ok_or(DiagnoseError::NoBaseline)
    }
}

/// A hypothesis fitted to all clips, from where those of the search have it.
fn of_all(bench: &Bench<'_>, split: &Split, hypothesis: &Hypothesis, weights: &[f64]) -> Option<Hypothesis> {
    if split.is_of_few() || bench.interrupt.asked() {
        return Some(hypothesis.clone());
    }
    let (effects, full) = (&hypothesis.effects, hypothesis.full.clone());
    let effort = if effects.is_empty() { REFINEMENT } else { bench.last_pass() };
    bench.fit(effects, full, &split.confirm, weights, Some(hypothesis), effort)
}

/// Numbers for every command: `hypothesis` was fitted to all. `None` where the twin has no answer without one of them.
pub(in crate::diagnose) fn fits(
    bench: &Bench<'_>,
    split: &Split,
    hypothesis: &Hypothesis,
    weights: &[f64],
) -> Option<Fits> {
    if !split.is_of_few() {
        return Some(by_influence(bench, split, hypothesis));
    }
    let without = |out: &Vec<usize>| {
        let others: Vec<usize> = split.train.iter().copied().filter(|clip| !out.contains(clip)).collect();
        let full = hypothesis.full.clone();
        Some((bench.fit(&hypothesis.effects, full, &others, weights, Some(hypothesis), THOROUGH)?, out.clone()))
    };
    split.in_turn.iter().map(without).collect()
}

/// Numbers for every command, one Newton step away from the fit of a hypothesis where that saw the command's clips.
fn by_influence(bench: &Bench<'_>, split: &Split, hypothesis: &Hypothesis) -> Fits {
    let without = |out: &Vec<usize>| {
        let Hypothesis { effects, free, .. } = hypothesis;
        let full = numbers_without(bench, hypothesis, out);
        (Hypothesis { effects: effects.clone(), full, free: free.clone(), fitted: Vec::new() }, out.clone())
    };
    split.in_turn.iter().map(without).collect()
}

/// What a hypothesis of the search leaves on clips that its numbers were not fitted to, without a fit: a fit of each would be most of
/// the work of a diagnosis.
pub(in crate::diagnose) fn estimated(bench: &Bench<'_>, split: &Split, hypothesis: &Hypothesis) -> Option<Residuals> {
    Residuals::of(bench, &by_influence(bench, split, hypothesis))
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
            let near = estimated(bench, &split, &all).expect("residuals");
            let at_all = Residuals::at(bench, &all, &[0, 1]).expect("residuals");
            let [fitted, near, at_all] = [&left, &near, &at_all].map(Residuals::mean_square);
            // One step goes most of the way that fits go.
            assert!((near - fitted).abs() < 0.5 * (fitted - at_all).abs(), "{fitted} {near} {at_all}");
        });
    }
}
