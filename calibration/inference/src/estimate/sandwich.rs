//! How far estimates scatter, by witnesses that may each be wrong in a way of their own: whatever the residuals within one
//! share, the scatter of what the witnesses want is that of the answer (a sandwich, Huber 1967, by groups: Liang & Zeger
//! 1986). A witness that the answer leans on has pulled it to its side and wants less than it is wrong by; that is taken out
//! again (the bias-reduced linearisation CR2 of Bell & McCaffrey 2002), so that few witnesses of unequal weight do.

use nalgebra::{DMatrix, DVector};

/// What one witness wants.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// Its share of the slope at the answer, `P`.
    pub score: DVector<f64>,
    /// Its share of the information, `P x P`.
    pub information: DMatrix<f64>,
}

/// Of directions that one witness tells alone, others hold at least this share: nothing contradicts it there.
const MIN_SHARE_OF_OTHERS: f64 = 0.02;

/// Covariance of the answer; `None` where the information leaves a direction open or is not finite.
pub fn covariance<'a>(
    information: &DMatrix<f64>,
    witnesses: impl Iterator<Item = &'a Witness>,
) -> Option<DMatrix<f64>> {
    let root = information.clone().cholesky()?.l();
    let n = information.nrows();
    let mut outer = DMatrix::zeros(n, n);
    for Witness { score, information } in witnesses {
        let half = root.solve_lower_triangular(information)?;
        let share = root.solve_lower_triangular(&half.transpose())?;
        let share = (&share + share.transpose()) * 0.5;
        // The search for eigenvalues of what is not finite has no end.
        if !share.iter().all(|value| value.is_finite()) {
            return None;
        }
        let eigen = share.symmetric_eigen();
        let by = eigen.eigenvalues.map(|share| (1.0 - share).max(MIN_SHARE_OF_OTHERS).sqrt().recip());
        let wanted = root.solve_lower_triangular(score)?;
        let wanted = &eigen.eigenvectors * by.component_mul(&eigen.eigenvectors.tr_mul(&wanted));
        outer += &wanted * wanted.transpose();
    }
    let half = root.tr_solve_lower_triangular(&outer)?;
    let whole = root.tr_solve_lower_triangular(&half.transpose())?;
    Some((&whole + whole.transpose()) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_distr::StandardNormal;

    /// Level and slope of a line through six witnesses of very unequal reach, each shifted by an error of its own.
    fn line(seed: u64) -> (DVector<f64>, DMatrix<f64>) {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let reach = [1.0, 1.0, 1.5, 2.0, 3.0, 6.0];
        let mut rows: Vec<(usize, f64, f64)> = Vec::new();
        for (witness, reach) in reach.into_iter().enumerate() {
            let shift: f64 = random.sample(StandardNormal);
            for k in -3..=3 {
                let noise: f64 = random.sample(StandardNormal);
                rows.push((witness, reach * f64::from(k) / 3.0, shift + 0.3 * noise));
            }
        }
        let slope = |x: f64| DVector::from_column_slice(&[1.0, x]);
        let information = rows.iter().fold(DMatrix::zeros(2, 2), |s, r| s + slope(r.1) * slope(r.1).transpose());
        let inverse = information.clone().try_inverse().expect("a line");
        let at = &inverse * rows.iter().fold(DVector::zeros(2), |s, r| s + slope(r.1) * r.2);
        let of = |witness: usize| {
            let own = || rows.iter().filter(|r| r.0 == witness);
            Witness {
                score: own().fold(DVector::zeros(2), |s, r| s + slope(r.1) * (at.dot(&slope(r.1)) - r.2)),
                information: own().fold(DMatrix::zeros(2, 2), |s, r| s + slope(r.1) * slope(r.1).transpose()),
            }
        };
        let witnesses: Vec<Witness> = (0..reach.len()).map(of).collect();
        let covariance = covariance(&information, witnesses.iter()).expect("a line");
        (at, covariance)
    }

    #[test]
    fn the_covariance_is_that_of_the_answers_though_few_witnesses_weigh_unequally() {
        let (mut square, mut stated) = ([0.0; 2], [0.0; 2]);
        for seed in 0..3000 {
            let (at, covariance) = line(seed);
            for k in 0..2 {
                square[k] += at[k] * at[k];
                stated[k] += covariance[(k, k)];
            }
        }
        // Of the level all witnesses say alike; the slope is mostly one's.
        assert!((0.85..1.25).contains(&(stated[0] / square[0])), "{}", stated[0] / square[0]);
        assert!((0.7..1.6).contains(&(stated[1] / square[1])), "{}", stated[1] / square[1]);
    }

    #[test]
    fn an_open_direction_has_no_covariance() {
        let none: [Witness; 0] = [];
        assert!(covariance(&DMatrix::zeros(2, 2), none.iter()).is_none());
    }
}
