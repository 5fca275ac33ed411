//! Strokes of a known cell: a box that stands, is pushed by the shipped arm, and stands again, seen with noise and a known error.

use super::*;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::joints_from;
use shared_mem::recording::{JointSeries, ObjectSeries};
use shared_mem::toml_file;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use twin::arm::{ArmModel, Joints};
use twin::effects::{CameraMemory, Effects};

/// The tracker of the shipped cell, one sigma [m], [rad].
const NOISE: [f64; 2] = [7e-4, 5e-3];
/// Rows of the arm and of the tracker are so far apart [ns].
const ROW_NS: u64 = 1_000_000;
const POSE_NS: u64 = 16_666_667;
/// A stroke: it stands, is pushed, stands [s].
const STANDS: f64 = 0.5;
const PUSHED: f64 = 1.1;
const LASTS: f64 = 1.6;

fn theta(blocks: &str) -> Theta {
    toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml")
}

/// The shipped cell; its table is where a tool that points down from the ready arm meets the box in the middle of its height.
fn cell(arm: &ArmModel) -> Cell {
    let text = include_str!("../../../../config/fr3_cell.toml");
    let mut cell = Cell::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
    let tip = arm.flange(arm.ready()).isometry() * Point3::new(0.0, 0.0, 0.148);
    cell.table.as_mut().expect("a table").height = tip.z - 0.05;
    cell
}

/// How the tool pushes in a clip: heading [rad], speed [m/s], turn of the flange about the tool [rad], and where it begins.
struct Stroke {
    heading: f64,
    speed: f64,
    turn: f64,
    aside: [f64; 2],
}

fn strokes() -> Vec<Stroke> {
    let stroke = |k: usize| {
        let [a, b] = [k as f64 * 0.7, k as f64 * 1.9].map(f64::sin);
        let aside = [0.02 * a, 0.03 * b];
        Stroke {
            heading: FRAC_PI_2 * (k % 4) as f64 + 0.2 * a,
            speed: 0.15 + 0.02 * (k % 8) as f64,
            turn: 0.4 * b,
            aside,
        }
    };
    (0..12).map(stroke).collect()
}

/// A recorded stroke in a cell in which the effects of `hidden` act on camera and tool.
fn recorded(arm: &ArmModel, stroke: &Stroke, hidden: &Theta, rng: &mut Pcg64) -> Clip {
    let effects = Effects::from_theta(&hidden.effects, arm.dof()).expect("known effects");
    let offset = hidden.effects.iter().find_map(|effect| effect.numbers("offset")).unwrap_or_else(|| vec![0.0; 3]);
    let push = Vector3::new(stroke.heading.cos(), stroke.heading.sin(), 0.0);
    let mut q: Joints = *arm.ready();
    q[6] += stroke.turn;
    let moves = |q: &mut Joints, by: Vector3<f64>| {
        let at = arm.flange(q).isometry() * Point3::new(0.0, 0.0, 0.148);
        let step = arm.joints_for(q, at, &Vector6::new(by.x, by.y, by.z, 0.0, 0.0, 0.0));
        (0..7).for_each(|j| q[j] += step[j]);
    };
    for _ in 0..100 {
        moves(&mut q, Vector3::new(0.01 * stroke.aside[0], 0.01 * stroke.aside[1], 0.0));
    }
    let rows = (LASTS * 1e9) as u64 / ROW_NS;
    let mut measured = JointSeries { dof: 7, ..JointSeries::default() };
    for row in 0..rows {
        let t = (row * ROW_NS) as f64 * 1e-9;
        let begins = ((t - STANDS) / 0.02).clamp(0.0, 1.0);
        let ends = ((PUSHED - t) / 0.3).clamp(0.0, 1.0);
        measured.stamps_ns.push(row * ROW_NS);
        measured.q.extend(&q[..7]);
        moves(&mut q, push * (stroke.speed * begins * ends * 1e-3));
    }
    // The box is where the real tool's surface is, its face across the push.
    let box_at = |at_ns: u64| {
        let row = (at_ns / ROW_NS).min(rows - 1) as usize;
        let tip = arm.flange(&joints_from(measured.q_row(row))).isometry()
            * Point3::new(offset[0], offset[1], 0.148 + offset[2]);
        let centre = tip.coords + push * (0.012 + 0.04);
        let height = (arm.flange(arm.ready()).isometry() * Point3::new(0.0, 0.0, 0.148)).z;
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), stroke.heading);
        Isometry3::from_parts(Vector3::new(centre.x, centre.y, height).into(), yaw)
    };
    let mut object = ObjectSeries::default();
    let mut normal = |sigma: f64| sigma * (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>();
    for at_ns in (POSE_NS..rows * ROW_NS).step_by(POSE_NS as usize) {
        let was = box_at(at_ns.saturating_sub(effects.camera.latency_ns()));
        let mut seen = effects.camera.report(&mut CameraMemory::default(), at_ns, &was);
        seen.translation.vector += Vector3::from_fn(|_, _| normal(NOISE[0]));
        seen.rotation = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| normal(NOISE[1]))) * seen.rotation;
        object.stamps_ns.push(at_ns);
        object.poses.push(Pose::<Base, Object>::from_isometry(seen));
    }
    Clip {
        kind: ClipKind::ControlHitSlide,
        joint_names: arm.joint_names().to_vec(),
        desired: measured.clone(),
        measured,
        object,
        ..crate::admit::test_clip::of_one_joint(Vec::new(), |_| 0.0)
    }
}

/// What strokes with the hidden effects say beyond the known ones.
fn said(hidden: &str, known: &str) -> Vec<Witness> {
    let arm = ArmModel::fr3();
    let cell = cell(&arm);
    let arm = ArmModel::from_cell(&cell).expect("an arm");
    let mut rng = Pcg64::seed_from_u64(7);
    let clips: Vec<Clip> = strokes().iter().map(|stroke| recorded(&arm, stroke, &theta(hidden), &mut rng)).collect();
    beyond(&cell, &clips, &theta(known))
}

/// Asserts that the numbers of `expected` are significant and come out as they are, and that no other is.
fn assert_says(all: &[Witness], expected: &[(&str, f64)]) {
    let lines: Vec<String> =
        all.iter().map(|w| format!("{} {} {:.5} +- {:.5}", w.effect, w.number, w.value, w.error)).collect();
    for witness in all {
        let truth = expected.iter().find(|(number, _)| *number == witness.number);
        let value = truth.map_or(0.0, |(_, value)| *value);
        assert!((witness.value - value).abs() < SIGNIFICANT * witness.error, "{} {value}: {lines:#?}", witness.number);
        assert_eq!(witness.is_significant(), truth.is_some(), "{}: {lines:#?}", witness.number);
    }
    assert!(expected.iter().all(|(number, _)| all.iter().any(|witness| witness.number == *number)), "{lines:#?}");
}

const LATE: &str = "[[effect]]\nname = \"camera_latency\"\nlatency = 0.012\n";
const SHIFTED: &str = "[[effect]]\nname = \"camera_extrinsic_translation\"\ntranslation = [0.002, -0.003, 0.001]\n";
const TURNED: &str = "[[effect]]\nname = \"camera_extrinsic_rotation\"\nrotation = [0.004, -0.006, 0.0]\n";
const BESIDE: &str = "[[effect]]\nname = \"tool_offset\"\noffset = [0.002, -0.0015, 0.0]\n";

#[test]
fn a_cell_without_error_has_no_significant_witness_and_all_of_them() {
    let all = said("", "");
    assert_says(&all, &[]);
    let effects: Vec<&str> = all.iter().map(|witness| witness.effect).collect();
    for effect in ["camera_extrinsic_rotation", "camera_extrinsic_translation", "camera_scale", "camera_latency"] {
        assert!(effects.contains(&effect), "{effects:?}");
    }
    assert!(effects.iter().all(|name| twin::effects::registry().iter().any(|effect| effect.name == *name)));
    assert!(all.iter().all(|witness| witness.points.len() == witness.clips && witness.clips == 12));
}

#[test]
fn a_shift_and_a_latency_come_out_as_they_are_and_vanish_once_they_are_known() {
    let hidden = format!("{LATE}{SHIFTED}");
    let expected = [
        ("latency", 0.012),
        ("translation along x", 0.002),
        ("translation along y", -0.003),
        ("translation along z", 0.001),
    ];
    assert_says(&said(&hidden, ""), &expected);
    assert_says(&said(&hidden, LATE), &expected[1..]);
    assert_says(&said(&hidden, &hidden), &[]);
}

#[test]
fn points_of_a_latency_rise_with_the_speed_by_it() {
    let all = said(LATE, "");
    let latency = all.iter().find(|witness| witness.number == "latency").expect("a witness");
    for [speed, deep] in &latency.points {
        assert!(*speed > 0.1 && (deep - 0.012 * speed).abs() < 6e-4, "{speed} m/s, {deep} m");
    }
    assert!(!latency.is_level());
}

#[test]
fn a_box_that_leans_wherever_it_stands_is_a_turned_camera() {
    let all = said(TURNED, "");
    let of = |number: &str| all.iter().find(|witness| witness.number == number).expect("a witness");
    for (number, value) in [("rotation about x", 0.004), ("rotation about y", -0.006)] {
        assert!((of(number).value - value).abs() < SIGNIFICANT * of(number).error && of(number).is_significant());
        assert!(of(number).is_level() && of(number).error < 4e-4, "{}", of(number).error);
    }
    assert_says(&said(TURNED, TURNED), &[]);
}

#[test]
fn a_tip_beside_its_place_turns_with_the_flange_and_is_no_cameras_shift() {
    let all = said(BESIDE, "");
    assert_says(&all, &[("offset along x of the flange", 0.002), ("offset along y of the flange", -0.0015)]);
    assert!(all.iter().all(|witness| witness.number != "translation along x"));
    assert_says(&said(BESIDE, BESIDE), &[]);
}
