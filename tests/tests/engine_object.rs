//! `--engine` for clips with an object: the twin behind the protocol gives the twin's answers, what an engine does not know the twin
//! adds, and an engine that fails costs one line.

use serde_json::Value;
use shared_mem::cell::Cell as CellToml;
use shared_mem::frames::Pose;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::object::ObjectPose;
use shared_mem::recording::{ClipInfo, ClipWriter};
use shared_mem::theta::Theta;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tests::{Cell, Finished, lab_cell, program_path};
use twin::control::Drive;
use twin::effects::{Role, Shape, registry};
use twin::sim::SimCell;

const PATIENCE: Duration = Duration::from_secs(900);
/// Joints with the tip upright 5 cm above the table, 46 and 58 cm in front of the base [rad].
const FROM: [f64; 7] = [0.0, 0.22786, 0.0, -2.53004, 0.0, 2.7579, 0.78];
const TO: [f64; 7] = [0.0, 0.47061, 0.0, -2.10632, 0.0, 2.57692, 0.78];
/// Strokes: how long the way to there takes [s], to which side the base turns [rad], how far the box stands aside [m].
const STROKES: [[f64; 3]; 6] = [
    [0.45, 0.0, 0.0],
    [0.6, 0.1, 0.004],
    [0.5, -0.15, -0.005],
    [0.7, 0.05, -0.003],
    [0.55, -0.05, 0.006],
    [0.65, 0.15, 0.002],
];
/// Control periods in which the arm waits before its way begins and is recorded, and those recorded.
const WAITS: u64 = 200;
const PERIODS: u64 = 1500;
const START_NS: u64 = 1_000_000_000_000;
/// Control periods between two poses.
const POSE_PERIODS: u64 = 16;
/// What the box is truly like.
const HIDDEN: &str =
    "[object]\nfriction = 0.28\nmass = 0.42\ncentre_of_mass = [0.004, -0.003, 0.0]\ntip_friction = 0.2\n";
/// A table tilted across the strokes; along them other friction does nearly the same.
const TILT: &str = "[[effect]]\nname = \"table_tilt\"\ntilt = [0.03, 0.0]\n";
/// What a diagnosis may find here; all others are known to rest.
const CANDIDATES: [&str; 3] = ["table_tilt", "velocity_dependent_friction", "object_inertia"];

/// A session of strokes without noise.
fn session(cell: &Cell, hidden: &str) {
    let lab = CellToml::parse(lab_cell(), Path::new("cell.toml")).expect("the shipped cell");
    let theta = Theta::read(&written(cell, "hidden.toml", hidden)).expect("a theta");
    let mut text = lab.to_toml();
    std::fs::create_dir(cell.path("session")).expect("a folder");
    for (number, stroke) in STROKES.iter().enumerate() {
        let file = format!("clip_{number:02}.mcap");
        record(&cell.path("session").join(&file), (&lab, &theta), *stroke);
        text += &format!("\n[[clip]]\nfile = \"{file}\"\nkind = \"control_hit_slide\"\n");
    }
    std::fs::write(cell.path("session").join("cell.toml"), text).expect("room");
}

/// One stroke into a file.
fn record(file: &Path, (lab, theta): (&CellToml, &Theta), [lasts, side, aside]: [f64; 3]) {
    let mut twin = SimCell::new(lab, Some(theta)).expect("a cell");
    let mut writer = ClipWriter::create(file, &ClipInfo::default()).expect("a file");
    let mut state = ArmState::default();
    let mut from = [0.0; 8];
    from[..7].copy_from_slice(&FROM);
    from[0] = side;
    let (sine, cosine) = side.sin_cos();
    let place = [0.545 * cosine - aside * sine, 0.545 * sine + aside * cosine, 0.05];
    let turn = [(0.5 * side).cos(), 0.0, 0.0, (0.5 * side).sin()];
    twin.set_arm(&from, &[0.0; 8]);
    twin.set_object(&Pose::from_parts(place, turn).expect("a pose"), Default::default(), Default::default());
    let mut poses = 0;
    for tick in 0..PERIODS {
        let share = (tick.saturating_sub(WAITS) as f64 * 1e-3 / lasts).min(1.0);
        let way = share.powi(3) * (10.0 + share * (6.0 * share - 15.0));
        let speed = 30.0 * (share * (1.0 - share)).powi(2) / lasts;
        let (mut q_d, mut dq_d) = (from, [0.0; 8]);
        for joint in 1..7 {
            q_d[joint] += way * (TO[joint] - FROM[joint]);
            dq_d[joint] = speed * (TO[joint] - FROM[joint]);
        }
        twin.read(&mut state);
        let stamp_ns = START_NS + tick * 1_000_000;
        if tick % POSE_PERIODS == 0 {
            let pose = twin.object().expect("a box");
            let message = ObjectPose {
                stamp_ns,
                device_ns: stamp_ns,
                sequence: poses,
                position: pose.position(),
                wxyz: pose.wxyz(),
                covariance: [0.0; 36],
            };
            writer.object_pose(&message).expect("room");
            poses += 1;
        }
        (state.q_d, state.dq_d) = (q_d, dq_d);
        (state.stamp_ns, state.cycle) = (stamp_ns, tick);
        writer.arm_state(&state).expect("room");
        twin.step(&Drive::JointImpedance { q_d, dq_d });
    }
    writer.finish().expect("room");
}

fn written(cell: &Cell, name: &str, text: &str) -> PathBuf {
    std::fs::write(cell.path(name), text).expect("room");
    cell.path(name)
}

fn engine(options: &str) -> String {
    format!("{} {options}", program_path("fake_engine").display())
}

fn calibration(cell: &Cell, verb: &[&str], more: &[&str]) -> Finished {
    let session = cell.path("session").display().to_string();
    cell.start("calibration", &[verb, &[&session[..]], more].concat()).wait(PATIENCE)
}

/// The box is identified under the true gains, which cell.toml has.
fn identify(cell: &Cell, engine_options: Option<&str>) -> Finished {
    let gains = CellToml::parse(lab_cell(), Path::new("cell.toml")).expect("the shipped cell").controller.expect("one");
    let [stiffness, damping] = [gains.stiffness, gains.damping];
    let known = written(cell, "gains.toml", &format!("[arm]\nstiffness = {stiffness:?}\ndamping = {damping:?}\n"));
    let known = known.display().to_string();
    let line = engine(engine_options.unwrap_or_default());
    let more = if engine_options.is_some() { &["--engine", &line[..]][..] } else { &[] };
    calibration(cell, &["identify", "object"], &[&["--json", "--parameters", &known], more].concat())
}

fn number(answer: &Value, path: &str) -> f64 {
    answer.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {answer}"))
}

#[test]
fn the_twin_as_an_engine_gives_the_twins_answer_whatever_of_it_the_engine_knows() {
    let cell = Cell::shipped();
    session(&cell, HIDDEN);
    let own = identify(&cell, None).succeeded().json();
    for options in ["", "--parameters none --effects none"] {
        let theirs = identify(&cell, Some(options)).succeeded().json();
        for figure in ["joint_rms_rad", "object_add_m", "object_add_s_m"] {
            for of in ["train_before", "holdout_before"] {
                let path = format!("/gap/{of}/{figure}");
                let (own, theirs) = (number(&own, &path), number(&theirs, &path));
                assert!((own - theirs).abs() < 1e-8 * own, "{options}: {path} {own} {theirs}");
            }
        }
        for parameter in ["friction", "mass"] {
            let [own, theirs] = [&own, &theirs].map(|answer| number(answer, &format!("/parameters/{parameter}/value")));
            assert!((own / theirs - 1.0).abs() < 0.02, "{options}: {parameter} {own} {theirs}");
        }
        assert_eq!(theirs["engine"]["object"], true);
        // An engine that knows nothing has one answer for each clip.
        assert!(theirs["engine"]["rollouts"].as_u64() >= Some(STROKES.len() as u64), "{}", theirs["engine"]);
    }
}

#[test]
fn friction_is_found_for_the_engine_whose_own_table_is_more_slippery() {
    let cell = Cell::shipped();
    session(&cell, HIDDEN);
    let friction = |options| number(&identify(&cell, Some(options)).succeeded().json(), "/parameters/friction/value");
    let (true_to_it, slippery) = (friction(""), friction("--slippery 0.2"));
    assert!((true_to_it / 0.28 - 1.0).abs() < 0.03, "{true_to_it}");
    assert!((0.8 * slippery / true_to_it - 1.0).abs() < 0.03, "{slippery} for {true_to_it}");
}

#[test]
#[ignore = "takes minutes: cargo test --release --workspace --test engine_object -- --ignored"]
fn a_diagnosis_names_what_acts_on_the_object_whether_the_engine_or_the_twin_simulates_it() {
    let cell = Cell::shipped();
    session(&cell, &format!("{HIDDEN}{TILT}"));
    let mut known = HIDDEN.to_owned();
    for effect in registry().iter().filter(|effect| !CANDIDATES.contains(&effect.name)) {
        known += &format!("[[effect]]\nname = \"{}\"\n", effect.name);
        for parameter in effect.parameters {
            let Role::Size { neutral } = parameter.role else { continue };
            known += &match parameter.shape {
                Shape::Number => format!("{} = {neutral:?}\n", parameter.name),
                Shape::PerJoint => format!("{} = {:?}\n", parameter.name, [neutral; 7]),
                Shape::Vector(size) => format!("{} = {:?}\n", parameter.name, vec![neutral; size]),
            };
        }
    }
    let known = written(&cell, "known.toml", &known).display().to_string();
    for (options, simulates) in [("", true), ("--effects none", false)] {
        let line = engine(options);
        let found = calibration(&cell, &["diagnose"], &["--parameters", &known, "--engine", &line, "--json"]);
        let found = found.succeeded().json();
        assert_eq!(found["verdict"]["effects"], serde_json::json!(["table_tilt"]), "{options}: {}", found["verdict"]);
        let simulated = found["engine"]["simulates"].as_array().expect("a list");
        assert_eq!(simulated.contains(&Value::from("table_tilt")), simulates, "{options}: {simulated:?}");
    }
}

#[test]
fn an_engine_that_knows_no_object_or_sends_damaged_poses_costs_one_line() {
    let cell = Cell::shipped();
    session(&cell, HIDDEN);
    for (options, says) in [
        ("--protocol 1", "its greeting has no `object`"),
        ("--short-after 2", "poses of 7 were asked for; docs/engine.md"),
        ("--stretched-after 2", "no unit quaternion, but 2.0000 long; docs/engine.md"),
        ("--nan-after 0", "a state of the engine is no number"),
        ("--ends-after 0", "ended with exit status: 9; start it by hand"),
    ] {
        let complaint = identify(&cell, Some(options)).complaint().to_owned();
        assert!(complaint.contains(says) && complaint.trim().lines().count() == 1, "{options}: {complaint}");
    }
    let line = engine("--protocol 1");
    let refused = calibration(&cell, &["diagnose"], &["--engine", &line]);
    let complaint = refused.complaint();
    assert!(complaint.contains("calibration capture excitation"), "{complaint}");
}
