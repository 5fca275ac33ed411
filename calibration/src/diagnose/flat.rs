//! Numbers on which nothing depends: a vertical joint's encoder may be off by any angle, because the arm turned about the
//! vertical is the same arm. A search leaves such a number anywhere, and its curvature is one of rounding.

use super::evidence::Evidence;
use super::fit::{Bench, FittedClip, Hypothesis};
use twin::effects::Stage;

/// What a number may change of the clips' squared residuals, as a share and at least, and still be one that nothing depends
/// on.
const SHARE: f64 = 1e-4;
const LEAST: f64 = 1.0;

/// The hypothesis with the sizes of its effects on the arm at rest that nothing depends on, and no longer free.
#[must_use]
pub fn without<E: Evidence>(bench: &Bench<'_, E>, hypothesis: &Hypothesis) -> Hypothesis {
    let even = vec![1.0; bench.evidence.channels().len()];
    let cost = |full: &[f64]| bench.plain_cost(hypothesis, full, &even).unwrap_or(f64::INFINITY);
    let now = cost(&hypothesis.full);
    let mut out = hypothesis.clone();
    for effect in &hypothesis.effects {
        let candidate = &bench.library.candidates[*effect];
        // Of one number it is known that something depends on it: it was found.
        if candidate.effect.stage != Stage::Control || candidate.sizes.len() < 2 {
            continue;
        }
        for k in &candidate.sizes {
            let mut full = out.full.clone();
            full[*k] = bench.library.unknowns[*k].start;
            if (cost(&full) - now).abs() < LEAST.max(SHARE * now) {
                out = held(out, *k, full);
            }
        }
    }
    out
}

/// The hypothesis with other numbers, of which one is no longer free.
fn held(hypothesis: Hypothesis, number: usize, full: Vec<f64>) -> Hypothesis {
    let Some(place) = hypothesis.free.iter().position(|free| *free == number) else { return hypothesis };
    let less = |clip: FittedClip| {
        let mut reduced = clip.reduced;
        reduced.form = reduced.form.remove_row(place + 1).remove_column(place + 1);
        FittedClip { reduced, ..clip }
    };
    let free = hypothesis.free.iter().copied().filter(|free| *free != number).collect();
    Hypothesis { full, free, fitted: hypothesis.fitted.into_iter().map(less).collect(), ..hypothesis }
}
