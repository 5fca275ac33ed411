//! The last stretch to the paper's loss. Slopes lead near it and no further: a hit is so rough that the lowest place has
//! none to follow. From there a small cloud of points goes on, shaped by what the slopes said of the numbers together.
//!
//! The loss sees poses alone, and they hardly tell a heavy object from a light one: the mass stays what the arm felt.

use super::fit::{ObjectFit, fit_object, linearise_object};
use super::paper::SurfaceLoss;
use crate::estimate::{ClipModel as _, Evolution, Impossible, Unknown, minimise, search};
use crate::forward::Setting;
use crate::forward::object::ObjectClips;
use nalgebra::{DMatrix, DVector};
use shared_mem::cell::ClipKind;
use std::cmp::Ordering;
use std::sync::Mutex;
use twin::scene::ObjectShape;

/// How far the cloud may reach, and how wide it is at first, in sigmas of what the slopes said.
const REACH: f64 = 10.0;
const WIDTH: f64 = 1.0;
/// Points whose loss is asked for at most.
pub(super) const POINTS: usize = 160;
/// So many of them, the best, are averaged.
const BEST: usize = 8;
/// No number is taken for known better than this share of its range.
const BLUR: f64 = 0.01;

/// What is searched: the numbers and what they mean, the object's shape, and the seed of the cloud.
#[derive(Clone, Copy)]
pub(super) struct Searched<'a> {
    pub(super) unknowns: &'a [Unknown],
    pub(super) settings: &'a [Setting],
    pub(super) shape: &'a ObjectShape,
    pub(super) seed: u64,
}

/// The likelihood fit and, of strokes, from there on to the paper's loss. What was let go begins with a motion of its own,
/// which the loss does not know. `watch` sees numbers and clips simulated after every step; `false` ends the fit there.
///
/// # Errors
/// [`Impossible`] when the cell cannot be simulated at the start.
pub(super) fn fit_polished(
    clips: &mut ObjectClips,
    searched: Searched<'_>,
    start: &[f64],
    watch: impl Fn(&[f64], usize) -> bool,
) -> Result<ObjectFit, Impossible> {
    let found = fit_object(clips, searched.unknowns, start, &watch)?;
    if let_go(clips) || !watch(&found.at.shared, found.evaluations) {
        return Ok(found);
    }
    let (numbers, more) = {
        let loss = SurfaceLoss::new(clips, searched.shape);
        polish(&loss, searched, &found, |numbers, more| watch(numbers, found.evaluations + more))
    };
    let (at, widths) = linearise_object(clips, searched.unknowns, &numbers)?;
    Ok(ObjectFit { at, widths, evaluations: found.evaluations + more, ..found })
}

/// Whether some of the clips are tosses: nothing pushes the object in them.
pub(super) fn let_go(clips: &ObjectClips) -> bool {
    (0..clips.clips()).any(|clip| clips.clip(clip).kind == ClipKind::FreeMotion)
}

/// Numbers of little loss near those of `from`, clips counting as they did there, and the clips simulated for it.
fn polish(
    loss: &SurfaceLoss<'_>,
    searched: Searched<'_>,
    from: &ObjectFit,
    watch: impl Fn(&[f64], usize) -> bool,
) -> (Vec<f64>, usize) {
    let Searched { unknowns, settings, seed, .. } = searched;
    let free: Vec<usize> = (0..unknowns.len()).filter(|k| settings[*k] != Setting::Mass).collect();
    let spread = spread(&from.at.information(), &free, unknowns);
    let place = |z: &[f64]| {
        let mut numbers = from.at.shared.clone();
        for (k, step) in free.iter().zip((&spread * DVector::from_column_slice(z)).iter()) {
            numbers[*k] = (numbers[*k] + step).clamp(unknowns[*k].lower, unknowns[*k].upper);
        }
        numbers
    };
    let axis = |k: usize| Unknown { name: format!("axis {k}"), start: 0.0, lower: -REACH, upper: REACH, step: 1.0 };
    let axes: Vec<Unknown> = (0..free.len()).map(axis).collect();
    let mut cloud = Evolution::of_width(&search::start(&axes), 0.5 * WIDTH / REACH, seed);
    let seen = Mutex::new(Vec::new());
    let cost = |z: &[f64]| {
        let cost = loss.mean(&place(z), &from.at.weights).unwrap_or(f64::INFINITY);
        seen.lock().expect("no holder panics").push((cost, z.to_vec()));
        cost
    };
    cost(&vec![0.0; free.len()]);
    let middle = || place(&middle_of_best(&mut seen.lock().expect("no holder panics")));
    let found = minimise(&mut cloud, &axes, POINTS, &[], cost, |_, best| {
        watch(&middle(), (1 + best.evaluations) * loss.clips())
    });
    (middle(), (1 + found.evaluations) * loss.clips())
}

/// The middle of the points with the least loss. The very lowest lies where chance has dug a hole into the roughness of
/// these clips' hits; others have theirs elsewhere.
fn middle_of_best(seen: &mut [(f64, Vec<f64>)]) -> Vec<f64> {
    // Threads ask in any order.
    seen.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.partial_cmp(&b.1).unwrap_or(Ordering::Equal)));
    let best = &seen[..seen.len().min(BEST)];
    let mean = |k: usize| best.iter().map(|(_, z)| z[k]).sum::<f64>() / best.len() as f64;
    (0..best.first().map_or(0, |(_, z)| z.len())).map(mean).collect()
}

/// A square root of the free numbers' covariance, (free, free), each in its own unit.
fn spread(information: &DMatrix<f64>, free: &[usize], unknowns: &[Unknown]) -> DMatrix<f64> {
    let n = free.len();
    let range = |k: usize| unknowns[free[k]].upper - unknowns[free[k]].lower;
    let on_diagonal = |i: usize, j: usize, value: f64| if i == j { value } else { 0.0 };
    let held = |i: usize, j: usize| information[(free[i], free[j])] + on_diagonal(i, j, range(i).powi(-2));
    let covariance = DMatrix::from_fn(n, n, held).try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
    let blurred = |i: usize, j: usize| covariance[(i, j)] + on_diagonal(i, j, (BLUR * range(i)).powi(2));
    let root = DMatrix::from_fn(n, n, blurred).cholesky().map(|root| root.l());
    root.unwrap_or_else(|| DMatrix::from_fn(n, n, |i, j| on_diagonal(i, j, BLUR * range(i))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_points_are_averaged_in_whatever_order_they_were_asked() {
        let point = |k: usize| (k as f64, vec![k as f64, 1.0]);
        let mut seen: Vec<_> = (0..20).map(|k| point((7 * k) % 20)).collect();
        assert_eq!(middle_of_best(&mut seen), [3.5, 1.0]);
        assert_eq!(middle_of_best(&mut [point(4)]), [4.0, 1.0]);
    }

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
