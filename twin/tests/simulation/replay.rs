//! `twin replay` from the outside: sessions made by the simulated cell itself go in, figures and errors come out.

use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::msg::object::ObjectPose;
use shared_mem::output::Destination;
use shared_mem::recording::{Clip, ClipInfo, ClipMessages, ClipWriter, JointSeries, Payload, read_clip};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use twin::control::Drive;
use twin::replay::{Replayer, write_clip};
use twin::sim::SimCell;

const MILLISECOND: u64 = 1_000_000;
const START: [f64; 7] = [0.0, -0.3, 0.0, -2.2, 0.0, 1.9, 0.785];

fn lab() -> Cell {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let mut cell = Cell::read(&file).expect("the shipped cell");
    (cell.simulation.q_noise, cell.simulation.dq_noise) = (0.0, 0.0);
    cell.simulation.q = START.to_vec();
    cell
}

/// Joint targets of a motion that starts and ends at rest: one second of a bump, `size` rad high.
fn target(k: u64, size: f64) -> ([f64; 8], [f64; 8]) {
    let phase = std::f64::consts::TAU * (k as f64 * 1e-3).min(1.0);
    let q = START.map(|q| q + size * 0.5 * (1.0 - phase.cos()));
    let dq = [size * 0.5 * std::f64::consts::TAU * phase.sin(); 7];
    (joints_from(&q), joints_from(&dq))
}

/// Records the simulated cell following the bump for `rows` milliseconds. State `k` holds the command that is in force
/// from it on, as the bridge writes it.
fn record(file: &Path, cell: &Cell, rows: u64, size: f64) {
    let mut world = SimCell::new(cell, None).expect("a cell");
    let info = ClipInfo { cell_toml: Some(cell.to_toml()), ..ClipInfo::default() };
    let mut writer = ClipWriter::create(file, &info).expect("a new file");
    for k in 0..rows {
        let mut state = ArmState { stamp_ns: 7_000_000_000 + k * MILLISECOND, cycle: k, ..ArmState::default() };
        world.read(&mut state);
        (state.q_d, state.dq_d) = target(k, size);
        writer.arm_state(&state).expect("room");
        if k.is_multiple_of(33)
            && let Some(pose) = world.object()
        {
            let pose = ObjectPose {
                stamp_ns: state.stamp_ns,
                device_ns: state.device_ns,
                sequence: k / 33,
                position: pose.position(),
                wxyz: pose.wxyz(),
                ..ObjectPose::default()
            };
            writer.object_pose(&pose).expect("room");
        }
        world.step(&Drive::JointImpedance { q_d: state.q_d, dq_d: state.dq_d });
    }
    writer.finish().expect("a whole clip");
}

/// A session of two excitations.
fn session() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut cell = lab();
    for (name, size) in [("a.mcap", 0.1), ("b.mcap", 0.2)] {
        record(&folder.path().join(name), &cell, 1200, size);
        cell.clips.push(ClipEntry { file: name.into(), kind: ClipKind::Excitation });
    }
    std::fs::write(folder.path().join("cell.toml"), cell.to_toml()).expect("a file");
    let path = folder.path().to_owned();
    (folder, path)
}

fn twin(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_twin")).arg("replay").args(arguments).output().expect("the program runs")
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).expect("one JSON object on stdout")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

#[test]
fn the_twin_replays_its_own_motion_without_a_gap() {
    let (_folder, path) = session();
    let output = twin(&[text(&path), "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let answer = json(&output);
    assert_eq!(answer["clips"].as_array().map(Vec::len), Some(2));
    for joint in 0..7 {
        let rms = answer["mean"]["joint_rms_rad"][joint].as_f64().expect("a figure");
        assert!(rms < 1e-6, "joint {joint}: {rms} rad");
    }
    assert!(answer["clips"][0]["object_add_m"].is_null());
}

#[test]
fn wrong_gains_make_a_gap_and_their_file_is_obeyed() {
    let (_folder, path) = session();
    let theta = path.join("theta.toml");
    std::fs::write(
        &theta,
        "[arm]\nstiffness = [300, 600, 600, 600, 250, 150, 50]\ndamping = [50, 50, 50, 50, 30, 25, 15]\n",
    )
    .expect("a file");
    let answer = json(&twin(&[text(&path), "--json", "--parameters", text(&theta)]));
    let rms = |joint: usize| answer["mean"]["joint_rms_rad"][joint].as_f64().expect("a figure");
    assert!(rms(0) > 1e-4 && rms(6) < rms(0) / 10.0, "{} {}", rms(0), rms(6));
}

#[test]
fn an_unknown_effect_is_an_error_that_names_it() {
    let (_folder, path) = session();
    let theta = path.join("theta.toml");
    std::fs::write(&theta, "[[effect]]\nname = \"gremlins\"\nsize = 1.0\n").expect("a file");
    let output = twin(&[text(&path), "--parameters", text(&theta)]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("gremlins") && stderr(&output).trim().lines().count() == 1, "{}", stderr(&output));
    assert!(output.stdout.is_empty());
}

#[test]
fn a_clip_that_cannot_be_read_is_named_and_the_others_are_replayed() {
    let (_folder, path) = session();
    std::fs::write(path.join("a.mcap"), b"no recording").expect("a file");
    let output = twin(&[text(&path), "--json"]);
    assert!(output.status.success());
    assert!(stderr(&output).contains("a.mcap"), "{}", stderr(&output));
    let answer = json(&output);
    assert_eq!(answer["clips"][0]["file"], "b.mcap");
    assert_eq!(answer["failed"][0]["file"], "a.mcap");

    std::fs::write(path.join("b.mcap"), b"no recording either").expect("a file");
    let output = twin(&[text(&path)]);
    assert_eq!(output.status.code(), Some(1), "nothing was replayed");
}

#[test]
fn a_missing_session_is_one_line_with_a_remedy() {
    let output = twin(&["/nowhere/at/all"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("/nowhere/at/all") && stderr(&output).trim().lines().count() == 1);
    assert_eq!(twin(&["--no-such-option"]).status.code(), Some(2));
}

#[test]
fn a_simulated_clip_is_written_and_reads_back_as_the_recording() {
    let (_folder, path) = session();
    let out = path.join("made/simulated.mcap");
    let output = twin(&[text(&path.join("b.mcap")), "--out", text(&out)]);
    assert!(output.status.success(), "{}", stderr(&output));
    let cell = Cell::read(&path.join("cell.toml")).expect("the session's cell");
    let [recorded, written] =
        [&path.join("b.mcap"), &out].map(|file| read_clip(file, ClipKind::Excitation, &cell).expect("a clip"));
    assert_eq!((written.measured.q, written.desired.q), (recorded.measured.q, recorded.desired.q));
    let (mut real, mut twin_s) = (Vec::new(), Vec::new());
    for message in ClipMessages::open(&out, &[]).expect("a clip") {
        match message.expect("a message").payload {
            Payload::ArmState(state) => real.push(state.tau_J),
            Payload::TwinState(state) => twin_s.push(state.tau_J),
            _ => {}
        }
    }
    assert!(real.len() > 1000 && real.len() == twin_s.len(), "{} and {}", real.len(), twin_s.len());
    for (real, twin) in real.iter().zip(&twin_s).skip(1) {
        let apart = real.iter().zip(twin).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 0.05 && twin[1].abs() > 1.0, "the arm's weight and motion: {real:?}, {twin:?}");
    }
    let before = std::fs::read(&out).expect("the clip");
    let again = twin(&[text(&path.join("b.mcap")), "--out", text(&out)]);
    assert_eq!(again.status.code(), Some(1), "an existing clip is not overwritten");
    assert!(stderr(&again).contains("simulated.mcap") && stderr(&again).contains("--force"), "{}", stderr(&again));
    assert_eq!(std::fs::read(&out).expect("the clip"), before);
    let forced = twin(&[text(&path.join("b.mcap")), "--out", text(&out), "--force"]);
    assert!(forced.status.success(), "{}", stderr(&forced));
}

#[test]
fn a_recording_from_before_this_machine_was_started_keeps_its_stamps() {
    let (_folder, path) = session();
    let cell = Cell::read(&path.join("cell.toml")).expect("the session's cell");
    let mut clip = read_clip(&path.join("a.mcap"), ClipKind::Excitation, &cell).expect("a clip");
    // As a ROS 2 bag of the year 2020 stamps them.
    for series in [&mut clip.measured, &mut clip.desired] {
        series.stamps_ns.iter_mut().for_each(|stamp| *stamp += 1_600_000_000_000_000_000);
    }
    let replayer = Replayer::new(&cell, None).expect("a twin");
    let (clip, prediction, _) = replayer.replay(clip).expect("an arm that follows");
    let out = path.join("simulated.mcap");
    let place = Destination::new(&out, false).expect("a new file");
    write_clip(&place, &replayer, &clip, &prediction).expect("room");
    let messages =
        ClipMessages::open(&out, &["/twin/state"]).expect("a clip").map(|message| message.expect("a message"));
    let logged: Vec<u64> = messages.map(|message| message.log_time_ns).collect();
    assert_eq!(logged, clip.measured.stamps_ns);
}

#[test]
fn a_box_that_the_tool_pushes_is_replayed_with_its_contact() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut cell = lab();
    // The tip starts 54 cm in front of the base; the bump swings the arm to the left, into the box.
    let arm = SimCell::new(&cell, None).expect("a cell").arm_model().expect("an arm").clone();
    let [x, y, z] = arm.tip(&joints_from(&START)).position();
    cell.table = Some(shared_mem::cell::Table { height: z - 0.03 });
    cell.simulation.object_position = [x, y + 0.06];
    record(&folder.path().join("hit.mcap"), &cell, 1200, 0.1);
    cell.clips.push(ClipEntry { file: "hit.mcap".into(), kind: ClipKind::ControlHitSlide });
    std::fs::write(folder.path().join("cell.toml"), cell.to_toml()).expect("a file");
    let output = twin(&[text(folder.path()), "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let clip = &json(&output)["clips"][0];
    let contact = clip["contact_time_s"].as_f64().expect("a touch");
    assert!((0.05..0.6).contains(&contact), "{contact}");
    let moved = clip["object_add_m"].as_f64().expect("a figure");
    assert!(moved < 2e-3, "{moved}");
    assert!(clip["joint_rms_rad"][0].as_f64().expect("a figure") < 1e-4);
}

fn swapped(clip: &Clip) -> Clip {
    let columns = |series: &JointSeries| {
        let swap = |values: &[f64]| values.chunks_exact(7).flat_map(|row| row.iter().rev().copied()).collect();
        JointSeries { q: swap(&series.q), dq: swap(&series.dq), tau: swap(&series.tau), ..series.clone() }
    };
    let joint_names = clip.joint_names.iter().rev().cloned().collect();
    Clip { joint_names, measured: columns(&clip.measured), desired: columns(&clip.desired), ..clip.clone() }
}

#[test]
fn joints_in_another_order_are_sorted_and_foreign_joints_refused() {
    let (_folder, path) = session();
    let cell = Cell::read(&path.join("cell.toml")).expect("the session's cell");
    let clip = read_clip(&path.join("a.mcap"), ClipKind::Excitation, &cell).expect("a clip");
    let replayer = Replayer::new(&cell, None).expect("a twin");
    let (_, _, sorted) = replayer.replay(swapped(&clip)).expect("the same joints");
    let (_, _, straight) = replayer.replay(clip.clone()).expect("the model's own order");
    assert_eq!(sorted, straight);
    let mut foreign = clip;
    foreign.joint_names[3] = "panda_joint4".into();
    let error = replayer.replay(foreign).unwrap_err().to_string();
    assert!(error.contains("panda_joint4") && error.contains("fr3_joint4") && !error.contains('\n'), "{error}");
}
