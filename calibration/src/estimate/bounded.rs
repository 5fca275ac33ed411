//! One damped Newton step within bounds: the rule by which every fit treats its limits.

use nalgebra::{DMatrix, DVector};

/// Ridge over the scaled information that rounding cannot undo.
const RIDGE: f64 = 1e-12;

/// A step `s` that lowers `2 g's + s'(H + damping diag H)s` while each number stays in its `room` (how far down, at most 0, and
/// how far up): straight towards the minimum until a number meets its bound, then on without it. A number that nothing depends
/// on stays where it is.
///
/// `H` is `P x P` and symmetric, `g` and `room` have `P` entries.
#[must_use]
pub fn bounded_step(h: &DMatrix<f64>, g: &DVector<f64>, room: &[[f64; 2]], damping: f64) -> DVector<f64> {
    let mut step: DVector<f64> = DVector::zeros(g.len());
    let mut free: Vec<usize> = (0..g.len()).collect();
    loop {
        let mut held = step.clone();
        free.iter().for_each(|k| held[*k] = 0.0);
        let to = solve(h, &(g + h * held), &free, damping);
        // Which bound is met first, and after which share of the way.
        let mut first = (1.0, None);
        for k in &free {
            let ahead = to[*k] - step[*k];
            let [down, up] = room[*k];
            let bound = if ahead < 0.0 { down } else { up };
            let share = (bound - step[*k]) / ahead;
            if share < first.0 {
                first = (share.max(0.0), Some((*k, bound)));
            }
        }
        let (share, met) = first;
        free.iter().for_each(|k| step[*k] += share * (to[*k] - step[*k]));
        let Some((met, bound)) = met else { return step };
        step[met] = bound;
        free.retain(|k| *k != met);
    }
}

/// `-(H + damping diag H)^-1 g` in the free numbers.
fn solve(h: &DMatrix<f64>, g: &DVector<f64>, free: &[usize], damping: f64) -> DVector<f64> {
    let scale: Vec<f64> = free.iter().map(|k| h[(*k, *k)].max(0.0).sqrt()).collect();
    let used: Vec<usize> = (0..free.len()).filter(|i| scale[*i] > 0.0).collect();
    let n = used.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        let (i, j) = (used[i], used[j]);
        h[(free[i], free[j])] / (scale[i] * scale[j])
    });
    let right = DVector::from_fn(n, |i, _| g[free[used[i]]] / scale[used[i]]);
    let mut step = DVector::zeros(g.len());
    let mut ridge = damping + RIDGE;
    // Rounding may leave the scaled information a little indefinite: then a larger ridge is what it allows.
    while ridge < 1e3 {
        if let Some(factor) = (&scaled + DMatrix::identity(n, n) * ridge).cholesky() {
            let solved = factor.solve(&right);
            used.iter().zip(solved.iter()).for_each(|(i, x)| step[free[*i]] = -x / scale[*i]);
            break;
        }
        ridge *= 10.0;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WIDE: [f64; 2] = [-1e9, 1e9];

    /// `(1 - a - b)^2 + (a - 2)^2 + b^2`: information and half the slope at `a = b = 0`.
    fn form() -> (DMatrix<f64>, DVector<f64>) {
        (DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]), DVector::from_row_slice(&[-3.0, -1.0]))
    }

    #[test]
    fn with_room_it_goes_where_the_slope_vanishes() {
        let (h, g) = form();
        let step = bounded_step(&h, &g, &[WIDE; 2], 0.0);
        assert!((step[0] - 5.0 / 3.0).abs() < 1e-9 && (step[1] + 1.0 / 3.0).abs() < 1e-9, "{step}");
    }

    #[test]
    fn what_one_gives_up_at_its_bound_the_other_takes_into_account() {
        let (h, g) = form();
        // With a at 1, 2 b - 1 + 1 = 0.
        let step = bounded_step(&h, &g, &[[-1.0, 1.0], WIDE], 0.0);
        assert!((step[0] - 1.0).abs() < 1e-12 && step[1].abs() < 1e-9, "{step}");
    }

    #[test]
    fn a_number_that_nothing_depends_on_stays_where_it_is() {
        let h = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 0.0]);
        let step = bounded_step(&h, &DVector::from_row_slice(&[-1.0, 0.0]), &[WIDE; 2], 0.0);
        assert!((step[0] - 0.5).abs() < 1e-9 && step[1] == 0.0, "{step}");
    }

    proptest! {
        #[test]
        fn a_step_stays_in_its_room_and_never_leads_up(
            slopes in proptest::collection::vec(-3.0_f64..3.0, 12),
            residuals in proptest::collection::vec(-3.0_f64..3.0, 4),
            reach in proptest::collection::vec(0.0_f64..2.0, 6),
            damping in 0.0_f64..10.0,
        ) {
            let a = DMatrix::from_row_slice(4, 3, &slopes);
            let (h, g) = (a.tr_mul(&a), a.tr_mul(&DVector::from_row_slice(&residuals)));
            let room: Vec<[f64; 2]> = reach.chunks(2).map(|reach| [-reach[0], reach[1]]).collect();
            let step = bounded_step(&h, &g, &room, damping);
            prop_assert!(step.iter().zip(&room).all(|(s, [down, up])| *s > down - 1e-12 && *s < up + 1e-12));
            let change = 2.0 * g.dot(&step) + step.dot(&(&h * &step));
            prop_assert!(change <= 1e-6, "{change}");
        }
    }
}
