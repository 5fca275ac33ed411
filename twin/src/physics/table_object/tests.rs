//! How an object rests, falls, slides, topples and bounces.

use super::*;
use crate::physics::test_box::{self, nominal};
use crate::sliding::Coulomb;
use shared_mem::cell::GRAVITY;

const STEP: f64 = 2.5e-4;

/// The box with its centre of mass off its middle.
fn box_model(friction: f64, restitution: f64) -> ObjectModel {
    let centre_of_mass = Vector3::new(0.005, -0.004, 0.003);
    ObjectModel { centre_of_mass, friction, restitution, ..test_box::box_model() }
}

fn placed(model: &ObjectModel, pose: Isometry3<f64>, velocity: Vector3<f64>) -> TableObject<Coulomb> {
    let mut object = nominal(model, Some(0.0));
    object.set(&Pose::from_isometry(pose), velocity, Vector3::zeros());
    object
}

fn run(object: &mut TableObject<Coulomb>, seconds: f64) {
    for _ in 0..(seconds / STEP).round() as usize {
        object.step(STEP, &[]);
    }
}

fn height(object: &TableObject<Coulomb>) -> f64 {
    object.pose().position()[2]
}

#[test]
fn a_box_at_rest_stays_where_it_is() {
    let start = Isometry3::new(Vector3::new(0.5, 0.1, 0.05), Vector3::z() * 0.3);
    let mut object = placed(&box_model(0.3, 0.0), start, Vector3::zeros());
    run(&mut object, 2.0);
    let moved = start.inverse() * object.isometry();
    assert!(moved.translation.vector.norm() < 1e-4, "{}", moved.translation.vector);
    assert!(moved.rotation.angle() < 1e-3, "{}", moved.rotation.angle());
    let before = object.isometry();
    run(&mut object, 2.0);
    let crept = (before.inverse() * object.isometry()).translation.vector.norm();
    assert!(crept < 1e-6, "settled, then crept {crept} m");
}

#[test]
fn what_is_resumed_under_other_parameters_is_where_it_was() {
    let start = Isometry3::new(Vector3::new(0.5, 0.1, 0.05), Vector3::z() * 0.3);
    let mut object = placed(&box_model(0.3, 0.0), start, Vector3::x() * 0.2);
    let other = ObjectModel { mass: 0.5, centre_of_mass: Vector3::new(-0.01, 0.0, 0.0), ..box_model(0.3, 0.0) };
    for model in [other, box_model(0.3, 0.0)] {
        object.set_material(Material::nominal(model.parameters()));
        let motion = *object.motion();
        object.resume(&motion);
        let moved = start.inverse() * object.isometry();
        assert!(moved.translation.vector.norm() < 1e-9, "{}", moved.translation.vector);
        assert!((object.centre_velocity() - Vector3::x() * 0.2).norm() < 1e-9, "{}", object.centre_velocity());
    }
}

#[test]
fn a_dropped_box_does_not_hover() {
    let start = Isometry3::translation(0.0, 0.0, 0.06);
    let mut object = placed(&box_model(0.3, 0.0), start, Vector3::zeros());
    run(&mut object, 1.0);
    assert!((height(&object) - 0.05).abs() < 5e-5, "{}", height(&object));
}

#[test]
fn a_falling_box_follows_gravity() {
    let mut object = nominal(&box_model(0.3, 0.0), None);
    object.set(&Pose::from_isometry(Isometry3::translation(0.0, 0.0, 5.0)), Vector3::x(), Vector3::z() * 2.0);
    run(&mut object, 0.5);
    let fallen = 5.0 - height(&object);
    assert!((fallen - 0.5 * 9.81 * 0.25).abs() < 1e-3, "{fallen}");
    assert!((object.angular_velocity().z - 2.0).abs() < 1e-9);
}

#[test]
fn velocities_are_those_of_the_geometric_centre() {
    let turned = Isometry3::from_parts(
        nalgebra::Translation3::new(0.3, 0.2, 1.0),
        UnitQuaternion::from_euler_angles(0.3, 0.2, 1.0),
    );
    let mut object = nominal(&box_model(0.3, 0.0), None);
    let (velocity, spin) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, -2.0, 3.0));
    object.set(&Pose::from_isometry(turned), velocity, spin);
    let centre = Point3::from(turned.translation.vector);
    assert!((object.velocity_at(&centre) - velocity).norm() < 1e-12, "{}", object.velocity_at(&centre));
}

#[test]
fn a_sliding_box_travels_as_coulomb_says() {
    let mut model = box_model(0.3, 0.0);
    model.centre_of_mass = Vector3::zeros();
    let mut object = placed(&model, Isometry3::translation(0.0, 0.0, 0.05), Vector3::x() * 0.6);
    run(&mut object, 1.0);
    let travel = object.pose().position()[0];
    let coulomb = 0.36 / (2.0 * 0.3 * 9.81);
    assert!((travel / coulomb - 1.0).abs() < 0.005, "{travel} m, Coulomb {coulomb} m");
}

#[test]
fn a_box_on_a_grippy_table_topples_over_its_front_edge() {
    let start = Isometry3::translation(0.0, 0.0, 0.05);
    let mut object = placed(&box_model(1.5, 0.0), start, Vector3::x() * 1.2);
    run(&mut object, 2.0);
    assert!((height(&object) - 0.04).abs() < 2e-4, "{}", height(&object));
    assert!(object.angular_velocity() == Vector3::zeros());
}

#[test]
fn a_toppled_box_comes_to_rest_on_its_side() {
    let tilted = Isometry3::new(Vector3::new(0.0, 0.0, 0.2), Vector3::new(0.0, 1.2, 0.0));
    let mut object = placed(&box_model(0.4, 0.1), tilted, Vector3::new(0.5, 0.0, 0.0));
    run(&mut object, 3.0);
    assert!((height(&object) - 0.04).abs() < 2e-4, "{}", height(&object));
    assert!(object.velocity_at(&Point3::origin()).norm() < 1e-3);
}

#[test]
fn a_bounce_returns_the_restitution() {
    // On a corner right below the centre of mass: a flat landing has four impacts in one step, which act together.
    let mut model = box_model(0.0, 0.5);
    model.centre_of_mass = Vector3::zeros();
    let corner = -Vector3::new(0.04, 0.03, 0.05);
    let turn = UnitQuaternion::rotation_between(&corner, &-Vector3::z()).expect("not opposite");
    let start = Isometry3::from_parts(nalgebra::Translation3::new(0.0, 0.0, corner.norm() + 0.2), turn);
    let mut object = placed(&model, start, Vector3::zeros());
    run(&mut object, (2.0f64 * 0.2 / 9.81).sqrt() + 0.004);
    let mut top: f64 = 0.0;
    for _ in 0..1000 {
        object.step(STEP, &[]);
        top = top.max(height(&object) - corner.norm());
    }
    assert!((top / 0.2 - 0.25).abs() < 0.01, "rebound {top} m of 0.2 m");
}

#[test]
fn on_feet_a_box_topples_from_a_slope_on_which_its_corners_hold_it() {
    let lean = |pivot: f64| {
        let model = box_model(1.0, 0.0);
        // Down on a table that leans by 0.3 rad about its x axis.
        let gravity = Vector3::new(0.0, 0.3f64.sin(), -0.3f64.cos()) * GRAVITY;
        let level = Material::nominal(model.parameters());
        let made_of = Material { gravity, pressure_reach: 0.4, pivot_reach: pivot, ..level };
        let mut object = TableObject::new(&model, made_of, Some(0.0)).expect("a box");
        object.set(&Pose::from_isometry(Isometry3::translation(0.0, 0.0, 0.05)), Vector3::zeros(), Vector3::zeros());
        run(&mut object, 1.0);
        (object.isometry().rotation * Vector3::z()).angle(&Vector3::z())
    };
    assert!(lean(0.4) > 0.5, "{}", lean(0.4));
    assert!(lean(1.0) < 1e-3, "{}", lean(1.0));
}
