//! What is left of clips once their nuisance parameters are eliminated, against dense solutions of the whole.

use super::Likelihood;
use super::setting::Setting;
use super::test_bench::{FRICTION, NoArm, diagnosed_slides, largest, residuals, slide_under};
use crate::estimate::{ClipFit, ClipModel, Fit, Random, Schedule, Unknown, fit, score};
use crate::likelihood::cell::CellClips;
use nalgebra::{DMatrix, DVector};
use shared_mem::theta::{ObjectTheta, Theta};

type Slides = CellClips<'static, NoArm>;

/// Three slides of other frictions than the cell's, in three headings.
fn three() -> Slides {
    let clip = |k: u8| {
        let friction = Some(FRICTION * (1.04 + 0.02 * f64::from(k)));
        let hidden = Theta { object: Some(ObjectTheta { friction, ..ObjectTheta::default() }), ..Theta::default() };
        slide_under(&hidden, 1.3 * f64::from(k), 0.8)
    };
    diagnosed_slides((0..3).map(clip).collect(), &[Setting::Friction])
}

fn unknown() -> Unknown {
    Unknown { name: "friction".into(), start: FRICTION, lower: 0.1, upper: 0.6, step: 1e-3 }
}

/// The clips' nuisance parameters as normal ones; those of the path alone where `paths`.
fn random(slides: &Slides, paths: bool) -> Vec<Random> {
    let effects = slides.scatter();
    let held = |(k, random): (usize, Random)| {
        let sigma = if paths && !effects.heavy.contains(&k) { 0.0 } else { random.sigma };
        Random { sigma, ..random }
    };
    effects.random.iter().cloned().enumerate().map(held).collect()
}

/// Residuals of a clip, and their slopes by friction and by each nuisance parameter that scatters.
fn columns(
    (slides, clip): (&Slides, usize),
    friction: f64,
    own: &[f64],
    random: &[Random],
) -> (DVector<f64>, DVector<f64>, DMatrix<f64>) {
    let at = |friction: f64, own: &[f64]| DVector::from_vec(residuals(slides, clip, &[friction], own));
    let here = at(friction, own);
    let by_friction = (at(friction + 1e-3, own) - &here) / 1e-3;
    let by = |(k, random): (usize, &Random)| {
        let mut moved = own.to_vec();
        moved[k] += random.step;
        (random.sigma > 0.0).then(|| (at(friction, &moved) - &here) / random.step)
    };
    let by_own: Vec<DVector<f64>> = random.iter().enumerate().filter_map(by).collect();
    (here, by_friction, DMatrix::from_columns(&by_own))
}

#[test]
fn slopes_by_the_path_are_known_without_a_simulation_and_are_those_of_differences() {
    let slides = three();
    let effects = slides.scatter();
    let own = vec![0.0; effects.count()];
    let (_, _, slopes) = columns((&slides, 0), FRICTION, &own, &effects.random);
    assert!(slides.own_slope(0, 0).is_none(), "friction takes a simulation");
    for k in effects.heavy {
        let known = slides.own_slope(0, k).expect("a deviation of the path");
        let by_differences = slopes.column(k);
        let far = known.iter().zip(by_differences.iter()).map(|(a, b)| a - b);
        assert!(largest(far) < 1e-6 * largest(known.iter().copied()), "{}", effects.random[k].name);
        assert!(largest(known.iter().copied()) > 0.0);
    }
    assert!(slides.own_slope(0, 99).is_none());
}

#[test]
fn the_deviance_of_a_clip_is_that_of_the_normal_density_that_its_scatter_makes_of_it() {
    let slides = three();
    let random = random(&slides, true);
    let scored = score(&slides, &[FRICTION], &random, &Schedule::default()).expect("an answer");
    for (clip, scored) in scored.iter().enumerate() {
        let own = vec![0.0; random.len()];
        let (r, _, b) = columns((&slides, clip), FRICTION, &own, &random);
        let sigmas = random.iter().map(|random| random.sigma).filter(|sigma| *sigma > 0.0);
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(b.ncols(), sigmas.map(|sigma| sigma * sigma)));
        let covariance = DMatrix::identity(r.len(), r.len()) + &b * prior * b.transpose();
        let factor = covariance.cholesky().expect("a covariance");
        let expected = r.dot(&factor.solve(&r)) + factor.ln_determinant();
        assert!((scored.deviance / expected - 1.0).abs() < 1e-5, "clip {clip}: {} {expected}", scored.deviance);
        // What a clip has of its own lowers what is left of it.
        assert!(scored.chi2 < r.norm_squared());
    }
}

#[test]
fn information_and_slope_of_a_clip_are_those_of_the_whole_solved_at_once() {
    let slides = three();
    let random = random(&slides, true);
    let own: Vec<f64> = random.iter().enumerate().map(|(k, random)| 0.3 * k as f64 * random.sigma).collect();
    let unknowns = [unknown()];
    for clip in 0..slides.clips() {
        let left = ClipFit::at(&slides, clip, (&unknowns, &[FRICTION]), (&random, &own)).expect("an answer");
        let (r, a, b) = columns((&slides, clip), FRICTION, &own, &random);
        let scatters = || random.iter().zip(&own).filter(|(random, _)| random.sigma > 0.0);
        let root = DMatrix::from_diagonal(&DVector::from_iterator(b.ncols(), scatters().map(|(r, _)| r.sigma.recip())));
        let pull = DVector::from_iterator(b.ncols(), scatters().map(|(random, own)| own / random.sigma));
        // Rows of the clip, then one of each nuisance parameter in its sigma; columns: friction, then the parameters.
        let rows = r.len() + b.ncols();
        let mut x = DMatrix::zeros(rows, 1 + b.ncols());
        x.view_mut((0, 0), (r.len(), 1)).copy_from(&a);
        x.view_mut((0, 1), b.shape()).copy_from(&b);
        x.view_mut((r.len(), 1), root.shape()).copy_from(&root);
        let y = DVector::from_iterator(rows, r.iter().chain(pull.iter()).copied());
        let covariance = x.tr_mul(&x).try_inverse().expect("a solution");
        let step = -&covariance * x.tr_mul(&y);
        let expected = 1.0 / covariance[(0, 0)];
        assert!((left.information[(0, 0)] / expected - 1.0).abs() < 1e-6, "{} {expected}", left.information[(0, 0)]);
        let wanted = -left.gradient[0] / left.information[(0, 0)];
        assert!((wanted / step[0] - 1.0).abs() < 1e-6, "{wanted} {}", step[0]);
        // Nuisance parameters follow to where the whole solution has them.
        let moved = left.own_part_way(&DVector::from_element(1, step[0]), 1.0);
        let followed = moved.iter().zip(&own).zip(&random).filter(|(_, random)| random.sigma > 0.0);
        for (((to, from), random), step) in followed.zip(step.iter().skip(1)) {
            assert!((to - from - step).abs() < 1e-6 * random.sigma, "{}", random.name);
        }
    }
}

fn fitted(slides: &Slides, random: &[Random]) -> Fit {
    fit(slides, &[unknown()], random, &Schedule::default(), |_, _| true).expect("an answer")
}

#[test]
fn at_the_end_of_a_fit_no_parameter_of_the_whole_wants_to_go_anywhere() {
    let slides = three();
    for paths in [true, false] {
        let random = random(&slides, paths);
        let found = fitted(&slides, &random);
        assert!(found.converged);
        let mut slope = 0.0;
        for (clip, at) in found.clips.iter().enumerate() {
            let (r, a, b) = columns((&slides, clip), found.shared[0], &at.own, &random);
            slope += a.dot(&r);
            let scatters = random.iter().zip(&at.own).filter(|(random, _)| random.sigma > 0.0);
            for ((random, own), column) in scatters.zip(b.column_iter()) {
                let wants = (column.dot(&r) + own / random.sigma.powi(2)) * random.sigma;
                assert!(
                    wants.abs() < 0.1 * (column.norm() * random.sigma).hypot(1.0),
                    "{} of clip {clip}: {wants}",
                    random.name
                );
            }
        }
        let sigma = found.information()[(0, 0)].sqrt().recip();
        assert!(slope.abs() * sigma < 0.3, "{}", slope * sigma);
        assert!((found.shared[0] / FRICTION - 1.06).abs() < 0.02, "between the three: {:?}", found.shared);
    }
}

#[test]
fn a_friction_of_its_own_takes_what_a_clip_is_off_the_others_and_less_is_known_of_all() {
    let slides = three();
    let [paths, all] = [true, false].map(|paths| fitted(&slides, &random(&slides, paths)));
    let off: Vec<f64> = all.clips.iter().map(|clip| clip.own[0]).collect();
    assert!(off[0] < -0.004 && off[1].abs() < 0.004 && off[2] > 0.004, "{off:?}");
    assert!(all.information()[(0, 0)] < 0.5 * paths.information()[(0, 0)]);
    assert!(all.clips.iter().map(|clip| clip.chi2).sum::<f64>() < paths.clips.iter().map(|clip| clip.chi2).sum());
}

#[test]
fn a_clip_that_is_there_twice_counts_twice_and_their_order_not_at_all() {
    let clips = |order: &[usize]| {
        let clip = |k: &usize| slide_under(&Theta::default(), 1.3 * *k as f64, 0.8);
        diagnosed_slides(order.iter().map(clip).collect(), &[Setting::Friction])
    };
    let (random, unknowns) = (random(&clips(&[0]), false), [unknown()]);
    let of = |order: &[usize]| {
        let start = Unknown { start: 0.25, ..unknowns[0].clone() };
        fit(&clips(order), &[start], &random, &Schedule::default(), |_, _| true).expect("an answer")
    };
    let (once, turned, twice) = (of(&[0, 1, 2]), of(&[2, 0, 1]), of(&[0, 1, 2, 0, 1, 2]));
    assert!((once.shared[0] / turned.shared[0] - 1.0).abs() < 1e-6, "{:?} {:?}", once.shared, turned.shared);
    assert!((once.shared[0] / twice.shared[0] - 1.0).abs() < 1e-4, "{:?} {:?}", once.shared, twice.shared);
    assert!((twice.information()[(0, 0)] / once.information()[(0, 0)] - 2.0).abs() < 0.02);
    assert!((twice.deviance() / once.deviance() - 2.0).abs() < 1e-2);
}
