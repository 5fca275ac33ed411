//! The world against closed forms.

use super::*;
use nalgebra::{Unit, UnitQuaternion};
use std::f64::consts::PI;

fn block(name: &str, size: [f64; 3], mass: f64, hold: Hold) -> BodyPlan {
    let piece = Piece::new(box_hull(size).expect("a box"), Isometry3::identity());
    BodyPlan::homogeneous(name, vec![piece], mass, hold)
}

fn table(friction: f64) -> BodyPlan {
    let at = Isometry3::translation(0.0, 0.0, -0.05);
    block("table", [2.0, 2.0, 0.1], 0.0, Hold::Fixed(at)).with_friction(friction)
}

fn free(x: f64, y: f64, z: f64) -> Hold {
    Hold::Free(Isometry3::translation(x, y, z))
}

fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds / STEP).round() as usize {
        world.step();
    }
}

#[test]
fn a_body_falls_as_galilei_says_and_rests_where_it_lands() {
    let bodies = [table(0.3), block("box", [0.08, 0.06, 0.1], 0.3, free(0.0, 0.0, 0.5))];
    let mut world = World::new(&bodies).expect("a world");
    run(&mut world, 0.2);
    assert!((world.pose(1).translation.z - (0.5 - 0.5 * 9.81 * 0.04)).abs() < 1e-9);
    run(&mut world, 1.0);
    let rests = world.pose(1);
    assert!((rests.translation.z - 0.05).abs() < 5e-6, "{}", rests.translation.z);
    run(&mut world, 10.0);
    let crept = (world.pose(1).translation.vector - rests.translation.vector).norm();
    assert!(crept < 1e-9 && world.speed(1) < 1e-9, "{crept} {}", world.speed(1));
}

#[test]
fn a_box_slides_as_far_as_coulomb_says() {
    for (mu, speed) in [(0.2, 0.4), (0.3, 0.6), (0.6, 0.8)] {
        let mut world =
            World::new(&[table(mu), block("box", [0.1, 0.08, 0.04], 0.3, free(0.0, 0.0, 0.02))]).expect("a world");
        world.trees.set_twist(1, &Vector3::new(speed, 0.0, 0.0), &Vector3::zeros());
        run(&mut world, 1.0);
        let (found, asked) = (world.pose(1).translation.x, speed * speed / (2.0 * mu * 9.81));
        assert!((found / asked - 1.0).abs() < 2e-3, "{mu}: {found} instead of {asked}");
        assert!(world.speed(1) < 1e-9 && world.pose(1).translation.y.abs() < 1e-9);
    }
}

/// Travel and yaw of a spinning box on its four corners: the twin's sliding law, by its own code.
#[test]
fn a_spinning_box_slides_and_turns_as_the_sliding_law_says() {
    use crate::physics::test_box::{box_model, nominal};
    use shared_mem::frames::Pose;
    let (velocity, spin) = (Vector3::new(0.6, 0.0, 0.0), Vector3::new(0.0, 0.0, 6.0));
    let mut law = nominal(&box_model(), Some(0.0));
    law.set(&Pose::from_isometry(Isometry3::translation(0.0, 0.0, 0.05)), velocity, spin);
    let bodies = [table(0.3), block("box", [0.08, 0.06, 0.1], 0.3, free(0.0, 0.0, 0.05))];
    let mut world = World::new(&bodies).expect("a world");
    world.trees.set_twist(1, &velocity, &spin);
    for _ in 0..1000 {
        law.step(STEP, &[]);
        world.step();
    }
    let (found, asked) = (world.pose(1), law.pose().isometry());
    let yaw = |pose: &Isometry3<f64>| pose.rotation.euler_angles().2;
    let travel = (found.translation.vector - asked.translation.vector).norm();
    assert!(travel < 3e-4, "{travel} of {}", asked.translation.x);
    assert!((yaw(&found) / yaw(&asked) - 1.0).abs() < 0.01, "{} instead of {}", yaw(&found), yaw(&asked));
}

#[test]
fn a_box_on_an_incline_holds_below_the_angle_of_friction_and_slips_above() {
    let slope = |angle: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        let at = |height: f64| Isometry3::from_parts((turn * Vector3::z() * height).into(), turn);
        let bodies = [
            block("slope", [2.0, 1.0, 0.1], 0.0, Hold::Fixed(at(-0.05))).with_friction(0.5),
            block("box", [0.08, 0.06, 0.04], 0.3, Hold::Free(at(0.02))),
        ];
        let mut world = World::new(&bodies).expect("a world");
        run(&mut world, 2.0);
        (world.pose(1).translation.vector - at(0.02).translation.vector).norm()
    };
    let limit = 0.5_f64.atan();
    assert!(slope(limit - 0.002) < 1e-6, "{}", slope(limit - 0.002));
    let (angle, t) = (limit + 0.02, 2.0);
    let asked = 0.5 * 9.81 * (angle.sin() - 0.5 * angle.cos()) * t * t;
    assert!((slope(angle) / asked - 1.0).abs() < 0.02, "{} {asked}", slope(angle));
}

/// Two boxes on a table, each moved and weighted off its middle, in forty ways near and far from toppling.
#[test]
fn forty_stacks_of_boxes_with_shifted_centres_of_mass_stand_or_fall_as_statics_says() {
    let (size, mut stood) = ([0.06, 0.06, 0.06], 0);
    for i in 0..40 {
        // Centres of mass by 5, 10 or 15 mm, the upper box by up to 30 mm, in directions around the compass.
        let shift = [0.005, 0.010, 0.015][i % 3];
        let reach = 0.002 + 0.0286 * ((i * 17 % 40) as f64 / 39.0);
        let (sin, cos) = (i as f64 * 0.7).sin_cos();
        let (aside, across) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        let offset = aside * reach;
        let heavy = [across * shift, aside * shift];
        let mut bodies = vec![table(0.8)];
        for (k, at) in [Vector3::new(0.0, 0.0, 0.03), offset + Vector3::new(0.0, 0.0, 0.09)].into_iter().enumerate() {
            let body = block("box", size, 0.2, free(at.x, at.y, at.z)).with_friction(0.8);
            bodies.push(BodyPlan { centre_of_mass: heavy[k], ..body });
        }
        // Statics: the upper weight acts inside the overlap of the two, both together inside the lower base.
        let upper = offset + heavy[1];
        let both = (upper + heavy[0]) * 0.5;
        let margin = (0..2).map(|k| 0.03 - upper[k].abs().max(both[k].abs())).fold(f64::INFINITY, f64::min);
        if margin.abs() < 2e-4 {
            continue;
        }
        let mut world = World::new(&bodies).expect("a world");
        run(&mut world, 2.0);
        let stands = (world.pose(2).translation.z - 0.09).abs() < 1e-3;
        assert_eq!(stands, margin > 0.0, "stack {i}: margin {margin}, {}", world.pose(2));
        if stands {
            let moved = (world.pose(2).translation.vector - offset - Vector3::z() * 0.09).norm();
            assert!(moved < 1e-6, "stack {i} creeps {moved}");
        }
        stood += usize::from(stands);
    }
    assert!((10..=30).contains(&stood), "{stood} of 40 stand");
}

/// A hand that nothing moves, two fingers geared together, and a box between their pads.
fn held_box(force: f64, friction: f64) -> World {
    let finger = |name: &str, side: f64, follows: Option<(usize, f64)>| {
        let joint = JointPlan {
            parent: Some(0),
            at: Isometry3::translation(0.0, 0.0, 0.0),
            kind: JointKind::Prismatic,
            axis: Vector3::x_axis(),
            limits: [-0.05, 0.05],
            start: 0.0,
            friction: 0.0,
            damping: 0.0,
            drive: follows.is_none().then_some(Drive { target: 0.04, speed: 0.1, force }),
            follows,
        };
        let piece = Piece::new(
            cylinder_hull(0.01, 0.01).expect("a pad"),
            Isometry3::from_parts(
                Vector3::new(-side * 0.035, 0.0, 0.0).into(),
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5 * PI),
            ),
        );
        let plan = BodyPlan::homogeneous(name, vec![piece], 0.1, Hold::Joint(joint));
        BodyPlan { pad_radius: 0.01, ..plan }.with_friction(friction)
    };
    let palm = BodyPlan { pieces: vec![], ..block("palm", [0.1; 3], 1.0, Hold::Moved(Isometry3::identity())) };
    let bodies = [
        palm,
        finger("left", 1.0, None),
        finger("right", -1.0, Some((1, -1.0))),
        block("box", [0.06, 0.06, 0.1], 0.2, free(0.0, 0.0, -0.02)),
    ];
    World::new(&bodies).expect("a world")
}

#[test]
fn a_held_box_does_not_creep() {
    let mut world = held_box(40.0, 0.6);
    run(&mut world, 0.1);
    let before = world.pose(3);
    run(&mut world, 30.0);
    let after = world.pose(3);
    let drift = (after.translation.vector - before.translation.vector).norm();
    let turn = (after.rotation * before.rotation.inverse()).angle();
    assert!(drift < 1e-6 && turn < 1e-6, "{drift} m, {turn} rad");
    assert!((before.translation.z + 0.02).abs() < 2e-4, "{before}");
}

#[test]
fn a_held_box_slips_where_the_pads_carry_less_than_its_weight() {
    // Each of the geared fingers presses with half of the drive's force, and slides along one side of the box.
    let limit = 0.2 * 9.81 / 0.6;
    for (share, holds) in [(0.98, false), (1.02, true)] {
        let mut world = held_box(limit * share, 0.6);
        run(&mut world, 0.5);
        let fell = -0.02 - world.pose(3).translation.z;
        assert_eq!(fell < 5e-4, holds, "{share}: {fell} m");
    }
}

#[test]
fn a_held_box_goes_where_the_hand_goes() {
    let mut world = held_box(40.0, 0.6);
    run(&mut world, 0.2);
    let grip = world.pose(3);
    for i in 0..1000 {
        let share = 0.5 - 0.5 * (PI * f64::from(i + 1) / 1000.0).cos();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), share);
        world.move_to(0, &Isometry3::from_parts(Vector3::new(0.1 * share, 0.0, 0.2 * share).into(), turn));
        world.step();
    }
    let carried = world.pose(0).inv_mul(&world.pose(3));
    let off = (carried.translation.vector - grip.translation.vector).norm();
    assert!(off < 2e-4, "{off} m in the hand");
    assert!((world.pose(3).translation.z - 0.18).abs() < 1e-3, "{}", world.pose(3));
}

fn lid(friction: f64, damping: f64) -> (World, f64) {
    let size = [0.3, 0.2, 0.01];
    let joint = JointPlan {
        parent: None,
        at: Isometry3::identity(),
        kind: JointKind::Revolute,
        axis: Unit::new_normalize(-Vector3::y()),
        limits: [-0.2, 3.0],
        start: 1.2,
        friction,
        damping,
        drive: None,
        follows: None,
    };
    let piece = Piece::new(box_hull(size).expect("a lid"), Isometry3::translation(0.15, 0.0, 0.0));
    let lid = BodyPlan::homogeneous("lid", vec![piece], 0.4, Hold::Joint(joint));
    (World::new(&[lid]).expect("a world"), 0.4 * (0.3 * 0.3 + 0.01 * 0.01) / 12.0 + 0.4 * 0.15 * 0.15)
}

/// Angle of a lid that falls about its hinge, by Runge and Kutta's rule in steps of 0.02 ms.
fn fallen(inertia: f64, friction: f64, damping: f64, time: f64) -> f64 {
    let rate = |angle: f64, speed: f64| {
        (-0.4 * 9.81 * 0.15 * angle.cos() - friction * speed.signum() - damping * speed) / inertia
    };
    let (mut angle, mut speed, dt) = (1.2_f64, -1e-12_f64, 2e-5);
    for _ in 0..(time / dt).round() as usize {
        let (a, b) = (speed, rate(angle, speed));
        let (c, d) = (speed + 0.5 * dt * b, rate(angle + 0.5 * dt * a, speed + 0.5 * dt * b));
        let (e, f) = (speed + 0.5 * dt * d, rate(angle + 0.5 * dt * c, speed + 0.5 * dt * d));
        let (g, h) = (speed + dt * f, rate(angle + dt * e, speed + dt * f));
        angle += dt / 6.0 * (a + 2.0 * c + 2.0 * e + g);
        speed += dt / 6.0 * (b + 2.0 * d + 2.0 * f + h);
    }
    angle
}

#[test]
fn a_lid_falls_as_the_equation_of_motion_says() {
    for (friction, damping) in [(0.0, 0.0), (0.05, 0.0), (0.0, 0.03), (0.05, 0.03)] {
        let (mut world, inertia) = lid(friction, damping);
        for t in [0.1, 0.2, 0.3] {
            run(&mut world, 0.1);
            let (found, asked) = (world.joint(0).expect("a hinge"), fallen(inertia, friction, damping, t));
            assert!((found - asked).abs() < 1e-3 * (1.2 - asked), "{friction} {damping} at {t} s: {found} {asked}");
        }
        run(&mut world, 1.0);
        let rests = world.joint(0).expect("a hinge");
        assert!((rests + 0.2).abs() < 1e-3, "it lies on its limit: {rests}");
    }
}

#[test]
fn dry_friction_holds_a_lid_as_long_as_it_can() {
    let moment = 0.4 * 9.81 * 0.15 * 1.2_f64.cos();
    for (share, holds) in [(1.01, true), (0.99, false)] {
        let (mut world, _) = lid(moment * share, 0.0);
        run(&mut world, 1.0);
        let moved = 1.2 - world.joint(0).expect("a hinge");
        assert_eq!(moved < 1e-9, holds, "{share}: {moved}");
    }
}

#[test]
fn a_drawer_that_is_pushed_stops_as_coulomb_says() {
    let joint = JointPlan {
        parent: None,
        at: Isometry3::translation(0.0, 0.0, 0.2),
        kind: JointKind::Prismatic,
        axis: Vector3::x_axis(),
        limits: [0.0, 0.4],
        start: 0.3,
        friction: 1.2,
        damping: 0.0,
        drive: None,
        follows: None,
    };
    let case = block("case", [0.4, 0.3, 0.1], 0.0, Hold::Fixed(Isometry3::identity()));
    let drawer = JointPlan { parent: Some(0), ..joint };
    let bodies = [case, block("drawer", [0.4, 0.3, 0.1], 1.5, Hold::Joint(drawer))];
    let mut world = World::new(&bodies).expect("a world");
    world.trees.velocities[0] = -0.5;
    run(&mut world, 1.0);
    let (moved, asked) = (0.3 - world.joint(1).expect("a drawer"), 0.5 * 0.25 * 1.5 / 1.2);
    assert!((moved / asked - 1.0).abs() < 2e-3, "{moved} instead of {asked}");
    // Faster, it runs into its end and stays there.
    world.trees.velocities[0] = -3.0;
    run(&mut world, 1.0);
    assert!(world.joint(1).expect("a drawer").abs() < 1e-6);
}

#[test]
fn a_free_swing_keeps_its_energy_and_contacts_never_add_any() {
    let (mut world, about_hinge) = lid(0.0, 0.0);
    let swings = |world: &World| {
        let height = 0.15 * world.joint(0).expect("a hinge").sin();
        0.5 * about_hinge * world.trees.velocities[0].powi(2) + 0.4 * 9.81 * height
    };
    let before = swings(&world);
    run(&mut world, 0.2);
    assert!((swings(&world) - before).abs() < 1e-4 * 0.4 * 9.81 * 0.15, "{} {before}", swings(&world));
    let turn = UnitQuaternion::from_euler_angles(0.4, 0.9, 0.3);
    let at = Isometry3::from_parts(Vector3::new(0.0, 0.0, 0.3).into(), turn);
    let falls = block("box", [0.08, 0.06, 0.1], 0.3, Hold::Free(at));
    let energy_of = |world: &World| {
        let [velocity, spin] = world.trees.twist(1);
        let own = world.pose(1).rotation.inverse() * spin;
        0.5 * (0.3 * velocity.norm_squared() + own.dot(&(falls.inertia * own)))
            + 0.3 * 9.81 * world.pose(1).translation.z
    };
    let mut world = World::new(&[table(0.4), falls.clone()]).expect("a world");
    world.trees.set_twist(1, &Vector3::new(0.5, 0.2, 0.0), &Vector3::new(3.0, -2.0, 5.0));
    let mut energy = energy_of(&world);
    for i in 0..2000 {
        world.step();
        let now = energy_of(&world);
        assert!(now < energy + 2e-4, "step {i}: {energy} to {now}");
        energy = now;
    }
    assert!(world.speed(1) < 1e-6, "{}", world.speed(1));
}
