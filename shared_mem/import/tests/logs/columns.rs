//! Logs in which several columns may be the same quantity: the one is taken that the numbers speak for, and what else there was is
//! said; where nothing speaks for one of them, it is asked.

use crate::lab;
use crate::written::{JointState, Signal, bag, npz, npz_of, state_definition, table};
use import::{
    DataSetPlan, DataSetWriter, Factor, Feature, FeatureKind, Frames, ImportError, Note, Order, Outcome, import,
};
use shared_mem::output::OutputFolder;
use shared_mem::recording::{Clip, Session};
use std::path::{Path, PathBuf};

const DT: f64 = 0.01;

/// Position of a joint of a made-up arm [rad].
fn q(joint: usize, t: f64) -> f64 {
    let w = 2.0 + 0.5 * joint as f64;
    [0.1, -0.7, 0.2, -2.2, -0.1, 1.6, 0.7][joint] + 0.3 * (w * t).sin()
}

fn dq(joint: usize, t: f64) -> f64 {
    let w = 2.0 + 0.5 * joint as f64;
    0.3 * w * (w * t).cos()
}

/// Columns `name[0]` and so on, of seven joints.
fn seven(name: &str, of: impl Fn(usize, f64) -> f64 + Copy + 'static) -> Vec<(String, Signal)> {
    (0..7).map(|joint| (format!("{name}[{joint}]"), Box::new(move |t: f64| of(joint, t)) as Signal)).collect()
}

/// A column of stamps [s].
fn time() -> Vec<(String, Signal)> {
    vec![("time".to_owned(), Box::new(|t| t))]
}

/// A folder with one log and what its import left there.
struct Lab {
    folder: tempfile::TempDir,
    file: PathBuf,
}

impl Lab {
    fn of(name: &str, bytes: impl AsRef<[u8]>) -> Self {
        let lab = Self::at(name);
        std::fs::write(&lab.file, bytes).expect("room");
        lab
    }

    fn at(name: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join(name);
        Self { folder, file }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn import(&self, mapping: Option<&Path>, cell: Option<&Path>) -> Result<Outcome, ImportError> {
        let (files, out, questions) = ([self.file.clone()], self.path("session"), self.path("import.toml"));
        import(Order { mapping, cell, ..lab::order(&files, &out, &questions) }, |_, _| {})
    }

    fn done(&self) -> Vec<Note> {
        match self.import(None, None).expect("a log") {
            Outcome::Done { notes, .. } => notes,
            Outcome::Open { notes, .. } => panic!("open: {notes:?}"),
        }
    }

    /// The lines that are asked for, and all that was said.
    fn asked(&self, cell: Option<&Path>) -> (Vec<String>, Vec<Note>) {
        match self.import(None, cell).expect("questions") {
            Outcome::Done { notes, .. } => panic!("nothing was asked: {notes:?}"),
            Outcome::Open { notes, .. } => {
                assert!(!self.path("session").exists(), "nothing is written");
                (notes.iter().filter(|note| note.open).map(|note| note.line.clone()).collect(), notes)
            }
        }
    }

    /// Fills in lines of the import.toml that was written, and imports with it.
    fn answer(&self, change: impl Fn(String) -> String) -> Result<Outcome, ImportError> {
        let file = self.path("import.toml");
        std::fs::write(&file, change(std::fs::read_to_string(&file).expect("questions"))).expect("room");
        self.import(Some(&file), None)
    }

    fn clips(&self) -> Vec<Clip> {
        let session = Session::open(&self.path("session")).expect("a session");
        session.clips.iter().map(|entry| session.read(entry).expect("a clip")).collect()
    }
}

fn why(notes: &[Note], line: &str) -> String {
    notes.iter().filter(|note| note.line == line).map(|note| format!("{} ", note.why)).collect()
}

/// Holds rows against the arm's motion, at times from the first row on.
fn follows_q(series: &shared_mem::recording::JointSeries, lag: f64, near: f64) {
    for row in 0..series.len() {
        let t = (series.stamps_ns[row] - series.stamps_ns[0]) as f64 * 1e-9 - lag;
        for (joint, found) in series.q_row(row).iter().enumerate() {
            assert!((found - q(joint, t)).abs() < near, "row {row}, joint {joint}: {found} for {}", q(joint, t));
        }
    }
}

#[test]
fn angles_behind_the_gear_are_taken_and_not_those_of_the_motors() {
    let lab = Lab::at("state.db3");
    let messages = (0..200).map(|row| {
        let t = f64::from(row) * DT;
        let joints = |of: &dyn Fn(usize) -> f64| (0..7).map(of).collect::<Vec<f64>>();
        let state = |position: Vec<f64>, velocity: Vec<f64>, effort: Vec<f64>| JointState {
            names: vec![],
            position,
            velocity,
            effort,
        };
        let rate = |t: f64| joints(&|j| dq(j, t));
        let tau = joints(&|j| 20.0 * q(j, t).cos());
        let motor = joints(&|j| q(j, t) + 0.002 * tau[j] / 20.0);
        let measured = state(joints(&|j| q(j, t)), rate(t), tau);
        let told = state(joints(&|j| q(j, t + 0.03)), rate(t + 0.03), joints(&|_| 1.0));
        (row as u64 * 10_000_000, vec![measured, state(motor, rate(t), vec![]), told])
    });
    let fields = ["measured_joint_state", "measured_joint_motor_state", "desired_joint_state"];
    bag(&lab.file, &[("/robot_state", "vendor_msgs/msg/State", Some(&state_definition(&fields)), messages.collect())]);
    let notes = lab.done();
    let clip = lab.clips().remove(0);
    assert_eq!((clip.measured.len(), clip.desired.len()), (200, 200));
    follows_q(&clip.measured, 0.0, 1e-9);
    follows_q(&clip.desired, -0.03, 1e-9);
    assert!(clip.measured.dq_row(7).is_some());
    let why = why(&notes, "measured.q");
    assert!(
        why.contains("`measured_joint_state.position`") && why.contains("also there: `measured_joint_motor_state"),
        "{why}"
    );
    let note = notes.iter().find(|note| note.line == "measured.q").expect("a reason");
    assert!(note.instead[0].starts_with("q = [\"measured_joint_motor_state.position[0]\""), "{:?}", note.instead);
}

#[test]
fn the_pose_of_a_hand_is_no_arm_and_a_log_of_another_arm_does_not_fit_the_cell() {
    let data_set = |labels: &[&str], scale: f64| {
        let lab = Lab::at("data_set");
        let names: Vec<String> = labels.iter().map(|&label| label.to_owned()).collect();
        let feature = |name: &str| Feature { name: name.into(), kind: FeatureKind::Numbers(names.clone()) };
        let plan = DataSetPlan {
            rate: 15,
            robot: "panda".into(),
            task: "put the cup away".into(),
            features: vec![feature("observation.state"), feature("action")],
        };
        let mut writer = DataSetWriter::new(OutputFolder::create(&lab.file).expect("a folder"), plan);
        for _ in 0..2 {
            let rows = |ahead: f64| {
                let row = |k: u32| (0..labels.len()).map(move |j| (scale * q(j, f64::from(k) / 15.0 + ahead)) as f32);
                Frames::Numbers((0..60).flat_map(row).collect())
            };
            writer.episode(&[rows(0.0), rows(0.05)]).expect("room");
        }
        writer.finish().expect("room");
        lab
    };
    let fr3 = |lab: &Lab| {
        let names: Vec<String> = (1..=7).map(|i| format!("\"fr3_joint{i}\"")).collect();
        let cell = lab.path("cell.toml");
        std::fs::write(&cell, format!("[robot]\njoints = [{}]\n", names.join(", "))).expect("room");
        cell
    };
    let hand = data_set(&["x", "y", "z", "roll", "pitch", "yaw", "gripper"], 0.2);
    for cell in [None, Some(fr3(&hand))] {
        let (open, notes) = hand.asked(cell.as_deref());
        assert_eq!(open[0], "measured.q");
        assert!(why(&notes, "measured.q").contains("the pose of a hand"), "{notes:?}");
        std::fs::remove_file(hand.path("import.toml")).expect("questions");
    }
    let small = data_set(&["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"], 1.0);
    let error = small.import(None, Some(&fr3(&small))).expect_err("another arm").to_string();
    assert!(error.contains("has 7 joints (fr3_joint1") && error.contains("5 (shoulder_pan"), "{error}");
    assert!(error.lines().count() == 1 && !small.path("session").exists(), "{error}");
    // Alone it is an arm of five; given by its columns it does not fit the cell either.
    small.done();
    let session = small.path("session");
    let (mapping, cell) = (small.path("mapping.toml"), fr3(&small));
    std::fs::copy(session.join("import.toml"), &mapping).expect("a mapping");
    std::fs::remove_dir_all(&session).expect("a session");
    let error = small.import(Some(&mapping), Some(&cell)).expect_err("another arm").to_string();
    assert!(error.contains("5 joints") && error.contains("has 7") && error.lines().count() == 1, "{error}");
}

#[test]
fn several_runs_of_one_file_are_a_clip_each_and_sines_and_deltas_are_no_joints() {
    for lengths in [[60_u32, 80, 70], [60, 60, 60]] {
        let mut arrays = Vec::new();
        for (run, rows) in lengths.into_iter().enumerate() {
            let at = |k: u32| f64::from(k) * 0.05 + run as f64;
            let of = |of: &dyn Fn(usize, f64) -> f64| -> Vec<Vec<f64>> {
                (0..rows).map(|k| (0..7).map(|j| of(j, at(k))).collect()).collect()
            };
            let name = |name: &str| format!("data.demo_{run}.{name}");
            arrays.extend([
                (name("actions"), of(&|j, t| 0.05 * ((j + 1) as f64 * 0.7 * t).sin())),
                (name("obs.robot0_joint_pos"), of(&q)),
                (name("obs.robot0_joint_pos_cos"), of(&|j, t| q(j, t).cos())),
                (name("obs.robot0_joint_pos_sin"), of(&|j, t| q(j, t).sin())),
                (name("obs.robot0_joint_vel"), of(&dq)),
            ]);
        }
        let lab = Lab::of("demos.npz", npz(&arrays));
        let (open, notes) = lab.asked(None);
        assert_eq!(open, ["desired.q", "measured.rate"], "{notes:?}");
        assert!(why(&notes, "log").contains("3 runs") && why(&notes, "log").contains("data.demo_2"), "{notes:?}");
        assert!(why(&notes, "measured.q").contains("`obs.robot0_joint_pos` of"), "{notes:?}");
        assert!(why(&notes, "desired.q").contains("`actions`"), "{notes:?}");
        // Without commands.
        let outcome = lab.answer(|text| {
            let text = text.replace("rate = 0.0", "rate = 20.0");
            text.split_once("[desired]").expect("a block").0.to_owned()
        });
        assert!(matches!(&outcome, Ok(Outcome::Done { clips, .. }) if clips.len() == 3), "{outcome:?}");
        for (run, (clip, rows)) in lab.clips().iter().zip(lengths).enumerate() {
            assert_eq!((clip.measured.len(), clip.desired.len()), (rows as usize, 0));
            assert!((clip.measured.q_row(3)[1] - q(1, 0.15 + run as f64)).abs() < 1e-9, "its own run");
        }
    }
}

#[test]
fn of_a_robot_on_wheels_the_arm_is_imported() {
    let lab = Lab::at("rover.db3");
    let arm: Vec<usize> = vec![2, 0, 5, 1, 6, 3, 4];
    let mut names: Vec<String> = arm.iter().map(|i| format!("fr3_joint{}", i + 1)).collect();
    names.extend(["wheel_1", "wheel_2", "wheel_3", "wheel_4"].map(str::to_owned));
    names.extend(["fr3_finger_joint1", "fr3_finger_joint2"].map(str::to_owned));
    let stamp = |row: u32| u64::from(row) * 10_000_000;
    let state = |row: u32| {
        let t = f64::from(row) * DT;
        let mut position: Vec<f64> = arm.iter().map(|i| q(*i, t - 0.03)).collect();
        position.extend((0..6).map(|wheel| t * f64::from(wheel)));
        let mut velocity: Vec<f64> = arm.iter().map(|i| dq(*i, t - 0.03)).collect();
        velocity.extend((0..6).map(f64::from));
        (stamp(row), vec![JointState { names: names.clone(), position, velocity, effort: vec![f64::NAN; 13] }])
    };
    let told = |row: u32| {
        let joints = (0..7).rev();
        let names = joints.clone().map(|i| format!("fr3_joint{}", i + 1)).collect();
        let position = joints.map(|i| q(i, f64::from(row) * DT)).collect();
        (stamp(row), vec![JointState { names, position, velocity: vec![], effort: vec![] }])
    };
    let joint_state = "sensor_msgs/msg/JointState";
    for commanded in [true, false] {
        let mut topics = vec![("/joint_states", joint_state, None, (0..300).map(state).collect::<Vec<_>>())];
        if commanded {
            topics.push(("/arm_controller/desired_joint_states", joint_state, None, (0..300).map(told).collect()));
        }
        bag(&lab.file, &topics);
        let notes = lab.done();
        let clip = lab.clips().remove(0);
        assert_eq!((clip.measured.len(), clip.desired.len()), (300, if commanded { 300 } else { 0 }));
        follows_q(&clip.measured, 0.03, 1e-9);
        follows_q(&clip.desired, 0.0, 1e-9);
        let joints = why(&notes, "joints");
        assert!(["wheel_3", "fr3_finger_joint2"].iter().all(|name| joints.contains(name)), "{joints}");
        let text = std::fs::read_to_string(lab.path("session/import.toml")).expect("import.toml");
        let measured = text.split_once("[measured]").expect("a block").1;
        assert!(measured.contains("table = \"/joint_states\""), "{text}");
        let names: Vec<String> = (1..=7).map(|i| format!("fr3_joint{i}")).collect();
        assert_eq!(clip.joint_names, names);
        assert!(why(&notes, "measured.q").contains("holds no number"), "efforts: {notes:?}");
        std::fs::remove_dir_all(lab.path("session")).expect("a session");
        std::fs::remove_file(&lab.file).expect("a bag");
    }
}

#[test]
fn tables_of_rostopic_have_names_and_those_without_are_asked_about_with_their_rows() {
    let lab = Lab::at("ros1.csv");
    let names = |field: &str| (0..7).map(|i| format!("field.{field}{i}")).collect::<Vec<_>>().join(",");
    let mut text = format!("time,field.header.seq,field.header.stamp,{},{}\n", names("position"), names("velocity"));
    let mut bare = String::new();
    for row in 0..250_u64 {
        let cells: Vec<String> = (0..7).map(|i| q(i, row as f64 * DT).to_string()).collect();
        let (stamp, cells) = (1_760_000_000_000_000_000 + row * 10_000_000, cells.join(","));
        text += &format!("{},{row},{stamp},{cells},0,0,0,0,0,0,0\n", stamp + 130_000);
        bare += &format!("{},{},{cells}\n", stamp / 1_000_000_000, stamp % 1_000_000_000);
    }
    std::fs::write(&lab.file, text).expect("room");
    let notes = lab.done();
    let clip = lab.clips().remove(0);
    assert_eq!((clip.measured.len(), clip.desired.len()), (250, 0));
    assert_eq!(clip.measured.stamps_ns[0], 1_760_000_000_000_000_000);
    follows_q(&clip.measured, 0.0, 1e-6);
    assert!(clip.measured.dq_row(0).is_none(), "zeros that a driver did not fill in");
    assert!(why(&notes, "desired").contains("--torques"), "{notes:?}");
    let lab = Lab::of("ros2.csv", bare);
    let (open, notes) = lab.asked(None);
    assert_eq!(open, ["measured.q", "desired.q"]);
    assert!(notes.iter().any(|note| note.why.contains("`column[1]` and `column[2]`")), "{notes:?}");
    let text = std::fs::read_to_string(lab.path("import.toml")).expect("questions");
    assert!(text.contains("#     row 1: 1760000000, 0, 0.1, "), "{text}");
    let columns: Vec<String> = (3..10).map(|i| format!("\"column[{i}]\"")).collect();
    lab.answer(|text| {
        let measured = text.split_once("[desired]").expect("a block").0;
        measured.replace("\nq = []", &format!("\nq = [{}]", columns.join(", ")))
    })
    .expect("an answer");
    let clip = lab.clips().remove(0);
    assert_eq!(clip.measured.len(), 250);
    assert_eq!(clip.measured.stamps_ns[1], 1_760_000_000_010_000_000);
    follows_q(&clip.measured, 0.0, 1e-9);
}

#[test]
fn gains_sines_and_motions_in_a_row_are_no_positions_and_the_later_of_two_is_what_the_arm_did() {
    let lag = 0.04;
    // Abbreviations that no list of words has.
    let mut columns = time();
    columns.extend(seven("JntPosGrbl", q));
    columns.extend(seven("JntPosWxyv", move |j, t| q(j, t - lag)));
    columns.extend(seven("JntRigid", |j, _| 600.0 - j as f64));
    let lab = Lab::of("axes.csv", table(&columns, 300, DT));
    let notes = lab.done();
    let clip = lab.clips().remove(0);
    follows_q(&clip.measured, lag, 1e-9);
    follows_q(&clip.desired, 0.0, 1e-9);
    let told = why(&notes, "measured.q");
    assert!(told.contains("`JntPosWxyv`") && told.contains("`JntRigid` of `rows`: the same in every row"), "{told}");
    // Neither leads: it is asked, and both are named.
    let mut columns = time();
    columns.extend(seven("JntPosGrbl", q));
    columns.extend(seven("JntPosWxyv", |j, t| q(j, t) + 0.01 * (7.0 * t).sin()));
    let lab = Lab::of("axes.csv", table(&columns, 300, DT));
    let (open, notes) = lab.asked(None);
    assert_eq!(open[0], "measured.q");
    let told = why(&notes, "measured.q");
    assert!(told.contains("`JntPosGrbl`") && told.contains("`JntPosWxyv`"), "{told}");
    // Names say what is a position, and numbers that another column is the integral of the velocities.
    let mut columns = time();
    columns.extend(seven("pos_a", q));
    columns.extend(seven("pos_b", |j, t| (3.0 * q(6 - j, t)).cos()));
    columns.extend(seven("vel", |j, t| 57.3 * dq(j, t)));
    let lab = Lab::of("one.csv", table(&columns, 300, DT));
    lab.done();
    follows_q(&lab.clips()[0].measured, 0.0, 1e-9);
}

#[test]
fn arrays_of_many_motions_are_a_clip_of_each() {
    let at = |run: usize, row: usize| 2.5 * (run * 3 % 40) as f64 + row as f64 * DT;
    let of = |value: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..40).flat_map(|run| (0..50).map(move |row| at(run, row))).map(value).collect()
    };
    // A motion in each row of an array a joint, and an array of runs, rows and joints.
    let a_joint_each = (0..7).map(|joint| (format!("q{}", joint + 1), vec![40, 50], of(&|t| q(joint, t))));
    let mut by_joint: Vec<_> = a_joint_each.collect();
    let mut stacked = vec![("q".to_owned(), vec![40, 50, 7], Vec::new())];
    for t in of(&|t| t) {
        stacked[0].2.extend((0..7).map(|joint| q(joint, t)));
    }
    for arrays in [&mut by_joint, &mut stacked] {
        arrays.push(("time".to_owned(), vec![40, 50], of(&|t| t)));
        arrays.push(("label".to_owned(), vec![40], vec![1.0; 40]));
        let lab = Lab::of("motions.npz", npz_of(arrays));
        let notes = lab.done();
        assert!(why(&notes, "log").contains("40 "), "{notes:?}");
        let clips = lab.clips();
        assert_eq!((clips.len(), clips[7].measured.len()), (40, 50));
        for (run, clip) in clips.iter().enumerate() {
            let off = |row: usize, joint: usize| (clip.measured.q_row(row)[joint] - q(joint, at(run, row))).abs();
            assert!((0..50).all(|row| off(row, 0) < 1e-9 && off(row, 6) < 1e-9), "motion {run}");
        }
    }
}

#[test]
fn commands_that_were_converted_twice_are_brought_to_the_unit_of_the_joints() {
    for (scale, line) in [(1.0_f64.to_radians(), "desired.q_factor"), (1.0_f64.to_degrees(), "desired.q_unit")] {
        let mut columns = time();
        columns.extend(seven("q", |j, t| 0.05 * q(j, t - 0.03)));
        columns.extend(seven("target", move |j, t| scale * 0.05 * q(j, t)));
        let lab = Lab::of("targets.csv", table(&columns, 300, DT));
        let notes = lab.done();
        assert!(why(&notes, line).contains("57.3 times"), "{notes:?}");
        let clip = lab.clips().remove(0);
        let off = |row: usize| (clip.desired.q_row(row)[3] - 0.05 * q(3, row as f64 * DT)).abs();
        assert!((0..300).all(|row| off(row) < 1e-9), "{}", off(0));
    }
}

#[test]
fn a_factor_mends_one_joint_or_a_whole_signal() {
    let mut columns = time();
    columns.extend(seven("q", q));
    columns.extend(seven("tau", |j, t| 1000.0 * if j == 3 { -q(j, t) } else { q(j, t) }));
    let lab = Lab::of("torques.csv", table(&columns, 100, DT));
    lab.done();
    let session = lab.path("session");
    let text = std::fs::read_to_string(session.join("import.toml")).expect("import.toml");
    let mapping = lab.path("mended.toml");
    std::fs::remove_dir_all(&session).expect("a session");
    let with = |line: &str| {
        let text = text.replace("torque = \"not_known\"", &format!("torque = \"with_gravity\"\n{line}"));
        std::fs::write(&mapping, text).expect("room");
        lab.import(Some(&mapping), None)
    };
    for (line, told) in [
        ("tau_factor = [1.0, -1.0]", "2 numbers for 7 joints"),
        ("tau_factor = 0.0", "nothing is left"),
        ("tau_factor = \"mN m\"", "a number"),
        ("sign = [1.0]", "1 numbers for 7 joints"),
    ] {
        let error = with(line).expect_err(line).to_string();
        assert!(error.contains(told) && !session.exists(), "{line}: {error}");
    }
    with("tau_factor = [0.001, 0.001, 0.001, -0.001, 0.001, 0.001, 0.001]").expect("a factor");
    let clip = lab.clips().remove(0);
    let tau = clip.measured.tau_row(20).expect("torques");
    assert!((0..7).all(|j| (tau[j] - q(j, 0.2)).abs() < 1e-9), "{tau:?}");
    assert_eq!(Factor::default().of(3), 1.0);
}

#[test]
fn one_long_log_is_a_clip_of_each_motion_unless_import_toml_says_otherwise() {
    // Seven seconds of motion, then one of rest, nine times.
    let of = |joint: usize, t: f64| {
        let (number, within) = ((t / 8.0).floor(), (t % 8.0).min(7.0));
        0.1 * number + (0.2 + 0.05 * joint as f64) * (std::f64::consts::PI * within / 7.0).sin().powi(2)
    };
    let mut columns = time();
    columns.extend(seven("q", move |j, t| of(j, (t - 0.02).max(0.0))));
    columns.extend(seven("q_d", of));
    let lab = Lab::of("long.csv", table(&columns, 7200, DT));
    let notes = lab.done();
    assert!(why(&notes, "pieces").contains("rests between motions"), "{notes:?}");
    let clips = lab.clips();
    assert_eq!(clips.len(), 9);
    assert_eq!(clips.iter().map(|clip| clip.measured.len()).sum::<usize>(), 7200);
    let session = lab.path("session");
    let text = std::fs::read_to_string(session.join("import.toml")).expect("import.toml");
    let mapping = lab.path("whole.toml");
    std::fs::write(&mapping, text.replace("pieces = \"at_rests\"", "pieces = \"whole\"")).expect("room");
    std::fs::remove_dir_all(&session).expect("a session");
    lab.import(Some(&mapping), None).expect("the same log");
    assert_eq!(lab.clips().len(), 1);
}
