//! The last stretch to the paper's loss. Slopes lead near it and no further: a hit is so rough that the lowest place has
//! none to follow. From there points scattered in the shape that the slopes gave lead on.
//!
//! The loss sees poses alone, and they hardly tell a heavy object from a light one: the mass stays what the arm felt. Nor do
//! they tell how high the centre of mass lies but by how the object tips, which is not as in the twin ([`ModelError::flat`]):
//! the height stays what the way along the table tells.
//!
//! [`ModelError::flat`]: inference::likelihood::object::ModelError::flat

use super::paper::SurfaceLoss;
use super::vicinity::{descend, points};
use inference::estimate::{ClipModel as _, Impossible, Unknown};
use inference::kept::{Kept, Trail};
use inference::likelihood::Setting;
use inference::likelihood::object::ObjectClips;
use inference::object_fit::step::Linearised;
use inference::object_fit::{ObjectFit, fit_object, linearise_object, roughly};
use nalgebra::{DMatrix, DVector};
use shared_mem::cell::ClipKind;
use twin::scene::ObjectShape;

/// No number is taken for known better than this share of its range (a choice).
const MIN_SPREAD_SHARE: f64 = 0.01;

/// What is searched: the numbers and what they mean, the object's shape, and the seed of the cloud.
#[derive(Clone, Copy)]
pub(super) struct Searched<'a> {
    pub(super) unknowns: &'a [Unknown],
    pub(super) settings: &'a [Setting],
    pub(super) shape: &'a ObjectShape,
    pub(super) seed: u64,
}

/// Clips that are usually simulated until the end: for a bar alone.
pub(super) fn usual_evaluations(clips: &ObjectClips, unknowns: &[Unknown]) -> usize {
    inference::object_fit::usual_evaluations(clips, unknowns) + points(unknowns.len()) * clips.clips()
}

/// The likelihood fit and, of strokes, from there on to the paper's loss. What was let go begins with a motion of its own,
/// which the loss does not know. `watch` sees numbers and clips simulated after every step; `false` ends the fit there.
pub(super) fn fit_polished(
    clips: &mut ObjectClips,
    searched: Searched<'_>,
    start: &[f64],
    trail: Trail<'_>,
    watch: impl Fn(&[f64], usize) -> bool,
) -> Result<ObjectFit, Impossible> {
    let found = fit_object(clips, searched.unknowns, start, trail, &watch)?;
    if let_go(clips) || !watch(&found.at.shared, found.evaluations) {
        return Ok(found);
    }
    let (numbers, more) = {
        let loss = SurfaceLoss::new(clips, searched.shape);
        let is_held = |k: &usize| matches!(searched.settings[*k], Setting::Mass | Setting::CentreOfMass(2));
        let free: Vec<usize> = (0..searched.unknowns.len()).filter(|k| !is_held(k)).collect();
        polish(&loss, searched, &found.at, &free, trail, |numbers, more| watch(numbers, found.evaluations + more))
    };
    // How much wider intervals are is known where the deviance is least; here it may fall to a side.
    let at = linearise_object(clips, searched.unknowns, &numbers)?;
    Ok(ObjectFit { evaluations: found.evaluations + more + at.evaluations, at, ..found })
}

/// By the loss alone, whatever the arm felt: numbers and clips simulated. A comparison with searches that know nothing
/// else; the mass comes out wrong.
pub(super) fn fit_poses_alone(
    clips: &mut ObjectClips,
    searched: Searched<'_>,
    start: &[f64],
    watch: impl Fn(&[f64], usize) -> bool,
) -> Result<(Vec<f64>, usize), Impossible> {
    let (found, evaluations) = roughly(clips, searched.unknowns, start, &watch)?;
    let loss = SurfaceLoss::new(clips, searched.shape);
    let (all, trail): (Vec<usize>, Trail<'_>) = ((0..searched.unknowns.len()).collect(), (Kept::nothing(), ""));
    let (numbers, more) =
        polish(&loss, searched, &found, &all, trail, |numbers, more| watch(numbers, evaluations + more));
    Ok((numbers, evaluations + more))
}

/// Whether some of the clips are tosses: nothing pushes the object in them.
pub(super) fn let_go(clips: &ObjectClips) -> bool {
    (0..clips.clips()).any(|clip| clips.clip(clip).kind == ClipKind::FreeMotion)
}

/// Numbers of little loss near those of `from`, clips counting as they did there, and the clips simulated for it. Those that are not
/// `free` stay.
fn polish(
    loss: &SurfaceLoss<'_>,
    searched: Searched<'_>,
    from: &Linearised,
    free: &[usize],
    trail: Trail<'_>,
    watch: impl Fn(&[f64], usize) -> bool,
) -> (Vec<f64>, usize) {
    let Searched { unknowns, seed, .. } = searched;
    let spread = spread(&from.information(), free, unknowns);
    let place = |z: &[f64]| {
        let mut numbers = from.shared.clone();
        for (k, step) in free.iter().zip((&spread * DVector::from_column_slice(z)).iter()) {
            numbers[*k] = (numbers[*k] + step).clamp(unknowns[*k].lower, unknowns[*k].upper);
        }
        numbers
    };
    let (z, simulated) =
        descend(loss, &from.weights, free.len(), seed, place, trail, |z, simulated| watch(&place(z), simulated));
    (place(&z), simulated)
}

/// A square root of the free numbers' covariance, (free, free), each in its own unit.
fn spread(information: &DMatrix<f64>, free: &[usize], unknowns: &[Unknown]) -> DMatrix<f64> {
    let n = free.len();
    let range = |k: usize| unknowns[free[k]].upper - unknowns[free[k]].lower;
    let on_diagonal = |i: usize, j: usize, value: f64| if i == j { value } else { 0.0 };
    // As if each were known to its range besides: of what the clips do not tell the covariance is that wide and no wider.
    let held = |i: usize, j: usize| information[(free[i], free[j])] + on_diagonal(i, j, range(i).powi(-2));
    let covariance = DMatrix::from_fn(n, n, held).try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
    let blurred = |i: usize, j: usize| covariance[(i, j)] + on_diagonal(i, j, (MIN_SPREAD_SHARE * range(i)).powi(2));
    let root = DMatrix::from_fn(n, n, blurred).cholesky().map(|root| root.l());
    root.unwrap_or_else(|| DMatrix::from_fn(n, n, |i, j| on_diagonal(i, j, MIN_SPREAD_SHARE * range(i))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_follows_what_the_slopes_say_and_never_leaves_the_ranges() {
        let unknown = |name: &str, upper| Unknown { name: name.into(), start: 0.5, lower: 0.0, upper, step: 1e-3 };
        let unknowns = [unknown("known", 1.0), unknown("mass", 1.0), unknown("unknown", 2.0)];
        let information = DMatrix::from_diagonal(&DVector::from_column_slice(&[400.0, 7.0, 0.0]));
        let spread = spread(&information, &[0, 2], &unknowns);
        assert!((spread[(0, 0)] - 0.05_f64.hypot(0.01)).abs() < 1e-4, "{spread}");
        assert!((spread[(1, 1)] - 2.0).abs() < 1e-3 && spread[(0, 1)] == 0.0, "{spread}");
    }
}
