//! Penalties, precisions and scales of random effects against plain re-computations from the densities that they stand for.

use super::random_effects::RandomEffects;
use super::random_effects_scale::{Around, MIN_SCALE, at_the_best_scale};
use crate::estimate::Random;
use nalgebra::DMatrix;
use proptest::prelude::*;
use statrs::distribution::{Continuous as _, Normal, StudentsT};
use std::ops::Range;

/// Degrees of freedom of the heavy tails, as the module states them.
const FREE: f64 = 3.0;

fn effects(sigmas: &[f64], heavy: Range<usize>) -> RandomEffects {
    let random = |(k, sigma): (usize, &f64)| Random { name: format!("u{k}"), sigma: *sigma, step: 1e-3 };
    RandomEffects { random: sigmas.iter().enumerate().map(random).collect(), heavy, forgiving: 1.0 }
}

/// `-2 ln` of the prior density with all its constants: normal ones, and one Student t of several dimensions.
fn minus_two_ln(sigmas: &[f64], heavy: &Range<usize>, own: &[f64]) -> f64 {
    let normal = |k: usize| Normal::new(0.0, sigmas[k]).expect("a sigma").ln_pdf(own[k]);
    let light: f64 = (0..own.len()).filter(|k| !heavy.contains(k)).map(normal).sum();
    let square: f64 = heavy.clone().map(|k| (own[k] / sigmas[k]).powi(2)).sum();
    let n = heavy.len() as f64;
    // Gamma functions and volumes are constants of it.
    -2.0 * light + (FREE + n) * (1.0 + square / FREE).ln()
}

proptest! {
    #[test]
    fn the_penalty_is_the_density_but_for_a_constant(
        sigmas in prop::array::uniform4(0.05..3.0_f64), a in prop::array::uniform4(-9.0..9.0_f64),
        b in prop::array::uniform4(-9.0..9.0_f64), heavy in 0_usize..=4,
    ) {
        let (effects, heavy) = (effects(&sigmas, heavy..4), heavy..4);
        let found = effects.penalty(&a) - effects.penalty(&b);
        let expected = minus_two_ln(&sigmas, &heavy, &a) - minus_two_ln(&sigmas, &heavy, &b);
        prop_assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{found} {expected}");
        prop_assert_eq!(effects.penalty(&[0.0; 4]), 0.0);
        // Which sign a deviation has says nothing of it.
        prop_assert!((effects.penalty(&a) - effects.penalty(&a.map(|u| -u))).abs() < 1e-12);
    }

    #[test]
    fn half_the_slope_of_the_penalty_is_the_precision_times_the_value(
        sigmas in prop::array::uniform3(0.1..3.0_f64), own in prop::array::uniform3(-9.0..9.0_f64), heavy in 0_usize..=3,
    ) {
        let effects = effects(&sigmas, heavy..3);
        let precision = effects.precision(&own);
        for k in 0..3 {
            let at = |step: f64| { let mut own = own; own[k] += step; effects.penalty(&own) };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            prop_assert!((0.5 * slope - precision[k] * own[k]).abs() < 1e-5 * (1.0 + slope.abs()), "{k}");
        }
    }

    /// What is added to the deviance of a normal prior with that precision makes it the heavy-tailed one's.
    #[test]
    fn the_correction_makes_a_normal_prior_of_that_precision_a_heavy_tailed_one(
        sigmas in prop::array::uniform3(0.1..3.0_f64), own in prop::array::uniform3(-9.0..9.0_f64), heavy in 0_usize..=3,
    ) {
        let effects = effects(&sigmas, heavy..3);
        let precision = effects.precision(&own);
        let pull: f64 = own.iter().zip(&precision).map(|(u, precision)| precision * u * u).sum();
        // The volume is taken over ln det of the precision, of which the hold is a part that the sigmas are not.
        let hold: f64 = (heavy..3).map(|k| (precision[k] * sigmas[k] * sigmas[k]).ln()).sum();
        let expected = effects.penalty(&own) - pull + hold;
        prop_assert!((effects.correction(&own) - expected).abs() < 1e-9 * (1.0 + expected.abs()));
    }

    #[test]
    fn a_scale_is_a_unit_of_the_heavy_tailed_ones_alone(
        sigmas in prop::array::uniform3(0.1..3.0_f64), own in prop::array::uniform3(-9.0..9.0_f64), scale in 0.1..4.0_f64,
    ) {
        let effects = effects(&sigmas, 1..3);
        let in_units = [own[0], own[1] / scale, own[2] / scale];
        prop_assert!((effects.scaled(scale).penalty(&own) - effects.penalty(&in_units)).abs() < 1e-9);
        let narrowed = effects.narrowed(scale);
        // Held closer by the square of the scale, but which clip is an outlier is decided as before.
        let [held, before] = [&narrowed, &effects].map(|effects| effects.precision(&own));
        prop_assert!((held[0] - before[0]).abs() < 1e-12);
        for k in 1..3 {
            prop_assert!((held[k] * scale * scale / before[k] - 1.0).abs() < 1e-9, "{k}");
        }
    }
}

#[test]
fn a_heavy_tailed_one_alone_is_a_student_t_and_ten_sigmas_are_no_wonder() {
    let effects = effects(&[0.4], 0..1);
    let student = StudentsT::new(0.0, 0.4, FREE).expect("a distribution");
    for x in [0.0, 0.3, 1.0, 4.0, 40.0] {
        let expected = -2.0 * (student.ln_pdf(x) - student.ln_pdf(0.0));
        assert!((effects.penalty(&[x]) - expected).abs() < 1e-9, "{x}");
    }
    // Its tails fall by a power: each doubling costs the same.
    let doubling = |x: f64| effects.penalty(&[2.0 * x]) - effects.penalty(&[x]);
    assert!((doubling(1e3) - 2.0 * (FREE + 1.0) * 2.0_f64.ln()).abs() < 1e-3 && doubling(1e3) - doubling(1e6) < 1e-3);
    assert!(effects.penalty(&[4.0]) < 15.0, "ten sigmas of a normal one cost 100");
}

#[test]
fn one_that_does_not_scatter_costs_nothing_and_stays_where_it_is() {
    let effects = effects(&[0.0, 2.0], 1..2);
    assert_eq!((effects.precision(&[0.0, 0.0])[0], effects.penalty(&[5.0, 0.0])), (1.0, 0.0));
    assert_eq!((RandomEffects::default().count(), RandomEffects::default().penalty(&[])), (0, 0.0));
    assert!(RandomEffects::default().precision(&[]).is_empty() && RandomEffects::default().correction(&[]) == 0.0);
}

/// A clip of one nuisance parameter whose residuals put it at `at`, as surely as `information` says.
fn clip(at: f64, information: f64) -> Around {
    let gram = DMatrix::from_row_slice(2, 2, &[at * at, -at, -at, 1.0]) * information;
    Around { gram, own: vec![0.0] }
}

/// `-2 ln` of a clip's likelihood, integrated over its nuisance parameter by small steps.
fn integrated(at: f64, information: f64, sigma: f64) -> f64 {
    let student = StudentsT::new(0.0, sigma, FREE).expect("a distribution");
    let (step, width) = (0.01 / information.sqrt(), 12.0 / information.sqrt());
    let steps = (2.0 * width / step) as i32;
    let density = |k: i32| {
        let u = at - width + step * f64::from(k);
        (-0.5 * information * (u - at).powi(2)).exp() * student.pdf(u)
    };
    -2.0 * ((0..=steps).map(density).sum::<f64>() * step).ln()
}

#[test]
fn the_scale_of_a_scatter_is_that_under_which_clips_are_most_likely_by_integration() {
    let information = 400.0;
    for spread in [0.08, 0.3, 0.7, 1.5, 4.0] {
        let places = [-1.3, 0.4, 0.9, -0.6, 1.7, -0.2, 0.5, -1.0].map(|place: f64| place * spread);
        let clips: Vec<Around> = places.iter().map(|at| clip(*at, information)).collect();
        let scatter = effects(&[1.0], 0..1);
        let found = at_the_best_scale(&clips.iter().collect::<Vec<_>>(), &scatter);
        let whole = |scale: f64| places.map(|at| integrated(at, information, scale)).iter().sum::<f64>();
        let best = [1.0, 0.5, 0.25, MIN_SCALE].map(|scale| whole(scale) - whole(1.0)).into_iter().fold(0.0, f64::min);
        let sum: f64 = found.iter().sum();
        assert_eq!(found.len(), places.len());
        assert!((sum - best).abs() < 0.1 + 0.03 * best.abs(), "spread {spread}: {sum} and integrated {best}");
    }
}

#[test]
fn the_scale_knows_no_order_of_clips_and_one_outlier_does_not_decide_it() {
    let scatter = effects(&[1.0], 0..1);
    let of = |places: &[f64]| {
        let clips: Vec<Around> = places.iter().map(|at| clip(*at, 1e4)).collect();
        at_the_best_scale(&clips.iter().collect::<Vec<_>>(), &scatter)
    };
    let places = [0.05, -0.08, 0.1, -0.03, 0.07, 0.02];
    let (forward, mut backward) = (of(&places), of(&places.iter().rev().copied().collect::<Vec<_>>()));
    backward.reverse();
    assert!(forward.iter().zip(&backward).all(|(a, b)| (a - b).abs() < 1e-9), "{forward:?} {backward:?}");
    let with_one = of(&[&places[..], &[5.0]].concat());
    assert!(with_one[..6].iter().sum::<f64>() < 0.5 * forward.iter().sum::<f64>(), "{with_one:?} {forward:?}");
}
