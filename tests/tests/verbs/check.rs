//! `calibration check` as it is typed: it ends with 0 whatever it finds, and the verbs that explain a recording stop where the data
//! cannot mean what they say.

use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{ClipInfo, ClipWriter};
use std::path::Path;
use std::process::{Command, Output};
use tests::program_path;
use tests::texts::root;
use twin::arm::ArmModel;
use twin::control::Drive;
use twin::sim::SimCell;

/// Two short clips in which the shipped arm moves; `turned`: a joint that is logged the other way round.
fn record(folder: &Path, turned: Option<usize>) {
    let mut cell = Cell::read(&root().join("config/fr3_cell.toml")).expect("the shipped cell");
    std::fs::create_dir_all(folder).expect("room");
    let arm = ArmModel::from_cell(&cell).expect("an arm");
    let home = &arm.ready()[..arm.dof()];
    for number in 0..2 {
        let file = format!("clip_{number:02}.mcap");
        let mut world = SimCell::new(&cell, None).expect("a cell");
        let mut writer = ClipWriter::create(&folder.join(&file), &ClipInfo::default()).expect("a new file");
        for k in 0..2000_u64 {
            let mut state = ArmState { stamp_ns: 7_000_000_000 + k * 1_000_000, cycle: k, ..ArmState::default() };
            world.read(&mut state);
            let phase = std::f64::consts::TAU * k as f64 / 2000.0;
            let size = |joint: usize| 0.05 * (1.0 + f64::from(number) + joint as f64);
            let moved: Vec<f64> =
                home.iter().enumerate().map(|(joint, q)| q + size(joint) * (1.0 - phase.cos())).collect();
            let rate: Vec<f64> =
                (0..home.len()).map(|joint| size(joint) * std::f64::consts::TAU / 2.0 * phase.sin()).collect();
            (state.q_d, state.dq_d) = (joints_from(&moved), joints_from(&rate));
            world.step(&Drive::JointImpedance { q_d: state.q_d, dq_d: state.dq_d });
            if let Some(joint) = turned {
                (state.q[joint], state.dq[joint]) = (-state.q[joint], -state.dq[joint]);
            }
            writer.arm_state(&state).expect("room");
        }
        writer.finish().expect("a whole clip");
        cell.clips.push(ClipEntry { file: file.into(), kind: ClipKind::Excitation });
    }
    std::fs::write(folder.join("cell.toml"), cell.to_toml()).expect("room");
}

fn run(folder: &Path, line: &str) -> Output {
    let words: Vec<&str> = line.split(' ').collect();
    Command::new(program_path("calibration")).args(words).current_dir(folder).output().expect("it runs")
}

fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn a_clean_recording_gets_no_remark_and_is_good_for_what_its_verbs_take() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("session"), None);
    let found = json(&run(lab.path(), "check session --report check.html --json"));
    assert_eq!(found["remarks"].as_array().map(Vec::len), Some(0), "{found}");
    let good = |clip: usize, verb: &str| {
        let all = found["clips"][clip]["good_for"].as_array().expect("a list").clone();
        all.into_iter().find(|fitness| fitness["verb"] == verb).expect("the verb")["good"].as_bool()
    };
    assert_eq!(
        [good(0, "replay"), good(1, "identify arm"), good(0, "viewpoint")],
        [Some(true), Some(true), Some(false)]
    );
    let missing = found["missing"].to_string();
    assert!(missing.contains("too few different commands") && missing.contains("it holds no pictures"), "{missing}");
    let page = std::fs::read_to_string(lab.path().join("check.html")).expect("the page");
    assert!(page.contains("2\u{a0}clips, no problems found") && page.contains("Command against measurement"));
}

#[test]
fn what_cannot_be_ends_a_diagnosis_in_one_line_and_is_taken_as_it_is_when_asked_for() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("session"), Some(1));
    let words = run(lab.path(), "check session");
    let text = String::from_utf8(words.stdout.clone()).expect("UTF-8");
    assert!(words.status.success() && text.contains("cannot be, joint_sign"), "{text}");
    for verb in ["diagnose session", "identify arm session"] {
        let stopped = run(lab.path(), verb);
        let said = String::from_utf8(stopped.stderr.clone()).expect("UTF-8");
        assert_eq!((stopped.status.code(), said.lines().count()), (Some(1), 1), "{said}");
        assert!(said.contains("`calibration check session`") && said.contains("--as-recorded"), "{said}");
        assert!(stopped.stdout.is_empty());
    }
    let found = json(&run(lab.path(), "diagnose session --as-recorded --json"));
    assert!(found["warnings"].to_string().contains("counts it the other way round"), "{found}");
}

#[test]
fn a_session_that_cannot_be_read_ends_with_1_and_one_line() {
    let lab = tempfile::tempdir().expect("a folder");
    record(&lab.path().join("session"), None);
    for clip in ["clip_00.mcap", "clip_01.mcap"] {
        std::fs::write(lab.path().join("session").join(clip), b"no clip").expect("room");
    }
    for (line, named) in [("check nowhere", "nowhere"), ("check session --json", "no clip can be read")] {
        let end = run(lab.path(), line);
        let said = String::from_utf8(end.stderr.clone()).expect("UTF-8");
        assert_eq!((end.status.code(), said.lines().count()), (Some(1), 1), "{said}");
        assert!(said.contains(named), "{said}");
    }
}
