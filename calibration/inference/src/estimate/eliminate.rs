//! A clip's likelihood with its nuisance parameters integrated out: what is left for the shared ones.
//!
//! With residuals `r`, slopes `A` by the shared parameters `x` and `B` by the clip's nuisance parameters `u`, whose prior has
//! the precision `L`,
//! `-2 ln` of the likelihood is `|r + A dx + B du|^2 + (u + du)' L (u + du)`, least at `du = -(B'B + L)^-1 (B'r + L u + B'A dx)`.
//! What remains is a quadratic form in `(1, dx)` (a Schur complement) and the logarithm of the volume that was integrated over:
//! that of a Gaussian whose covariance is `1 + B L^-1 B'`.

use super::problem::Impossible;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A clip without its nuisance parameters. `P` shared parameters, `Q` nuisance parameters.
pub struct Eliminated {
    /// Over (1, shared parameters), `(1 + P) x (1 + P)`: `-2 ln` of the likelihood but for [`Self::volume`].
    pub form: DMatrix<f64>,
    /// `ln det (B'B + L) - ln det L`; 0 of a clip without nuisance parameters.
    pub volume: f64,
    inner: Option<Cholesky<f64, Dyn>>,
    /// `-(B'B + L)^-1 (B'r + L u, B'A)`, `Q x (1 + P)`.
    follows: DMatrix<f64>,
}

impl Eliminated {
    /// From the products of all columns, `gram` over (residual, `A`, `B`), the precisions and the clip's nuisance parameters `u`
    /// there, `Q`
    /// each. A number that does not scatter has no slope and any precision, which keeps it where it is.
    ///
    /// # Errors
    /// [`Impossible`] where a product is not finite, or products are so large that their rounding swallows the precisions, which
    /// are
    /// positive.
    pub fn of(gram: &DMatrix<f64>, precision: &[f64], u: &[f64]) -> Result<Self, Impossible> {
        if !gram.iter().chain(u).all(|number| number.is_finite()) {
            return Err(Impossible("what the clips leave, or its slopes, is too large to be squared".into()));
        }
        let (own, kept) = (u.len(), gram.ncols() - u.len());
        let mut form = gram.view((0, 0), (kept, kept)).into_owned();
        if own == 0 {
            return Ok(Self { form, volume: 0.0, inner: None, follows: DMatrix::zeros(0, kept) });
        }
        let mut inner = gram.view((kept, kept), (own, own)).into_owned();
        let mut cross = gram.view((kept, 0), (own, kept)).into_owned();
        for (k, (precision, u)) in precision.iter().zip(u).enumerate() {
            inner[(k, k)] += precision;
            cross[(k, 0)] += precision * u;
            form[(0, 0)] += precision * u * u;
        }
        let Some(inner) = Cholesky::new(inner) else {
            return Err(Impossible("slopes by a clip's nuisance parameters are too large to be separated".into()));
        };
        let follows = -inner.solve(&cross);
        form += cross.tr_mul(&follows);
        let volume = inner.ln_determinant() - precision.iter().map(|precision| precision.ln()).sum::<f64>();
        Ok(Self { form, volume, inner: Some(inner), follows })
    }

    /// By how much the nuisance parameters change to be at their best after a change `dx` of the shared ones, `Q`.
    pub fn own_change(&self, dx: &DVector<f64>) -> DVector<f64> {
        &self.follows * dx.clone().insert_row(0, 1.0)
    }

    /// How the nuisance parameters follow (1, the shared ones), `Q x (1 + P)`.
    pub fn follows(&self) -> &DMatrix<f64> {
        &self.follows
    }

    /// Covariance of the nuisance parameters given the shared ones, `Q x Q`.
    pub fn own_covariance(&self) -> DMatrix<f64> {
        self.inner.as_ref().map_or_else(|| DMatrix::zeros(0, 0), Cholesky::inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_the_likelihood_with_the_own_number_at_its_best() {
        // r = 1 + 2 dx + 3 du in two rows, the second of other signs; u is 0.5 with a precision of 4.
        let columns = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 3.0, -1.0, 0.5, 1.0]);
        let (precision, u) = (4.0, 0.5);
        let left = Eliminated::of(&(columns.transpose() * &columns), &[precision], &[u]).expect("finite");
        let cost = |dx: f64, du: f64| {
            let rows = &columns * DVector::from_row_slice(&[1.0, dx, du]);
            rows.norm_squared() + precision * (u + du).powi(2)
        };
        for dx in [-0.7, 0.0, 1.3] {
            let du = left.own_change(&DVector::from_element(1, dx))[0];
            assert!(cost(dx, du) < cost(dx, du + 1e-3).min(cost(dx, du - 1e-3)));
            let at = DVector::from_row_slice(&[1.0, dx]);
            assert!((at.dot(&(&left.form * &at)) - cost(dx, du)).abs() < 1e-12);
        }
        assert!((left.volume - (1.0 + 10.0 / precision).ln()).abs() < 1e-12);
        assert!((left.own_covariance()[(0, 0)] - 1.0 / 14.0).abs() < 1e-12);
    }

    #[test]
    fn a_clip_without_own_numbers_is_its_own_form() {
        let gram = DMatrix::from_row_slice(2, 2, &[3.0, 1.0, 1.0, 2.0]);
        let left = Eliminated::of(&gram, &[], &[]).expect("finite");
        assert!(left.form == gram && left.volume == 0.0 && left.own_change(&DVector::zeros(1)).is_empty());
    }
    #[test]
    fn products_that_no_double_holds_or_that_swallow_the_precisions_are_an_error_and_no_panic() {
        for large in [f64::INFINITY, f64::NAN, f64::MAX] {
            let columns = DMatrix::from_row_slice(1, 2, &[large, 1.0]);
            assert!(Eliminated::of(&(columns.transpose() * &columns), &[], &[]).is_err(), "{large}");
            assert!(Eliminated::of(&(columns.transpose() * &columns), &[1.0], &[0.0]).is_err(), "{large}");
        }
        // Two nuisance parameters that do the same: their difference is held by the precision of 1 alone.
        for (slope, holds) in [(1e3, true), (1e20, false)] {
            let columns = DMatrix::from_row_slice(2, 3, &[1.0, slope, slope, 1.0, 3.0 * slope, 3.0 * slope]);
            let left = Eliminated::of(&(columns.transpose() * &columns), &[1.0, 1.0], &[0.0, 0.0]);
            assert_eq!(left.is_ok(), holds, "{slope}");
        }
        assert!(Eliminated::of(&DMatrix::identity(2, 2), &[1.0], &[f64::NAN]).is_err());
    }
}
