//! One damped Newton step within bounds: the rule by which every fit treats its limits.

use nalgebra::{DMatrix, DVector};

/// How often each number may be let go.
const ROUNDS: usize = 3;
/// A gain of less than this share of what any number could gain at the start is rounding.
const LEAST_GAIN: f64 = 1e-10;
/// Ridge over the scaled information that rounding cannot undo.
const RIDGE: f64 = 1e-12;

/// The step `s` that lowers `2 g's + s'(H + damping diag H)s` most while each number stays in its `room` (how far down, at most
/// 0, and how far up). A number that nothing depends on stays where it is.
///
/// An active-set method (Nocedal and Wright 2006, 16.5): straight towards the minimum until a number meets its bound, on without
/// it, and at the end a number that is better off away from its bound is let go, the one that gains most first.
///
/// `H` is `P x P` and symmetric, `g` and `room` have `P` entries.
#[must_use]
pub fn bounded_step(h: &DMatrix<f64>, g: &DVector<f64>, room: &[[f64; 2]], damping: f64) -> DVector<f64> {
    let mut step: DVector<f64> = DVector::zeros(g.len());
    let mut free: Vec<usize> = (0..g.len()).collect();
    // Rounding could let two numbers take turns: each may be let go a few times and no more.
    for _ in 0..ROUNDS * (1 + g.len()) {
        let mut held = step.clone();
        free.iter().for_each(|k| held[*k] = 0.0);
        let to = solve(h, &(g + h * held), &free, damping);
        let Some((met, bound, share)) = first_bound(&free, (&step, &to), room) else {
            free.iter().for_each(|k| step[*k] = to[*k]);
            match let_go(h, g, (&step, &free), room, damping) {
                Some(k) => free.push(k),
                None => break,
            }
            continue;
        };
        free.iter().for_each(|k| step[*k] += share * (to[*k] - step[*k]));
        step[met] = bound;
        free.retain(|k| *k != met);
    }
    step
}

/// Which number meets its bound first on the way, at which value, and after which share of the way; `None` where none does.
fn first_bound(
    free: &[usize],
    (from, to): (&DVector<f64>, &DVector<f64>),
    room: &[[f64; 2]],
) -> Option<(usize, f64, f64)> {
    let meets = |k: &usize| {
        let ahead = to[*k] - from[*k];
        let bound = room[*k][usize::from(ahead > 0.0)];
        let share = ((bound - from[*k]) / ahead).max(0.0);
        (ahead != 0.0 && share < 1.0).then_some((*k, bound, share))
    };
    free.iter().filter_map(meets).min_by(|a, b| a.2.total_cmp(&b.2))
}

/// The number at a bound that gains most by leaving it; `None` where none gains.
fn let_go(
    h: &DMatrix<f64>,
    g: &DVector<f64>,
    (step, free): (&DVector<f64>, &[usize]),
    room: &[[f64; 2]],
    damping: f64,
) -> Option<usize> {
    let slope = g + h * step;
    let gain = |k: usize| {
        let curvature = h[(k, k)] * (1.0 + damping);
        let slope = slope[k] + damping * h[(k, k)] * step[k];
        let inwards = if slope > 0.0 { room[k][0] < step[k] } else { room[k][1] > step[k] };
        if inwards && curvature > 0.0 { slope * slope / curvature } else { 0.0 }
    };
    let least = LEAST_GAIN * g.iter().enumerate().map(|(k, _)| gain_from_rest(h, g, k)).fold(0.0, f64::max);
    let held = (0..g.len()).filter(|k| !free.contains(k)).map(|k| (k, gain(k)));
    held.filter(|(_, gain)| *gain > least).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// What a number alone could gain at the start.
fn gain_from_rest(h: &DMatrix<f64>, g: &DVector<f64>, k: usize) -> f64 {
    if h[(k, k)] > 0.0 { g[k] * g[k] / h[(k, k)] } else { 0.0 }
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
            // No number alone could go on to where it is lower: the minimum of what is convex.
            let damped = &h + DMatrix::from_diagonal(&(h.diagonal() * damping));
            let value = |step: &DVector<f64>| 2.0 * g.dot(step) + step.dot(&(&damped * step));
            for k in 0..3 {
                for [down, up] in [room[k]] {
                    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                        let mut other = step.clone();
                        other[k] = down + share * (up - down);
                        prop_assert!(value(&step) <= value(&other) + 1e-6, "{} {}", value(&step), value(&other));
                    }
                }
            }
        }
    }
}
