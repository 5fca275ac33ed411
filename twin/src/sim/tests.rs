//! Behaviour of the whole simulated cell.
#![allow(non_snake_case)]

use super::*;
use crate::arm::{ControlLaw, JointState, PointForce};
use crate::shipped::shipped_exact;
use nalgebra::UnitQuaternion;
use shared_mem::time::TICK;

/// The shipped cell with the table lifted to 30 mm under the tip and the box 20 mm beside it, so that turning joint 1
/// strikes it.
fn striking() -> Cell {
    let mut cell = shipped_exact();
    let arm = ArmModel::from_cell(&cell).expect("an FR3");
    let tip = arm.tip(arm.ready()).position();
    cell.table = Some(shared_mem::cell::Table { height: tip[2] - 0.03 });
    cell.simulation.object_position = [tip[0], tip[1] + 0.062];
    cell
}

/// Turns joint 1 to 0.6 rad with a smooth start and end within a second, then holds; `each` sees the cell after every period.
fn strike(cell: &mut SimCell, periods: u64, mut each: impl FnMut(&mut SimCell)) {
    let start = cell.q();
    for k in 0..periods {
        let (share, rate) = smooth(k as f64 * TICK);
        let (mut q_d, mut dq_d) = (start, [0.0; 8]);
        q_d[0] += 0.6 * share;
        dq_d[0] = 0.6 * rate;
        cell.step(&Drive::JointImpedance { q_d, dq_d });
        each(cell);
    }
}

/// From 0 to 1 in a second: position and rate of a quintic.
fn smooth(t: f64) -> (f64, f64) {
    let t = t.min(1.0);
    (t * t * t * (10.0 - 15.0 * t + 6.0 * t * t), 30.0 * t * t * (1.0 - t) * (1.0 - t))
}

fn object_position(cell: &SimCell) -> Vector3<f64> {
    Vector3::from(cell.object().expect("a box").position())
}

#[test]
fn a_gap_that_is_wide_need_not_be_looked_at_in_every_period() {
    let run = |again: bool| {
        let mut cell = SimCell::new(&striking(), None).expect("a cell");
        let mut near = 0;
        strike(&mut cell, 1500, |cell| {
            near += u32::from(cell.may_touch());
            if again {
                cell.contact.look_again();
            }
        });
        (cell.q(), object_position(&cell), cell.first_contact_ns(), cell.last_contact_ns(), near)
    };
    let (seldom, always) = (run(false), run(true));
    assert!(always.2.is_some() && always.4 < 1500);
    assert_eq!(seldom, always);
}

#[test]
fn an_arm_that_is_told_to_stay_stays() {
    let mut cell = SimCell::new(&shipped_exact(), None).expect("a cell");
    let (q_d, dq_d) = (cell.q(), [0.0; 8]);
    for _ in 0..1000 {
        cell.step(&Drive::JointImpedance { q_d, dq_d });
    }
    for (q, q_d) in cell.q().iter().zip(&q_d) {
        assert!((q - q_d).abs() < 1e-9);
    }
    assert_eq!(cell.time_ns(), 1_000_000_000);
}

#[test]
fn the_client_s_torque_and_the_robot_s_own_controller_move_the_arm_alike() {
    let description = shipped_exact();
    let mut inside = SimCell::new(&description, None).expect("a cell");
    let mut outside = SimCell::new(&description, None).expect("a cell");
    let model = ArmModel::from_cell(&description).expect("an FR3");
    let law = ControlLaw::new(description.controller.as_ref(), None, &model).expect("gains");
    let start = inside.q();
    for k in 0..1000 {
        let (share, rate) = smooth(f64::from(k) * TICK);
        let q_d = std::array::from_fn(|i| start[i] + if i < 7 { 0.2 * share } else { 0.0 });
        let dq_d = std::array::from_fn(|i| if i < 7 { 0.2 * rate } else { 0.0 });
        inside.step(&Drive::JointImpedance { q_d, dq_d });
        let state = JointState { q: outside.q(), dq: outside.dq() };
        let (tau, gravity) = (law.torque(&model, &state, &q_d, &dq_d), model.gravity(&state.q));
        outside.step(&Drive::Torque { tau_J_d: std::array::from_fn(|i| tau[i] - gravity[i]) });
    }
    for (a, b) in inside.q().iter().zip(&outside.q()) {
        assert!((a - b).abs() < 1e-10, "{a} and {b}");
    }
}

#[test]
fn a_struck_box_moves_and_the_arm_feels_it() {
    let description = striking();
    let mut cell = SimCell::new(&description, None).expect("a cell");
    let mut free = SimCell::new(&Cell { objects: Vec::new(), ..description }, None).expect("a cell");
    let mut undisturbed = Vec::new();
    strike(&mut free, 1500, |cell| undisturbed.push(cell.q()[0]));
    let before = object_position(&cell);
    let mut state = ArmState::default();
    let (mut period, mut peak, mut felt, mut lag) = (0, 0.0f64, 0.0f64, 0.0f64);
    strike(&mut cell, 1500, |cell| {
        cell.read(&mut state);
        peak = peak.max(cell.contact_force());
        felt = felt.min(state.tau_ext[0]);
        lag = lag.max(undisturbed[period] - cell.q()[0]);
        period += 1;
    });
    let moved = object_position(&cell) - before;
    assert!(moved.y > 0.1, "pushed along the stroke: {moved}");
    assert!(moved.z.abs() < 0.002, "it stays on the table: {moved}");
    assert!(peak > 5.0, "{peak} N");
    // The stroke turns joint 1 forwards, about 0.3 m from the tip: the box pushes back.
    assert!(felt < -0.2 * peak && felt > -0.5 * peak, "{felt} N m from {peak} N");
    assert!(lag > 1e-4, "the box held the arm back by {lag} rad");
    assert!(cell.first_contact_ns().is_some_and(|t| (100_000_000..600_000_000).contains(&t)));
}

#[test]
fn a_finer_step_changes_the_hit_by_less_than_two_per_cent() {
    let description = striking();
    let speeds = [1, 2].map(|finer| {
        let mut cell = SimCell::new(&description, None).expect("a cell");
        cell.refine(finer);
        let mut top = 0.0f64;
        strike(&mut cell, 700, |cell| {
            top = top.max(cell.object_velocity().expect("a box").0.norm());
        });
        (top, object_position(&cell))
    });
    let change = (speeds[0].0 / speeds[1].0 - 1.0).abs();
    assert!(speeds[0].0 > 0.2, "{} m/s", speeds[0].0);
    assert!(change < 0.02, "{change}");
    let shift = (speeds[0].1 - speeds[1].1).norm();
    assert!(shift < 0.003, "{shift} m");
}

#[test]
fn a_cell_integrated_in_more_steps_is_the_same_cell_by_another_rule() {
    let description = striking();
    let [(q, place), (finer_q, finer_place)] = [1, 3].map(|parts| {
        let mut cell = SimCell::new(&description, None).expect("a cell");
        cell.refine(parts);
        strike(&mut cell, 700, |_| ());
        (cell.q(), object_position(&cell))
    });
    let apart = q.iter().zip(&finer_q).map(|(q, finer)| (q - finer).abs()).fold(0.0, f64::max);
    assert!((1e-12..2e-4).contains(&apart), "{apart} rad");
    assert!((place - finer_place).norm() < 0.003, "{} m", (place - finer_place).norm());
}

#[test]
fn a_hidden_gain_changes_the_motion_and_an_unknown_effect_is_refused() {
    let description = shipped_exact();
    let controller = description.controller.clone().expect("gains");
    let theta = Theta {
        arm: Some(shared_mem::theta::ArmTheta {
            stiffness: controller.stiffness.iter().map(|k| 0.8 * k).collect(),
            damping: controller.damping,
        }),
        ..Theta::default()
    };
    let [nominal, hidden] = [None, Some(&theta)].map(|theta| {
        let mut cell = SimCell::new(&description, theta).expect("a cell");
        strike(&mut cell, 500, |_| {});
        cell.q()[0]
    });
    assert!((nominal - hidden).abs() > 1e-4);
    let effect = shared_mem::theta::EffectTheta { name: "joint_backlash".into(), parameters: Default::default() };
    let error = SimCell::new(&description, Some(&Theta { effects: vec![effect], ..Theta::default() })).err();
    assert!(error.is_some_and(|e| e.to_string().contains("joint_backlash")));
}

#[test]
fn an_object_without_a_table_is_refused_with_the_remedy() {
    let error = SimCell::new(&Cell { table: None, ..shipped_exact() }, None).err().expect("refused").to_string();
    assert!(error.contains("[table]"), "{error}");
}

#[test]
fn the_report_is_the_state_with_noise_and_gravity_where_they_belong() {
    let mut description = shipped_exact();
    description.simulation.q_noise = 1e-5;
    let mut cell = SimCell::new(&description, None).expect("a cell");
    let (q_d, dq_d) = (cell.q(), [0.0; 8]);
    cell.step(&Drive::JointImpedance { q_d, dq_d });
    let mut state = ArmState::default();
    cell.read(&mut state);
    assert_eq!((state.device_ns, state.dof), (1_000_000, 7));
    assert!(state.q != cell.q(), "noise");
    let model = cell.arm_model().expect("an arm");
    let gravity = model.gravity(&cell.q());
    for ((tau_J, tau_J_d), gravity) in state.tau_J.iter().zip(&state.tau_J_d).zip(&gravity) {
        assert!((tau_J - gravity).abs() < 1e-6, "at rest the sensor carries the arm's weight");
        assert!(tau_J_d.abs() < 1e-6, "and the controller asks for nothing beyond it");
    }
    assert!((state.O_T_EE[12] - model.flange(&state.q).position()[0]).abs() < 1e-12);
}

#[test]
fn a_tossed_object_needs_no_robot() {
    let mut description = shipped_exact();
    (description.robot, description.controller, description.tool) = (None, None, None);
    let mut cell = SimCell::new(&description, None).expect("a cell");
    let start = Isometry3::new(Vector3::new(0.0, 0.0, 0.4), Vector3::new(0.3, 0.8, 0.1));
    cell.set_object(&Pose::from_isometry(start), Vector3::new(0.8, 0.0, 0.5), Vector3::new(2.0, 5.0, -3.0));
    let drive = Drive::Torque { tau_J_d: [0.0; 8] };
    for _ in 0..3000 {
        cell.step(&drive);
    }
    let (velocity, spin) = cell.object_velocity().expect("a box");
    assert!(velocity.norm() < 1e-3 && spin.norm() < 1e-2, "at rest after 3 s: {velocity} {spin}");
    let height = object_position(&cell).z;
    assert!([0.03, 0.04, 0.05].iter().any(|h| (height - h).abs() < 2e-4), "on one of its faces: {height}");
}

#[test]
fn a_solid_table_carries_what_presses_on_it_and_is_not_there_unless_asked_for() {
    let description = Cell { objects: Vec::new(), ..shipped_exact() };
    let pressed = |solid: bool| {
        let mut cell = SimCell::new(&description, None).expect("a cell");
        if solid {
            cell.make_table_solid(&description);
        }
        let model = cell.arm_model().expect("an FR3").clone();
        let (mut q_d, mut state) = (cell.q(), ArmState::default());
        // Down with shoulder and wrist, the tool upright, until its tip would be well below the table.
        for _ in 0..2500 {
            (q_d[1], q_d[5]) = (q_d[1] + 5e-4, q_d[5] + 5e-4);
            cell.step(&Drive::JointImpedance { q_d, dq_d: [0.0; 8] });
        }
        for _ in 0..1000 {
            cell.step(&Drive::JointImpedance { q_d, dq_d: [0.0; 8] });
        }
        cell.read(&mut state);
        let (wanted, is) = (model.tip(&q_d).position()[2], model.tip(&cell.q()).position()[2]);
        assert!(wanted < -0.02, "{wanted} m");
        // The torque from outside is that of an upward force on the tip.
        let lift =
            model.torque_of(&cell.q(), &PointForce { point: model.tip(&cell.q()).position(), force: [0.0, 0.0, 1.0] });
        (is, state.tau_ext[1] / lift[1], wanted)
    };
    let (height, force, _) = pressed(true);
    assert!(height > -0.004 && height < 0.001, "{height} m");
    // A millimetre of the table's stiffness is 30 N.
    assert!((force + 3e4 * height).abs() < 0.1 * force, "{force} N at {height} m");
    let (height, force, wanted) = pressed(false);
    assert!((height - wanted).abs() < 1e-3 && force == 0.0, "{height} m");
}

#[test]
fn a_right_angled_wedge_stands_though_the_middle_of_its_bounding_box_is_above_its_edge() {
    let folder = tempfile::tempdir().expect("a folder");
    let triangle = |z: f64| [[0.0, 0.0, z], [0.15, 0.0, z], [0.0, 0.15, z]];
    let corners: String =
        triangle(0.0).iter().chain(&triangle(0.04)).map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let faces = "f 1 3 2\nf 4 5 6\nf 1 2 5 4\nf 2 3 6 5\nf 3 1 4 6\n";
    std::fs::write(folder.path().join("wedge.obj"), corners + faces).expect("a mesh");
    let mut cell = shipped_exact();
    (cell.robot, cell.controller, cell.tool) = (None, None, None);
    cell.folder = folder.path().into();
    let wedge = shared_mem::cell::Object { mesh: Some("wedge.obj".into()), mass: Some(1.5), ..Default::default() };
    cell.objects = vec![wedge];
    let mut cell = SimCell::new(&cell, None).expect("a wedge");
    let start = cell.object().expect("a wedge");
    // Who leans by a thousandth falls back onto the base, and not over the edge.
    let lean = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1e-3);
    let leaning = Isometry3::from_parts(start.isometry().translation, lean * start.isometry().rotation);
    cell.set_object(&Pose::from_isometry(leaning), Vector3::zeros(), Vector3::zeros());
    for _ in 0..2000 {
        cell.step(&Drive::Torque { tau_J_d: [0.0; 8] });
    }
    let end = cell.object().expect("a wedge").isometry();
    let up = end.rotation * Vector3::z();
    assert!(up.z > 1.0 - 1e-6 && (end.translation.z - start.isometry().translation.z).abs() < 1e-4, "{end}");
}
