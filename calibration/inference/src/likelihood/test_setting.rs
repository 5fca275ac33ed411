//! Numbers of a search and the parameters that they stand for, there and back.

use super::setting::{BaseError, Setting, Settings, arm_numbers, complete, effect_settings, object_parameters};
use super::test_servo;
use crate::estimate::Unknown;
use proptest::prelude::*;
use shared_mem::cell::{Cell, Controller, Object, Robot as CellRobot};
use shared_mem::theta::{ObjectTheta, Theta};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;
use twin::effects::{Effects, Robot, registry};

static CELL: LazyLock<Cell> = LazyLock::new(|| {
    Cell::parse(include_str!("../../../../config/fr3_cell.toml"), Path::new("cell.toml")).expect("the shipped cell")
});
static BASE: LazyLock<Theta> = LazyLock::new(|| complete(&CELL, None).expect("a complete cell"));

/// Every number that anything can search in the shipped cell.
static ALL: LazyLock<Vec<(Setting, Unknown)>> = LazyLock::new(|| {
    let effects = registry().iter().flat_map(|info| effect_settings(info, &Robot::unknown(), 7));
    arm_numbers(&CELL, &BASE).into_iter().chain(object_parameters(&CELL, &BASE)).chain(effects).collect()
});

fn within(unknown: &Unknown, share: f64) -> f64 {
    unknown.lower + share * (unknown.upper - unknown.lower)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn what_is_written_is_read_and_nothing_else_changes(shares in prop::collection::vec(0.01..0.99_f64, 400)) {
        let (settings, unknowns): (Vec<Setting>, Vec<Unknown>) = ALL.iter().cloned().unzip();
        let settings = Settings::new(BASE.clone(), settings);
        let numbers: Vec<f64> = unknowns.iter().zip(shares.iter().cycle()).map(|(u, share)| within(u, *share)).collect();
        let theta = settings.theta(&numbers);
        for ((read, number), unknown) in settings.numbers(&theta).into_iter().zip(&numbers).zip(&unknowns) {
            let read = read.expect("it was written");
            prop_assert!((read - number).abs() <= 1e-12 * number.abs(), "{}: {read} {number}", unknown.name);
        }
        // What is not turned stays as it is in the base.
        prop_assert_eq!(Settings::new(theta.clone(), Vec::new()).theta(&[]), theta);
    }

    #[test]
    fn numbers_of_different_parameters_do_not_touch_each_other(
        turned in 0_usize..400, looked_at in 0_usize..400, share in 0.01..0.99_f64,
    ) {
        let ((one, unknown), (other, _)) = (&ALL[turned % ALL.len()], &ALL[looked_at % ALL.len()]);
        prop_assume!(one != other);
        let whole = |theta: &Theta| Settings::new(BASE.clone(), vec![*other]).numbers(theta)[0];
        let theta = Settings::new(BASE.clone(), vec![*one]).theta(&[within(unknown, share)]);
        let (before, after) = (whole(&BASE), whole(&theta));
        // Of an effect that was not there before the others are at rest.
        prop_assert!(before.is_none() || before == after, "{} by {}", other.name(), one.name());
    }
}

#[test]
fn every_number_has_a_name_of_its_own_and_its_parameter_a_unit() {
    let names: BTreeSet<String> = ALL.iter().map(|(setting, _)| setting.name()).collect();
    assert_eq!(names.len(), ALL.len());
    for (setting, unknown) in ALL.iter() {
        assert_eq!(setting.name(), unknown.name);
        assert!(!setting.physical_unit().is_empty() && setting.name().contains(&setting.parameter()), "{setting:?}");
        assert!(unknown.lower <= unknown.start && unknown.start <= unknown.upper && unknown.step > 0.0, "{unknown:?}");
        assert!(unknown.step < 0.5 * (unknown.upper - unknown.lower), "{unknown:?}");
        assert_eq!(setting.of_effect().is_some(), matches!(setting, Setting::Effect { .. }));
        assert_eq!(setting.search().is_some(), setting.of_effect().is_some());
    }
}

#[test]
fn a_parameter_without_bound_is_turned_as_its_inverse_and_never_beyond_what_is_stiff() {
    let inverse = |setting: &Setting| matches!(setting, Setting::Effect { inverse: true, .. });
    let (turned, plain): (Vec<_>, Vec<_>) = ALL.iter().partition(|(setting, _)| inverse(setting));
    assert!(turned.len() >= 14, "of gears and limits: {}", turned.len());
    for (setting, unknown) in turned {
        assert!(setting.name().starts_with("1/") && unknown.start == 0.0 && unknown.lower == 0.0);
        assert!(setting.physical(0.0).is_infinite() && setting.physical(-1.0).is_infinite());
        assert!((setting.physical(0.25) - 4.0).abs() < 1e-12);
    }
    assert!(plain.iter().all(|(setting, _)| setting.physical(-0.25) == -0.25));
}

#[test]
fn a_complete_cell_is_complete_and_what_was_given_stays() {
    assert_eq!(complete(&CELL, Some(&BASE)).expect("a cell"), *BASE);
    let object = ObjectTheta { friction: Some(0.21), ..ObjectTheta::default() };
    let given = Theta { object: Some(object), ..test_servo::gains([1.0; 2], [1.0; 2]) };
    let wrong = complete(&CELL, Some(&given)).expect_err("two gains of seven");
    assert!(matches!(&wrong, BaseError::Gains(_)) && !wrong.to_string().contains('\n'), "{wrong}");
    let whole = complete(&CELL, Some(&Theta { arm: None, ..given })).expect("a cell");
    let object = whole.object.expect("an object");
    assert_eq!(object.friction, Some(0.21));
    assert_eq!(object.mass, BASE.object.as_ref().and_then(|object| object.mass));
    assert_eq!(whole.arm, BASE.arm);
    assert_eq!(complete(&Cell::default(), None).expect("nothing to complete"), Theta::default());
}

#[test]
fn what_cannot_show_in_a_cell_is_not_searched() {
    let servo = test_servo::cell("joint_impedance");
    let base = complete(&servo, None).expect("a cell");
    // Gains of two joints, and what the weight of unknown masses asks of each.
    let names: Vec<String> = arm_numbers(&servo, &base).into_iter().map(|(setting, _)| setting.name()).collect();
    assert_eq!(names[..4], ["stiffness[0]", "stiffness[1]", "damping[0]", "damping[1]"]);
    assert_eq!(names.len(), 4 + 3 * 2, "{names:?}");
    assert!(object_parameters(&servo, &base).is_empty());
    let alone = Cell { robot: None, controller: None, tool: None, ..CELL.clone() };
    let base = complete(&alone, None).expect("a cell");
    let searched: Vec<Setting> = object_parameters(&alone, &base).into_iter().map(|(setting, _)| setting).collect();
    assert!(!searched.contains(&Setting::TipFriction) && searched.contains(&Setting::Friction), "{searched:?}");
    assert!(arm_numbers(&alone, &base).is_empty());
}

#[test]
fn a_start_beyond_its_range_begins_on_the_range() {
    let object = |friction| ObjectTheta { friction: Some(friction), ..ObjectTheta::default() };
    for (friction, start) in [(0.01, 0.1), (0.3, 0.3), (2.0, 0.8)] {
        let base =
            complete(&CELL, Some(&Theta { object: Some(object(friction)), ..Theta::default() })).expect("a cell");
        let all = object_parameters(&CELL, &base);
        let (_, found) = all.iter().find(|(setting, _)| *setting == Setting::Friction).expect("friction");
        assert_eq!((found.start, found.lower, found.upper), (start, 0.1, 0.8));
    }
    // Where cell.toml states no range, an object's centre of mass lies within its shape.
    let bare = Cell {
        objects: vec![Object { centre_of_mass_range: None, mass_range: None, ..CELL.objects[0].clone() }],
        ..CELL.clone()
    };
    let base = complete(&bare, None).expect("a cell");
    for (setting, unknown) in object_parameters(&bare, &base) {
        if let Setting::CentreOfMass(axis) = setting {
            let half = 0.5 * [0.08, 0.06, 0.10][axis];
            assert!((unknown.upper - 0.5 * half).abs() < 1e-12 && (unknown.lower + 0.5 * half).abs() < 1e-12);
        }
    }
}

#[test]
fn an_effect_at_rest_changes_nothing_and_a_single_number_stands_for_all_joints_until_one_is_turned() {
    for info in registry() {
        let (settings, unknowns): (Vec<Setting>, Vec<Unknown>) =
            effect_settings(info, &Robot::unknown(), 7).into_iter().unzip();
        let settings = Settings::new(BASE.clone(), settings);
        let theta = settings.theta(&unknowns.iter().map(|unknown| unknown.start).collect::<Vec<_>>());
        assert!(Effects::from_theta(&theta.effects, 7).expect("an effect").is_none(), "{}", info.name);
    }
    let all = test_servo::with_effect(&BASE, "joint_viscous_friction", &[("viscous", 0.4)]);
    let of = |joint| Setting::Effect {
        name: "joint_viscous_friction",
        parameter: "viscous",
        index: Some(joint),
        inverse: false,
    };
    let settings = Settings::new(all, vec![of(2)]);
    let turned = settings.theta(&[1.5]);
    let read = Settings::new(turned.clone(), vec![of(1), of(2), of(6)]).numbers(&turned);
    assert_eq!(read, [Some(0.4), Some(1.5), Some(0.4)]);
    assert_eq!((of(2).joint(), of(2).parameter().as_str()), (Some(2), "joint_viscous_friction.viscous"));
    assert_eq!(Setting::Damping(3).joint(), Some(3));
    assert_eq!(Setting::Mass.joint(), None);
}

#[test]
fn a_robot_without_a_law_has_no_gains_to_search() {
    let lawless = Cell { controller: None, ..CELL.clone() };
    let base = complete(&lawless, None).expect("a cell");
    assert!(base.arm.is_none() && arm_numbers(&lawless, &base).is_empty());
    let joints = CellRobot { joints: vec!["a".into()], ..CellRobot::default() };
    let bare = Cell { robot: Some(joints), controller: Some(Controller::default()), ..Cell::default() };
    let why = complete(&bare, None).map(|theta| theta.arm).expect_err("no gains are known").to_string();
    assert!(why.contains("stiffness") && !why.contains('\n'), "{why}");
}
