//! How far the twin's time step moves the numbers of a fit: a cell does not integrate in control periods, and where it is stiff
//! the twin's numbers make up for that. Intervals reach as far.
//!
//! With residuals `r1` in steps of a control period and `r2` in half steps, `r1 + 4/3 (r2 - r1)` is what steps without end would
//! leave, but for terms of higher order (Richardson 1911; the twin's rule is of second order). The numbers move by one
//! Gauss-Newton step of that difference.

use super::bench::{Bench, Hypothesis};
use super::sweep::Precision;
use nalgebra::DVector;

/// How far each free number of a hypothesis would move; `None` where clips cannot be integrated in other steps, as those with an
/// object. `weights`: those that it was fitted with.
pub fn error(bench: &Bench<'_>, hypothesis: &Hypothesis, weights: &[f64]) -> Option<Vec<f64>> {
    let clips = hypothesis.clips_with_own();
    // Asked first: where there is no answer nothing need be linearised.
    let halves: Vec<Vec<f64>> =
        clips.iter().map(|(clip, _)| bench.evidence.in_halves(*clip, &hypothesis.full)).collect::<Option<_>>()?;
    let swept = bench.linearise(&hypothesis.full, &hypothesis.free, &clips, Precision::Exact)?;
    let count = hypothesis.free.len();
    let mut slope = DVector::zeros(count);
    for (clip, halves) in swept.clips.iter().zip(&halves) {
        let whole = clip.matrix.column(0);
        let rows = bench.evidence.rows(clip.clip);
        let weighed = rows
            .iter()
            .zip(halves.iter().zip(whole.iter()))
            .map(|(row, (half, whole))| weights[row.channel].powi(2) * (4.0 / 3.0) * (half - whole));
        slope += clip.matrix.columns(1, count).tr_mul(&DVector::from_iterator(rows.len(), weighed));
    }
    let information = bench.held(hypothesis).view((1, 1), (count, count)).into_owned();
    let moved = information.cholesky()?.solve(&slope);
    Some(moved.iter().map(|x| -x).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::fit::effort::Effort;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    /// The world is integrated in other steps than the twin's, so its friction is another in the twin.
    #[test]
    fn friction_that_a_finer_world_has_lies_where_the_time_step_moves_the_fit() {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("joint_stribeck_friction", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let effect = library.find("joint_stribeck_friction").expect("a candidate");
            let truth = truth(&library, &world);
            let fit = bench.fit(&[effect], truth.clone(), &[0, 1], even, None, Effort::of(12, Precision::Exact));
            let fit = fit.expect("a fit");
            let moved = error(bench, &fit, even).expect("an arm alone");
            let (mut before, mut after) = (0.0_f64, 0.0_f64);
            for (place, k) in fit.free.iter().enumerate().filter(|(_, k)| library.candidates[effect].sizes.contains(k))
            {
                let off = truth[*k] - fit.full[*k];
                before += off.powi(2);
                after += (off - moved[place]).powi(2);
            }
            assert!(
                after < 0.25 * before,
                "frictions are off by {before:.3e}, less the time step's part by {after:.3e}"
            );
        });
    }
}
