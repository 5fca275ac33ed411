//! Sums of squares that are quadratic in some coefficients: minima over chosen ones, elimination of others.
//!
//! A form is a symmetric matrix over (residual, coefficients): its value at coefficients `b` is `(1, b)' S (1, b)`.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The coefficients that make a form smallest, and by how much.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// Coefficients, in the order asked for.
    pub at: Vec<f64>,
    /// By how much the form falls from all coefficients zero.
    pub gain: f64,
}

/// The form with these rows and columns eliminated at their best, rows and columns of the others as they were (those
/// eliminated become zero).
pub fn eliminate(form: &DMatrix<f64>, out: &[usize]) -> DMatrix<f64> {
    let Some(inner) = factor(form, out) else { return form.clone() };
    let cross = DMatrix::from_fn(out.len(), form.ncols(), |i, j| form[(out[i], j)]);
    let mut left = form - cross.tr_mul(&inner.solve(&cross));
    for k in out {
        left.row_mut(*k).fill(0.0);
        left.column_mut(*k).fill(0.0);
    }
    left
}

/// The minimum over the coefficients `free`, the others zero.
pub fn minimum(form: &DMatrix<f64>, free: &[usize]) -> Minimum {
    let Some(inner) = factor(form, free) else { return Minimum { at: vec![0.0; free.len()], gain: 0.0 } };
    let slope = DVector::from_fn(free.len(), |i, _| form[(free[i], 0)]);
    let at = -inner.solve(&slope);
    Minimum { gain: -at.dot(&slope), at: at.as_slice().to_vec() }
}

/// The same where coefficients marked in `one_sided` must not be negative: those that want to be are dropped, worst first.
pub fn bounded_minimum(form: &DMatrix<f64>, free: &[usize], one_sided: &[bool]) -> Minimum {
    let mut kept: Vec<usize> = (0..free.len()).collect();
    loop {
        let indices: Vec<usize> = kept.iter().map(|k| free[*k]).collect();
        let found = minimum(form, &indices);
        let worst = (kept.iter().zip(&found.at).enumerate())
            .filter(|(_, (k, at))| one_sided[**k] && **at < 0.0)
            .min_by(|a, b| a.1.1.total_cmp(b.1.1))
            .map(|(place, _)| place);
        let Some(place) = worst else {
            let mut at = vec![0.0; free.len()];
            kept.iter().zip(&found.at).for_each(|(k, value)| at[*k] = *value);
            return Minimum { at, gain: found.gain };
        };
        kept.remove(place);
    }
}

/// Value of the form at coefficients for the columns `free`.
pub fn value(form: &DMatrix<f64>, free: &[usize], at: &[f64]) -> f64 {
    let full: Vec<(usize, f64)> =
        std::iter::once((0, 1.0)).chain(free.iter().copied().zip(at.iter().copied())).collect();
    full.iter().map(|(i, a)| full.iter().map(|(j, b)| a * b * form[(*i, *j)]).sum::<f64>()).sum()
}

/// Relative ridge: columns that say the same to this many digits are one.
const RELATIVE_RIDGE: f64 = 1e-9;

fn factor(form: &DMatrix<f64>, free: &[usize]) -> Option<Cholesky<f64, Dyn>> {
    if free.is_empty() {
        return None;
    }
    let mut inner = DMatrix::from_fn(free.len(), free.len(), |i, j| form[(free[i], free[j])]);
    for i in 0..free.len() {
        inner[(i, i)] += RELATIVE_RIDGE * inner[(i, i)] + f64::MIN_POSITIVE.sqrt();
    }
    Cholesky::new(inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 - a - b)^2 + (a - 2)^2 + b^2, as a form over (1, a, b).
    fn form() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, &[5.0, -3.0, -1.0, -3.0, 2.0, 1.0, -1.0, 1.0, 2.0])
    }

    #[test]
    fn the_minimum_is_where_the_slopes_vanish() {
        let found = minimum(&form(), &[1, 2]);
        assert!((found.at[0] - 5.0 / 3.0).abs() < 1e-6 && (found.at[1] + 1.0 / 3.0).abs() < 1e-6, "{found:?}");
        assert!((value(&form(), &[1, 2], &found.at) - (5.0 - found.gain)).abs() < 1e-6);
    }

    #[test]
    fn a_coefficient_that_may_not_be_negative_stays_at_zero_and_the_others_settle_without_it() {
        let found = bounded_minimum(&form(), &[1, 2], &[false, true]);
        assert!((found.at[0] - 1.5).abs() < 1e-6, "{found:?}");
        assert_eq!(found.at[1], 0.0);
    }

    #[test]
    fn eliminating_first_and_minimising_then_is_minimising_at_once() {
        let left = eliminate(&form(), &[2]);
        let rest = minimum(&left, &[1]);
        assert!((left[(0, 0)] - rest.gain - (5.0 - minimum(&form(), &[1, 2]).gain)).abs() < 1e-6);
    }
}
