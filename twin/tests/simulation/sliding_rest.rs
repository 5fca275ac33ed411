//! Rest, the limit of friction, tipping, and the way to a free body and back.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector2, Vector3};
use shared_mem::cell::Support;
use twin::sliding::{
    Closeness, Coulomb, Ending, Footing, FreeBody, Patch, PlanarState, Slider, SlidingFriction, Solid, Wrench,
};

const MASS: f64 = 0.3;
const MU: f64 = 0.3;
const GRAVITY: f64 = 9.81;
const SUPPORTS: [Support; 3] = [Support::Corners, Support::Uniform, Support::Ring];

fn slider(support: Support) -> Slider {
    Slider {
        mass: MASS,
        yaw_inertia: MASS / 12.0 * (0.08 * 0.08 + 0.06 * 0.06),
        height: 0.05,
        patch: Patch::rectangle([0.08, 0.06], Vector2::new(0.004, -0.003), support).expect("a rectangle"),
    }
}

fn weight() -> Wrench {
    Wrench::weight(MASS, -Vector3::z() * GRAVITY)
}

#[test]
fn a_body_pushed_below_the_limit_of_friction_does_not_move_at_all() {
    let limit = MU * MASS * GRAVITY;
    for support in SUPPORTS {
        let (slider, start) = (slider(support), PlanarState::at_rest(Vector2::new(0.4, 0.1), 0.7));
        let mut state = start;
        for push in [Vector3::x(), -Vector3::y(), Vector3::new(0.6, 0.8, 0.0)] {
            // At the table's height, through the centre of mass: nothing but friction answers.
            let wrench = weight().with_force(push * (0.999 * limit), Vector3::new(0.0, 0.0, -0.05));
            for _ in 0..500 {
                assert_eq!(slider.step(&mut state, &wrench, &Coulomb(MU), 1e-3), Ending::Rests, "{support:?} {push:?}");
            }
            assert_eq!(state, start, "{support:?}");
            let mut pushed = state;
            let wrench = weight().with_force(push * (1.001 * limit), Vector3::new(0.0, 0.0, -0.05));
            assert_eq!(slider.step(&mut pushed, &wrench, &Coulomb(MU), 1e-3), Ending::Slides, "{support:?} {push:?}");
        }
    }
}

#[test]
fn an_off_centre_push_below_the_limit_is_held_and_above_it_turns_the_body() {
    let slider = slider(Support::Corners);
    let push = |force: f64| weight().with_force(Vector3::y() * force, Vector3::new(0.03, 0.0, -0.05));
    let mut state = PlanarState::at_rest(Vector2::zeros(), 0.0);
    let start = state;
    let (mut held, mut moved) = (0.0, MU * MASS * GRAVITY);
    // The force at which it gives way, by bisection: less than through the middle, more than the moment alone allows.
    for _ in 0..40 {
        let middle = 0.5 * (held + moved);
        state = start;
        match slider.step(&mut state, &push(middle), &Coulomb(MU), 1e-3) {
            Ending::Rests => held = middle,
            _ => moved = middle,
        }
    }
    assert!(held > 0.6 * MU * MASS * GRAVITY && held < 0.99 * MU * MASS * GRAVITY, "{held}");
    state = start;
    for _ in 0..200 {
        slider.step(&mut state, &push(0.999 * held), &Coulomb(MU), 1e-3);
    }
    assert_eq!(state, start);
}

#[test]
fn a_block_on_a_slowly_tilting_plate_slips_at_the_friction_angle() {
    for (support, mu) in [(Support::Corners, 0.2), (Support::Uniform, 0.3), (Support::Ring, 0.45)] {
        let slider = slider(support);
        let mut state = PlanarState::at_rest(Vector2::zeros(), 0.3);
        let mut angle: f64 = 0.0;
        while state.is_at_rest() {
            angle += 1e-5;
            let gravity = Vector3::new(angle.sin(), 0.0, -angle.cos()) * GRAVITY;
            slider.step(&mut state, &Wrench::weight(MASS, gravity), &Coulomb(mu), 1e-3);
            assert!(angle < 1.0, "{support:?} never slips");
        }
        assert!((angle / mu.atan() - 1.0).abs() < 0.001, "{support:?}: slips at {angle} instead of {}", mu.atan());
    }
}

#[test]
fn a_push_above_the_edge_of_balance_is_handed_over_and_one_below_is_not() {
    // About the leading edge at 0.04 m: the push at 0.09 m over the table balances m g 0.04 at force m g 0.04 / 0.09.
    let slider = Slider {
        patch: Patch::rectangle([0.08, 0.06], Vector2::zeros(), Support::Corners).expect("area"),
        ..slider(Support::Corners)
    };
    let balance = MASS * GRAVITY * 0.04 / 0.09;
    for (factor, lifts) in [(0.98, false), (1.02, true)] {
        let wrench = weight().with_force(Vector3::x() * (balance * factor), Vector3::new(0.0, 0.0, 0.04));
        let mut state = PlanarState::at_rest(Vector2::zeros(), 0.0);
        let ending = slider.step(&mut state, &wrench, &Coulomb(2.0), 1e-3);
        assert_eq!(matches!(ending, Ending::Lifts { .. }), lifts, "{factor}: {ending:?}");
    }
}

#[test]
fn a_body_that_would_trip_over_its_leading_edge_is_handed_over() {
    // Braking force at the table tips over the edge when mu exceeds half length over height: 0.04 / 0.05.
    let level = Slider {
        patch: Patch::rectangle([0.08, 0.06], Vector2::zeros(), Support::Corners).expect("area"),
        ..slider(Support::Corners)
    };
    for (mu, lifts) in [(0.78, false), (0.82, true)] {
        let mut state = PlanarState { velocity: Vector2::x() * 0.5, ..PlanarState::at_rest(Vector2::zeros(), 0.0) };
        let ending = level.step(&mut state, &weight(), &Coulomb(mu), 1e-3);
        assert_eq!(matches!(ending, Ending::Lifts { .. }), lifts, "{mu}: {ending:?}");
    }
}

#[test]
fn a_pull_upwards_takes_the_body_off_the_table() {
    let slider = slider(Support::Uniform);
    let mut state = PlanarState::at_rest(Vector2::zeros(), 0.0);
    let wrench = weight().with_force(Vector3::z() * (1.01 * MASS * GRAVITY), Vector3::zeros());
    assert_eq!(slider.step(&mut state, &wrench, &Coulomb(MU), 1e-3), Ending::Lifts { left: 1e-3 });
}

#[test]
fn no_motion_gains_energy_whatever_the_table_is_made_of() {
    #[derive(Clone, Copy, PartialEq)]
    struct Rough;
    impl SlidingFriction for Rough {
        fn mu(&self, point: Vector2<f64>, velocity: Vector2<f64>) -> f64 {
            let seam = if point.x > 0.02 { 0.5 } else { 0.2 };
            seam + 0.1 * (-velocity.norm() / 0.05).exp() + 0.05 * (3.0 * velocity.y.atan2(velocity.x)).sin().abs()
        }
    }
    for support in SUPPORTS {
        let slider = Slider { height: 0.03, ..slider(support) };
        for i in 0..40 {
            let angle = 0.157 * f64::from(i);
            let velocity = Vector2::new(angle.cos(), angle.sin()) * (0.02 * f64::from(i));
            let mut state = PlanarState {
                velocity,
                yaw_rate: 0.4 * f64::from(20 - i),
                ..PlanarState::at_rest(Vector2::zeros(), angle)
            };
            for _ in 0..1000 {
                let energy = slider.kinetic_energy(&state);
                let ending = slider.step(&mut state, &weight(), &Rough, 1e-3);
                assert!(slider.kinetic_energy(&state) <= energy, "{support:?} {i}: {state:?}");
                assert!(!matches!(ending, Ending::Lifts { .. }));
            }
            assert!(state.is_at_rest(), "{support:?} {i}: {state:?}");
        }
    }
}

const CORNERS: [Point3<f64>; 8] = {
    const fn p(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(0.04 * x, 0.03 * y, 0.05 * z)
    }
    [
        p(-1.0, -1.0, -1.0),
        p(1.0, -1.0, -1.0),
        p(-1.0, 1.0, -1.0),
        p(1.0, 1.0, -1.0),
        p(-1.0, -1.0, 1.0),
        p(1.0, -1.0, 1.0),
        p(-1.0, 1.0, 1.0),
        p(1.0, 1.0, 1.0),
    ]
};

fn solid() -> Solid<'static> {
    Solid {
        corners: &CORNERS,
        centre_of_mass: Vector3::new(-0.007, 0.001, -0.006),
        mass: MASS,
        inertia: Matrix3::from_diagonal(&Vector3::new(3.4e-4, 4.1e-4, 2.5e-4)),
        support: Support::Corners,
        pressure_reach: 1.0,
    }
}

#[test]
fn a_standing_body_comes_back_from_a_free_one_unchanged() {
    // Lying on its side: object y up, so the yaw inertia is the one about y and the height is half the y edge plus the offset.
    let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let footing = Footing::on(&solid(), upright, 0.2).expect("a face below");
    assert!((footing.slider.yaw_inertia - 4.1e-4).abs() < 1e-12 && (footing.slider.height - 0.031).abs() < 1e-12);
    let state =
        PlanarState { position: Vector2::new(0.5, 0.1), yaw: 0.9, velocity: Vector2::new(0.2, -0.1), yaw_rate: 1.5 };
    let free = footing.release(&state);
    let (again, found) = Footing::find(&solid(), &free, 0.2, Closeness::FLAT).expect("it stands");
    let back = again.release(&found);
    assert!((back.centre - free.centre).norm() < 1e-12 && back.rotation.angle_to(&free.rotation) < 1e-7);
    assert!(
        (back.velocity - free.velocity).norm() < 1e-12
            && (back.angular_velocity - free.angular_velocity).norm() < 1e-12
    );
    assert!((again.slider.height - footing.slider.height).abs() < 1e-9);
}

#[test]
fn a_body_that_leans_hovers_or_sinks_does_not_stand() {
    let footing = Footing::on(&solid(), UnitQuaternion::identity(), 0.0).expect("a face below");
    let standing = footing.release(&PlanarState::at_rest(Vector2::zeros(), 0.4));
    assert!(Footing::find(&solid(), &standing, 0.0, Closeness::FLAT).is_some());
    let lean = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.01);
    let others = [
        FreeBody { rotation: lean * standing.rotation, ..standing },
        FreeBody { centre: standing.centre + Vector3::z() * 1e-3, ..standing },
        FreeBody { velocity: -Vector3::z() * 0.05, ..standing },
        FreeBody { angular_velocity: Vector3::x() * 0.5, ..standing },
    ];
    for (i, body) in others.iter().enumerate() {
        assert!(Footing::find(&solid(), body, 0.0, Closeness::LANDED).is_none(), "case {i}");
    }
}

#[test]
fn a_body_whose_centre_of_mass_is_not_over_its_base_has_no_footing() {
    let solid = Solid { centre_of_mass: Vector3::new(0.05, 0.0, 0.0), ..solid() };
    assert!(Footing::on(&solid, UnitQuaternion::identity(), 0.0).is_none());
}
