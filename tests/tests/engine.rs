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
use twin::sim::SimCell;

const PATIENCE: Duration = Duration::from_secs(240);
/// Late commands [s].
const DELAY: &str = "[[effect]]\nname = \"command_delay\"\ndelay = 0.008\n";

/// A session of an arm alone that swings with three sines a joint, different ones in each clip.
fn session(cell: &Cell, hidden: &str) {
    let lab = CellToml::parse(lab_cell(), Path::new("cell.toml")).expect("the shipped cell");
    let alone = CellToml { object: None, ..lab };
    let theta = Theta::read(&written(cell, "hidden.toml", hidden)).expect("a theta");
    let mut text = alone.to_toml();
    std::fs::create_dir(cell.path("session")).expect("a folder");
    for number in 0..6_u32 {
        let file = format!("clip_{number:02}.mcap");
        let mut twin = SimCell::new(&alone, Some(&theta)).expect("a cell");
        let mut writer = ClipWriter::create(&cell.path("session").join(&file), &ClipInfo::default()).expect("a file");
        let mut state = ArmState::default();
        twin.read(&mut state);
        let home = state.q;
        for tick in 0..3000_u64 {
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

fn gains(answer: &Value) -> Vec<f64> {
    let of = |name: &str| answer["parameters"][name]["value"].as_array().expect("gains").clone();
    [of("stiffness"), of("damping")].concat().iter().map(|gain| gain.as_f64().expect("a number")).collect()
}

#[test]
fn gains_by_an_engine_that_moves_as_the_twin_does_are_the_twins() {
    let cell = Cell::shipped();
    session(&cell, DELAY);
    let effects = ["--also", "command_delay", "--json"];
    let own = calibration(&cell, &[&["identify", "arm", "SESSION"][..], &effects].concat()).succeeded().json();
    for options in ["", "--effects none"] {
        let line = engine(options);
        let arguments = [&["identify", "arm", "SESSION", "--engine", &line][..], &effects].concat();
        let theirs = calibration(&cell, &arguments).succeeded().json();
        let delay = theirs["parameters"]["command_delay.delay"]["value"].as_f64().expect("a delay");
        assert!((delay - 0.008).abs() < 1e-4, "{options}: {delay}");
        for (own, theirs) in gains(&own).iter().zip(gains(&theirs)) {
            assert!((theirs / own - 1.0).abs() < 2e-3, "{options}: {theirs} for {own}");
        }
        assert_eq!(theirs["engine"]["name"], "fake engine");
        let knows = theirs["engine"]["simulates"].as_array().expect("a list").len();
        assert_eq!(knows == 0, options == "--effects none", "{knows}");
    }
}

#[test]
fn a_diagnosis_names_what_the_engine_lacks_whether_the_engine_or_the_twin_simulates_it() {
    let cell = Cell::shipped();
    session(&cell, DELAY);
    for options in ["", "--effects none"] {
        let line = engine(options);
        let found = calibration(&cell, &["diagnose", "SESSION", "--engine", &line, "--json"]).succeeded().json();
        assert_eq!(found["verdict"]["effects"], serde_json::json!(["command_delay"]), "{}", found["verdict"]);
        assert!(found["engine"]["rollouts"].as_u64() > Some(20), "{}", found["engine"]);
    }
}

#[test]
fn a_load_that_only_the_engines_own_model_carries_is_a_gap_of_the_engine() {
    let cell = Cell::shipped();
    session(&cell, "");
    let line = engine("--effects joint_coulomb_friction --carries 0.4");
    let found = calibration(&cell, &["diagnose", "SESSION", "--engine", &line, "--json"]).succeeded().json();
    assert_ne!(found["verdict"]["kind"], "none", "{}", found["verdict"]);
    let own = calibration(&cell, &["diagnose", "SESSION", "--json"]).succeeded().json();
    assert_eq!(own["verdict"]["kind"], "none", "{}", own["verdict"]);
}

#[test]
fn an_engine_that_fails_on_the_way_costs_one_line_and_nothing_that_was_found() {
    let cell = Cell::shipped();
    session(&cell, DELAY);
    let out = cell.path("diagnosis.json").display().to_string();
    for (options, says) in [
        ("--ends-after 400", "ended with exit status: 9; start it by hand"),
        ("--short-after 400", "were asked for; docs/engine.md"),
        ("--silent-after 400", "has not answered for 2 s; allow more with --engine-limit"),
    ] {
        let line = engine(options);
        let with = ["diagnose", "SESSION", "--out", &out, "--engine", &line, "--engine-limit", "2"];
        let failed = calibration(&cell, &with);
        let complaint = failed.complaint();
        assert!(complaint.contains(says) && complaint.contains("goes on from there"), "{options}: {complaint}");
        assert!(cell.path("diagnosis.json.state").exists(), "{options}");
        assert!(!cell.path("diagnosis.json").exists(), "{options}");
    }
    let line = engine("");
    let _answer = calibration(&cell, &["diagnose", "SESSION", "--out", &out, "--engine", &line]).succeeded();
    assert!(!cell.path("diagnosis.json.state").exists() && cell.path("diagnosis.json").exists());
    let line = engine("--nan-after 0");
    let failed = calibration(&cell, &["identify", "arm", "SESSION", "--engine", &line]);
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
    for (more, says) in [("--torques", "cannot be used with"), ("--engine-limit=0", "0 is not in")] {
        let refused = calibration(&cell, &["diagnose", "SESSION", "--engine", &line, more]);
        assert_eq!(refused.status.code(), Some(2), "{}", refused.stderr);
        assert!(refused.stderr.contains(says), "{more}: {}", refused.stderr);
    }
    let failed = calibration(&cell, &["diagnose", "SESSION", "--engine", "no_such_engine"]);
    assert!(failed.complaint().contains("not found"), "{}", failed.complaint());
}
