//! The motions of one joint together: the end of a push cut off where the other motions say that it is none, and motions left out that
//! the others do not explain.

use super::alone::{Alone, MIN_KEPT_TRAVEL, TRIED_BEGINNINGS};
use super::fit::held_out;
use super::model::{Motion, best_fit};
use super::noise::Noise;

/// A motion from which the others lead farther away than this share of its travel is none of the same joint by itself (a choice).
const MAX_DISAGREEMENT: f64 = 0.1;

/// Cuts the beginnings of motions until one friction and one damping explain them all, worst first. A motion that half of its way does
/// not bring to agree stays whole: its friction is another one.
pub(super) fn cut_to_agree(motions: &mut [Alone], noise: &Noise) {
    let whole = motions.to_vec();
    let mut stays = vec![false; motions.len()];
    for _ in 0..TRIED_BEGINNINGS * motions.len() {
        let all: Vec<Motion> = motions.iter().map(|alone| alone.motion.clone()).collect();
        let Some(fit) = best_fit(&all) else { return };
        let numbers = [fit.shared[0], fit.shared[1]];
        let off = |k: &usize| motions[*k].motion.disagreement(numbers, &fit.clips[*k].own, noise);
        let worst = (0..motions.len()).filter(|k| !stays[*k]).max_by(|a, b| off(a).total_cmp(&off(b)));
        let Some(worst) = worst.filter(|k| off(k) > 1.0) else { return };
        let step = whole[worst].rows.len().div_ceil(TRIED_BEGINNINGS);
        let shorter = motions[worst].without_first(step);
        match shorter.filter(|shorter| shorter.motion.travel() >= MIN_KEPT_TRAVEL * whole[worst].motion.travel()) {
            Some(shorter) => motions[worst] = shorter,
            None => (motions[worst], stays[worst]) = (whole[worst].clone(), true),
        }
    }
}

/// The first motion to be left out, since what the others say of it is far from it; none as long as two agree.
pub(super) fn odd(motions: &[Motion]) -> Option<usize> {
    if motions.len() < 3 {
        return None;
    }
    let off: Vec<f64> = (held_out(motions)?.iter().zip(motions))
        .map(|(fit, motion)| (fit.chi2 / fit.rows as f64).sqrt() * motion.sigma / motion.travel())
        .collect();
    (0..off.len()).max_by(|a, b| off[*a].total_cmp(&off[*b])).filter(|worst| off[*worst] > MAX_DISAGREEMENT)
}
