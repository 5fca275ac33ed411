//! The slopes that fits are made of, taken by one step to one side, against central differences over steps of two sizes: for every
//! kind of parameter that turns what an arm or an object does.

use super::arm::ArmClips;
use super::setting::{Setting, Settings, arm_numbers, complete, effect_settings, object_parameters};
use super::test_bench::{NOISE, residuals, slide_under, slides, sliding_cell};
use super::test_servo::{Swing, cell, clip};
use crate::estimate::{ClipFit, ClipModel, Unknown};
use shared_mem::theta::Theta;
use twin::arm::ArmModel;
use twin::effects::{Robot, Search, Stage, find};

/// `J'r` and `J'J` of one number by central differences, extrapolated from two steps (Richardson 1911).
fn central(model: &impl ClipModel, at: f64, step: f64) -> [f64; 2] {
    let here = residuals(model, 0, &[at], &[]);
    let slope = |step: f64| -> Vec<f64> {
        let [up, down] = [at + step, at - step].map(|at| residuals(model, 0, &[at], &[]));
        up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * step)).collect()
    };
    let (once, twice) = (slope(step), slope(2.0 * step));
    let slopes = once.iter().zip(&twice).map(|(once, twice)| once + (once - twice) / 3.0);
    slopes.zip(&here).fold([0.0; 2], |[g, h], (slope, r)| [g + slope * r, h + slope * slope])
}

/// The largest relative error of a fit's slopes at `at`; `None` where the clip would not tell one end of its range from the other.
fn off(model: &impl ClipModel, unknown: &Unknown, at: f64) -> Option<f64> {
    let fit = ClipFit::at(model, 0, (std::slice::from_ref(unknown), &[at]), (&[], &[])).expect("an answer");
    let [gradient, information] = central(model, at, unknown.step);
    let size = (information * fit.chi2).sqrt();
    (information * (unknown.upper - unknown.lower).powi(2) > 1.0).then(|| {
        let of_gradient = (fit.gradient[0] - gradient).abs() / size.max(f64::MIN_POSITIVE);
        (fit.information[(0, 0)] / information - 1.0).abs().max(of_gradient)
    })
}

fn between(unknown: &Unknown, share: f64) -> f64 {
    unknown.lower + share * (unknown.upper - unknown.lower)
}

/// A servo that swings, held against itself with one number turned.
fn of_servo(setting: Setting, base: &Theta) -> ArmClips<impl Fn(&[f64]) -> Theta + Sync> {
    let known = cell("joint_impedance");
    let recorded = clip(&known, &complete(&known, None).expect("gains"), &Swing::default());
    let settings = Settings::new(base.clone(), vec![setting]);
    ArmClips::moments(&known, &[recorded], move |shared: &[f64]| settings.theta(shared)).expect("an arm")
}

#[test]
fn slopes_of_every_gain_and_of_unknown_weight_are_those_of_central_differences() {
    let known = cell("joint_impedance");
    let base = complete(&known, None).expect("gains");
    let all = arm_numbers(&known, &base);
    assert_eq!(all.len(), 10);
    for (setting, unknown) in all {
        // A weight so large that the motor reaches its limit bends within a step.
        for share in [0.42, 0.58] {
            let off = off(&of_servo(setting, &base), &unknown, between(&unknown, share)).expect("it shows");
            assert!(off < 5e-3, "{} at {share}: {off}", unknown.name);
        }
    }
}

#[test]
fn slopes_of_effects_of_an_arm_are_those_of_central_differences_where_a_slope_leads_there() {
    let known = cell("joint_impedance");
    let base = complete(&known, None).expect("gains");
    let robot = Robot::of(&ArmModel::from_cell(&known).expect("an arm"));
    let smooth = [
        ("joint_viscous_friction", 0.01),
        ("torque_gain", 0.01),
        ("rotor_inertia", 0.01),
        ("joint_friction_asymmetry", 0.05),
        ("command_lag", 0.02),
        ("command_delay", 0.05),
        ("torque_delay", 0.05),
        ("integral_action", 0.02),
    ];
    let mut seen = 0;
    for (name, close) in smooth {
        let info = find(name).expect("an effect");
        assert_eq!(info.stage, Stage::Control);
        let numbers = effect_settings(info, &robot, 2).into_iter();
        for (setting, unknown) in numbers.filter(|(setting, _)| setting.joint().is_none_or(|joint| joint == 0)) {
            if !matches!(setting.search(), Some(Search::Slope | Search::Lateness | Search::OnRequest)) {
                continue;
            }
            let Some(off) = off(&of_servo(setting, &base), &unknown, between(&unknown, 0.31)) else { continue };
            assert!(off < close, "{}: {off}", unknown.name);
            seen += 1;
        }
    }
    assert!(seen >= 6, "{seen} numbers");
}

#[test]
fn slopes_of_an_objects_numbers_are_those_of_central_differences() {
    let known = sliding_cell(NOISE);
    let base = complete(&known, None).expect("a cell");
    let recorded = slide_under(&Theta::default(), 0.4, 0.8);
    let mut seen = Vec::new();
    for (setting, unknown) in object_parameters(&known, &base) {
        let clips = slides(NOISE, vec![recorded.clone()], &[setting]);
        let at = if setting == Setting::Friction { 0.34 } else { between(&unknown, 0.6) };
        let Some(off) = off(&clips, &unknown, at) else { continue };
        // A slide ends at a moment: its slope by friction bends there, over a step as wide as a search takes it.
        assert!(off < 0.2, "{}: {off}", unknown.name);
        seen.push(unknown.name);
    }
    assert!(seen.contains(&"friction".to_owned()) && seen.iter().any(|name| name.starts_with("centre")), "{seen:?}");
}

#[test]
fn slopes_of_effects_of_table_and_camera_are_those_of_central_differences() {
    let recorded = slide_under(&Theta::default(), 0.4, 0.8);
    let mut seen = 0;
    for name in [
        "viscous_sliding_drag",
        "velocity_dependent_friction",
        "table_tilt",
        "anisotropic_friction",
        "camera_extrinsic_rotation",
        "camera_extrinsic_translation",
        "camera_scale",
    ] {
        for (setting, unknown) in effect_settings(find(name).expect("an effect"), &Robot::unknown(), 0) {
            if setting.search() != Some(Search::Slope) {
                continue;
            }
            let clips = slides(NOISE, vec![recorded.clone()], &[setting]);
            let [lower, upper] = unknown.room(unknown.start);
            let at = unknown.start + 0.1 * if upper > -lower { upper } else { lower };
            let Some(off) = off(&clips, &unknown, at) else { continue };
            assert!(off < 0.2, "{}: {off}", unknown.name);
            seen += 1;
        }
    }
    assert!(seen >= 6, "{seen} numbers");
}

#[test]
fn a_step_at_the_upper_bound_is_taken_downwards_and_finds_the_same_slope() {
    let known = cell("joint_impedance");
    let base = complete(&known, None).expect("gains");
    let (setting, unknown) = arm_numbers(&known, &base).swap_remove(0);
    let arm = of_servo(setting, &base);
    let at = 33.0;
    let bound = Unknown { upper: at, ..unknown.clone() };
    let [inside, there] = [&unknown, &bound].map(|unknown| {
        ClipFit::at(&arm, 0, (std::slice::from_ref(unknown), &[at]), (&[], &[])).expect("an answer").information[(0, 0)]
    });
    assert!((inside / there - 1.0).abs() < 1e-3 && inside != there, "{inside} {there}");
}
