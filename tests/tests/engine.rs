//! `--engine`: another program simulates the arm. What it is asked, what becomes of its answers, and how it fails.

use serde_json::Value;
use shared_mem::cell::Cell as CellToml;
use shared_mem::msg::arm::ArmState;
use shared_mem::recording::{ClipInfo, ClipWriter};
use shared_mem::theta::Theta;
use std::path::Path;
use std::time::Duration;
use tests::{Cell, Finished, lab_cell, program_path};
use twin::control::Drive;
use twin::effects::{Role, Shape, Stage, registry};
use twin::sim::SimCell;

const PATIENCE: Duration = Duration::from_secs(240);
/// Clips, and control periods of each.
const CLIPS: u32 = 4;
const PERIODS: u64 = 1500;
/// Control periods in which the arm comes to rest before a clip.
const STILL: u64 = 500;
/// What a diagnosis may find here; all others are known to rest.
const CANDIDATES: [&str; 4] = ["command_delay", "command_lag", "joint_coulomb_friction", "payload"];
/// Late commands [s].
const DELAY: &str = "[[effect]]\nname = \"command_delay\"\ndelay = 0.008\n";

/// A session of an arm alone that swings with three sines a joint, different ones in each clip.
fn session(cell: &Cell, hidden: &str) {
    let lab = CellToml::parse(lab_cell(), Path::new("cell.toml")).expect("the shipped cell");
    let alone = CellToml { objects: Vec::new(), ..lab };
    let theta = Theta::read(&written(cell, "hidden.toml", hidden)).expect("a theta");
    let mut text = alone.to_toml();
    std::fs::create_dir(cell.path("session")).expect("a folder");
    for number in 0..CLIPS {
        let file = format!("clip_{number:02}.mcap");
        let mut twin = SimCell::new(&alone, Some(&theta)).expect("a cell");
        let mut writer = ClipWriter::create(&cell.path("session").join(&file), &ClipInfo::default()).expect("a file");
        let mut state = ArmState::default();
        twin.read(&mut state);
        let home = state.q;
        (0..STILL).for_each(|_| twin.step(&Drive::JointImpedance { q_d: home, dq_d: [0.0; 8] }));
        twin.read(&mut state);
        for tick in 0..PERIODS {
            let (mut q_d, mut dq_d) = (home, [0.0; 8]);
            let t = tick as f64 * 1e-3;
            for joint in 0..7 {
                for wave in 0..3 {
                    let omega = 2.0 + 1.7 * f64::from(wave) + 0.37 * joint as f64 + 0.53 * f64::from(number);
                    q_d[joint] += 0.05 * (1.0 - (omega * t).cos());
                    dq_d[joint] += 0.05 * omega * (omega * t).sin();
                }
            }
            (state.q_d, state.dq_d) = (q_d, dq_d);
            (state.stamp_ns, state.cycle) = (1_000_000_000_000 + tick * 1_000_000, tick);
            writer.arm_state(&state).expect("room");
            twin.step(&Drive::JointImpedance { q_d, dq_d });
            twin.read(&mut state);
        }
        writer.finish().expect("room");
        text += &format!("\n[[clip]]\nfile = \"{file}\"\nkind = \"excitation\"\n");
    }
    std::fs::write(cell.path("session").join("cell.toml"), text).expect("room");
}

fn written(cell: &Cell, name: &str, text: &str) -> std::path::PathBuf {
    std::fs::write(cell.path(name), text).expect("room");
    cell.path(name)
}

fn engine(options: &str) -> String {
    format!("{} {options}", program_path("fake_engine").display())
}

fn calibration(cell: &Cell, arguments: &[&str]) -> Finished {
    let session = cell.path("session").display().to_string();
    let with: Vec<&str> = arguments.iter().map(|word| if *word == "SESSION" { &session } else { *word }).collect();
    cell.start("calibration", &with).wait(PATIENCE)
}

/// A diagnosis among the candidates: each effect more costs a test time.
fn diagnose(cell: &Cell, more: &[&str]) -> Finished {
    let of_arm =
        registry().iter().filter(|effect| effect.stage == Stage::Control && !CANDIDATES.contains(&effect.name));
    let mut known = String::new();
    for effect in of_arm {
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
    let known = written(cell, "known.toml", &known).display().to_string();
    calibration(cell, &[&["diagnose", "SESSION", "--parameters", &known][..], more].concat())
}

fn gains(answer: &Value) -> Vec<f64> {
    let of = |name: &str| answer["parameters"][name]["value"].as_array().expect("gains").clone();
    [of("stiffness"), of("damping")].concat().iter().map(|gain| gain.as_f64().expect("a number")).collect()
}

/// The largest error of a gain, as a share.
fn worst(answer: &Value, truth: [[f64; 7]; 2]) -> f64 {
    let errors = gains(answer).into_iter().zip(truth.concat()).map(|(found, truth)| (found / truth - 1.0).abs());
    errors.fold(0.0, f64::max)
}

#[test]
fn gains_are_found_with_the_load_that_only_the_engines_own_model_carries() {
    let cell = Cell::shipped();
    let truth = [[660.0, 540.0, 640.0, 570.0, 270.0, 140.0, 54.0], [45.0, 54.0, 47.0, 53.0, 27.0, 27.0, 14.0]];
    let [stiffness, damping] = truth;
    let carried = "[[effect]]\nname = \"payload\"\nmass = 0.4\ncentre = [0.0, 0.0, 0.05]\n";
    session(&cell, &format!("[arm]\nstiffness = {stiffness:?}\ndamping = {damping:?}\n{carried}"));
    let identify = ["identify", "arm", "SESSION", "--json"];
    let own = calibration(&cell, &identify);
    // Gains alone do not explain these clips to the twin.
    assert_eq!(own.status.code(), Some(3), "{}", own.stderr);
    let own = own.json();
    let line = engine("--effects none --carries 0.4");
    let theirs = calibration(&cell, &[&identify[..], &["--engine", &line]].concat()).succeeded().json();
    let errors = [worst(&own, truth), worst(&theirs, truth)];
    assert!(errors[1] < 0.03 && errors[0] > 10.0 * errors[1], "the twin's, the engine's: {errors:?}");
    assert_eq!(theirs["engine"]["name"], "fake engine");
    assert_eq!(theirs["engine"]["simulates"], serde_json::json!([]));
}

#[test]
fn a_diagnosis_names_what_the_engine_lacks_whether_the_engine_or_the_twin_simulates_it() {
    let cell = Cell::shipped();
    session(&cell, DELAY);
    for (options, simulates) in [("", true), ("--effects none", false)] {
        let line = engine(options);
        let found = diagnose(&cell, &["--engine", &line, "--json"]).succeeded().json();
        assert_eq!(found["verdict"]["effects"], serde_json::json!(["command_delay"]), "{}", found["verdict"]);
        assert!(found["engine"]["rollouts"].as_u64() > Some(20), "{}", found["engine"]);
        let simulated = found["engine"]["simulates"].as_array().expect("a list");
        assert_eq!(simulated.contains(&Value::from("command_delay")), simulates, "{options}: {simulated:?}");
    }
}

#[test]
fn a_load_that_only_the_engines_own_model_carries_is_a_gap_of_the_engine() {
    let cell = Cell::shipped();
    session(&cell, "");
    let line = engine("--effects joint_coulomb_friction --carries 0.4");
    let found = diagnose(&cell, &["--engine", &line, "--json"]).succeeded().json();
    assert_ne!(found["verdict"]["kind"], "none", "{}", found["verdict"]);
    let own = diagnose(&cell, &["--json"]).succeeded().json();
    assert_eq!(own["verdict"]["kind"], "none", "{}", own["verdict"]);
}

#[test]
fn an_engine_that_fails_on_the_way_costs_one_line_and_nothing_that_was_found() {
    let cell = Cell::shipped();
    session(&cell, DELAY);
    let rollouts = |answer: Finished| answer.succeeded().json()["engine"]["rollouts"].as_u64().expect("a count");
    let line = engine("");
    let all = rollouts(diagnose(&cell, &["--engine", &line, "--json"]));
    let out = cell.path("diagnosis.json").display().to_string();
    let late = format!("--ends-after {} --counts {}", 3 * all / 4, cell.path("answered").display());
    for (options, says) in [
        (&late[..], "ended with exit status: 9; start it by hand"),
        ("--short-after 0", "were asked for; docs/engine.md"),
        ("--silent-after 0", "has not answered for 2 s; allow more with --engine-limit"),
    ] {
        let failed = diagnose(&cell, &["--out", &out, "--engine", &engine(options), "--engine-limit", "2"]);
        let complaint = failed.complaint();
        assert!(complaint.contains(says) && complaint.contains("goes on from there"), "{options}: {complaint}");
        assert!(cell.path("diagnosis.json.state").exists(), "{options}");
        assert!(!cell.path("diagnosis.json").exists(), "{options}");
    }
    let rest = rollouts(diagnose(&cell, &["--out", &out, "--engine", &line, "--json"]));
    assert!(rest < 3 * all / 4, "{rest} of {all} were asked for again");
    assert!(!cell.path("diagnosis.json.state").exists() && cell.path("diagnosis.json").exists());
}

#[test]
fn an_engine_that_ends_now_and_then_is_started_again_and_one_without_numbers_is_refused() {
    let cell = Cell::shipped();
    session(&cell, "");
    let identify =
        |options: &str| calibration(&cell, &["identify", "arm", "SESSION", "--json", "--engine", &engine(options)]);
    let answer = identify("--ends-after 7").succeeded().json();
    assert!(answer["engine"]["started_again"].as_u64() > Some(0), "{}", answer["engine"]);
    let failed = identify("--nan-after 0");
    assert!(failed.complaint().contains("a state of the engine is no number"), "{}", failed.complaint());
}

#[test]
fn ctrl_c_ends_engines_that_hang_within_a_second() {
    let cell = Cell::shipped();
    session(&cell, DELAY);
    let pids = cell.path("pids");
    let line = format!("echo $$ >> {}; exec {}", pids.display(), engine("--silent-after 5"));
    let session = cell.path("session").display().to_string();
    let running = cell.start("calibration", &["diagnose", &session, "--engine", &line]);
    let started = || std::fs::read_to_string(&pids).unwrap_or_default();
    Cell::until("an engine", PATIENCE, || !started().is_empty());
    std::thread::sleep(Duration::from_millis(1500));
    let end = running.interrupt();
    assert!(end.took < Duration::from_secs(1), "{:?}", end.took);
    for pid in started().lines() {
        Cell::until("its end", Duration::from_secs(1), || {
            let status = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
            status.is_empty() || status.contains(") Z ")
        });
    }
}

#[test]
fn what_an_engine_cannot_be_used_for_is_refused() {
    let cell = Cell::shipped();
    session(&cell, "");
    let line = engine("");
    for (more, says) in [("--torques", "cannot be used with"), ("--engine-limit=0", "from 1 to 86400")] {
        let refused = calibration(&cell, &["diagnose", "SESSION", "--engine", &line, more]);
        assert_eq!(refused.status.code(), Some(2), "{}", refused.stderr);
        assert!(refused.stderr.contains(says), "{more}: {}", refused.stderr);
    }
    let failed = calibration(&cell, &["diagnose", "SESSION", "--engine", "no_such_engine"]);
    assert!(failed.complaint().contains("not found"), "{}", failed.complaint());
}
