//! Figures of the sliding law that are known in closed form or by an independent quadrature.

use nalgebra::{Vector2, Vector3};
use shared_mem::cell::Support;
use twin::sliding::{Coulomb, Ending, Patch, PlanarState, Slider, Wrench};

const MASS: f64 = 0.3;
const MU: f64 = 0.3;
const GRAVITY: f64 = 9.81;

/// A homogeneous box of 0.08 x 0.06 x 0.10 m.
fn slider(support: Support) -> Slider {
    Slider {
        mass: MASS,
        yaw_inertia: MASS / 12.0 * (0.08 * 0.08 + 0.06 * 0.06),
        height: 0.05,
        patch: Patch::rectangle([0.08, 0.06], Vector2::zeros(), support).expect("a rectangle"),
    }
}

fn moving(velocity: Vector2<f64>, yaw_rate: f64) -> PlanarState {
    PlanarState { position: Vector2::zeros(), yaw: 0.0, velocity, yaw_rate }
}

/// Slides to rest, and fails if the energy ever grows.
fn to_rest(slider: &Slider, mut state: PlanarState, dt: f64) -> PlanarState {
    let weight = Wrench::weight(MASS, -Vector3::z() * GRAVITY);
    for _ in 0..(2.0 / dt) as usize {
        let energy = slider.kinetic_energy(&state);
        let ending = slider.step(&mut state, &weight, &Coulomb(MU), dt);
        assert!(slider.kinetic_energy(&state) <= energy, "energy grew at {state:?}");
        match ending {
            Ending::Rests => return state,
            Ending::Slides => {}
            Ending::Lifts { .. } => panic!("a low slide lifts at {state:?}"),
        }
    }
    panic!("still moving: {state:?}");
}

#[test]
fn without_spin_the_travel_is_v_squared_over_two_mu_g() {
    let expected = 0.36 / (2.0 * MU * GRAVITY);
    for support in [Support::Corners, Support::Uniform, Support::Ring] {
        for direction in [Vector2::x(), Vector2::y(), Vector2::new(0.6, 0.8)] {
            let end = to_rest(&slider(support), moving(direction * 0.6, 0.0), 1e-3);
            assert!((end.position.norm() / expected - 1.0).abs() < 0.005, "{support:?} {direction:?}: {end:?}");
            assert!(
                (end.position.normalize() - direction).norm() < 1e-6 && end.yaw.abs() < 1e-6,
                "{support:?}: {end:?}"
            );
        }
    }
}

#[test]
fn spin_lengthens_the_travel_and_the_pressure_under_the_base_decides_how_far_it_turns() {
    for (support, travel, yaw) in [(Support::Corners, 0.0640, 0.481), (Support::Uniform, 0.0643, 0.933)] {
        let end = to_rest(&slider(support), moving(Vector2::x() * 0.6, 6.0), 1e-3);
        assert!((end.position.norm() / travel - 1.0).abs() < 0.015, "{support:?}: {end:?}");
        assert!((end.yaw / yaw - 1.0).abs() < 0.03, "{support:?}: {end:?}");
    }
}

#[test]
fn a_six_cornered_base_slides_as_far_and_spins_down_with_its_own_lever_arms() {
    let corner = |i: i32| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_3).sin_cos();
        Vector2::new(cos, sin) * 0.04
    };
    // A ring of radius r and an even disc brake a spin with the lever r and 2/3 r; a hexagon lies a little inside.
    for (support, lever) in [(Support::Corners, 0.04), (Support::Ring, 0.0366), (Support::Uniform, 0.0243)] {
        let base = (0..6).map(corner);
        let slider = Slider { patch: Patch::under(base, support).expect("a hexagon"), ..slider(support) };
        let slid = to_rest(&slider, moving(Vector2::y() * 0.6, 0.0), 1e-3);
        assert!((slid.position.y / (0.36 / (2.0 * MU * GRAVITY)) - 1.0).abs() < 0.005, "{support:?}: {slid:?}");
        let spun = to_rest(&slider, moving(Vector2::zeros(), 8.0), 1e-3);
        let expected = 64.0 / 2.0 * slider.yaw_inertia / (MU * MASS * GRAVITY * lever);
        assert!((spun.yaw / expected - 1.0).abs() < 0.02, "{support:?}: {} instead of {expected}", spun.yaw);
    }
}

#[test]
fn halving_the_step_moves_no_answer_by_a_fifth_of_a_per_cent() {
    for support in [Support::Corners, Support::Uniform, Support::Ring] {
        for (velocity, spin) in [(0.6, 0.0), (0.6, 6.0), (0.2, 15.0), (0.0, 10.0), (1.5, 0.5)] {
            let [coarse, fine] =
                [1e-3, 5e-4].map(|dt| to_rest(&slider(support), moving(Vector2::new(0.8, 0.6) * velocity, spin), dt));
            let travel = fine.position.norm().max(1e-3);
            assert!(
                (coarse.position - fine.position).norm() < 2e-3 * travel,
                "{support:?} {velocity} {spin}: {coarse:?} {fine:?}"
            );
            assert!(
                (coarse.yaw - fine.yaw).abs() < 2e-3 * fine.yaw.abs().max(1e-3),
                "{support:?} {velocity} {spin}: {coarse:?} {fine:?}"
            );
        }
    }
}

#[test]
fn a_large_step_still_stops_where_a_small_one_does() {
    let slider = slider(Support::Corners);
    let expected = 0.36 / (2.0 * MU * GRAVITY);
    for dt in [2e-2, 7e-3, 1e-4] {
        let end = to_rest(&slider, moving(Vector2::x() * 0.6, 0.0), dt);
        assert!((end.position.x / expected - 1.0).abs() < 1e-4, "dt {dt}: {end:?}");
    }
}

#[test]
fn a_pure_spin_stays_in_place_and_takes_the_time_of_its_lever_arms() {
    let slider = slider(Support::Corners);
    // Four corners 0.05 m from the middle: spin falls by mu m g 0.05 / I each second.
    let rate = MU * MASS * GRAVITY * 0.05 / slider.yaw_inertia;
    let end = to_rest(&slider, moving(Vector2::zeros(), 5.0), 1e-3);
    assert!((end.yaw / (25.0 / (2.0 * rate)) - 1.0).abs() < 0.005, "{end:?}");
    assert!(end.position.norm() < 1e-9, "{end:?}");
}

#[test]
fn translation_and_spin_end_in_the_same_step() {
    let (slider, dt) = (slider(Support::Corners), 1e-3);
    let weight = Wrench::weight(MASS, -Vector3::z() * GRAVITY);
    for (velocity, spin) in [(0.6, 6.0), (0.1, 8.0), (0.5, 0.3)] {
        let mut state = moving(Vector2::x() * velocity, spin);
        let mut before = state;
        while slider.step(&mut state, &weight, &Coulomb(MU), dt) != Ending::Rests {
            before = state;
        }
        assert_eq!((state.velocity, state.yaw_rate), (Vector2::zeros(), 0.0));
        assert!(
            before.velocity.norm() > 1e-6 && before.yaw_rate.abs() > 1e-6,
            "one of the two stopped early: {before:?}"
        );
    }
}

#[test]
fn travel_does_not_depend_on_where_the_body_stands_or_faces() {
    let slider = slider(Support::Corners);
    let plain = to_rest(&slider, moving(Vector2::x() * 0.6, 6.0), 1e-3);
    let (sin, cos) = 2.0_f64.sin_cos();
    let turn = |v: Vector2<f64>| Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
    let start =
        PlanarState { position: Vector2::new(0.5, -0.2), yaw: 2.0, velocity: turn(Vector2::x() * 0.6), yaw_rate: 6.0 };
    let turned = to_rest(&slider, start, 1e-3);
    assert!((turned.position - start.position - turn(plain.position)).norm() < 1e-9);
    assert!((turned.yaw - 2.0 - plain.yaw).abs() < 1e-9);
}
