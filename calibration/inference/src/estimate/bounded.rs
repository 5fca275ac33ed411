//! One damped Newton step within bounds: the rule by which every fit treats its limits.

use nalgebra::{DMatrix, DVector};

/// Ridge over the scaled information that rounding cannot undo.
const MIN_RIDGE: f64 = 1e-12;

/// A damped Newton step `s` on `2 g's + s'Hs`, `H + damping diag H` in the place of `H`, that keeps each number in its `room` (how
/// far down, at most 0, and how far up): numbers whose step would leave it go to their bound, all at once, and what they give up
/// is taken into account for the others, until none leaves. A number that nothing depends on stays where it is.
///
/// Where many numbers leave at once this may lead up; whoever takes the step sees that and damps it more. A method that always
/// leads down was tried: it follows the first slopes of gains that are known by range alone to the end of their range, from where
/// no slope leads back (a servo arm's damping, 28.8 instead of 27.3 mrad left).
///
/// `H` is `P x P` and symmetric, `g` and `room` have `P` entries.
pub fn bounded_step(h: &DMatrix<f64>, g: &DVector<f64>, room: &[[f64; 2]], damping: f64) -> DVector<f64> {
    let mut step: DVector<f64> = DVector::zeros(g.len());
    let mut free: Vec<usize> = (0..g.len()).collect();
    loop {
        let mut held = step.clone();
        free.iter().for_each(|k| held[*k] = 0.0);
        let to = solve(h, &(g + h * held), &free, damping);
        let stays = |k: &usize| (room[*k][0]..=room[*k][1]).contains(&to[*k]);
        let (inside, leaving): (Vec<usize>, Vec<usize>) = free.into_iter().partition(stays);
        for k in inside.iter().chain(&leaving) {
            step[*k] = to[*k].clamp(room[*k][0], room[*k][1]);
        }
        if leaving.is_empty() {
            return step;
        }
        free = inside;
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
    let mut ridge = damping + MIN_RIDGE;
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
        fn a_step_stays_in_its_room_and_what_is_inside_has_no_slope_left(
            slopes in proptest::collection::vec(-3.0_f64..3.0, 12),
            residuals in proptest::collection::vec(-3.0_f64..3.0, 4),
            reach in proptest::collection::vec(0.0_f64..2.0, 6),
            damping in 1e-3_f64..10.0,
        ) {
            let a = DMatrix::from_row_slice(4, 3, &slopes);
            let (h, g) = (a.tr_mul(&a), a.tr_mul(&DVector::from_row_slice(&residuals)));
            let room: Vec<[f64; 2]> = reach.chunks(2).map(|reach| [-reach[0], reach[1]]).collect();
            let step = bounded_step(&h, &g, &room, damping);
            prop_assert!(step.iter().zip(&room).all(|(s, [down, up])| (*down..=*up).contains(s)));
            let slope = &g + &h * &step;
            for k in 0..3 {
                let inside = step[k] > room[k][0] && step[k] < room[k][1];
                let left = slope[k] + damping * h[(k, k)] * step[k];
                prop_assert!(!inside || left.abs() < 1e-5 * (1.0 + g.amax()), "{k}: {left}");
            }
        }
    }
}
