//! Names as programs give them to columns, topics and files, units in brackets among them: what was measured and what was commanded is
//! found whatever it is called, and asked where nothing tells.

use crate::lab;
use crate::written::{Signal, table};
use import::{AngleUnit, Mapping, Note, Order, Outcome, import};
use shared_mem::recording::{Clip, JointSeries, Session};
use std::path::{Path, PathBuf};

const DT: f64 = 0.01;
const LAG: f64 = 0.04;
const JOINTS: usize = 4;
const ROWS: u32 = 600;

/// Position of a joint of a made-up arm [rad].
fn q(joint: usize, t: f64) -> f64 {
    [0.4, -0.7, 1.2, -1.6][joint] + 0.3 * ((2.0 + 0.5 * joint as f64) * t).sin()
}

fn dq(joint: usize, t: f64) -> f64 {
    let w = 2.0 + 0.5 * joint as f64;
    0.3 * w * (w * t).cos()
}

/// A column of each joint, `#` standing for its number from 1 on.
fn columns(name: &str, of: impl Fn(usize, f64) -> f64 + Copy + 'static) -> Vec<(String, Signal)> {
    let one =
        |joint: usize| (name.replace('#', &(joint + 1).to_string()), Box::new(move |t: f64| of(joint, t)) as Signal);
    (0..JOINTS).map(one).collect()
}

fn time() -> Vec<(String, Signal)> {
    vec![("t".to_owned(), Box::new(|t| t))]
}

/// Imports files of one folder; what was asked of it lies beside it.
struct Lab(tempfile::TempDir);

impl Lab {
    fn of(files: &[(&str, String)]) -> Self {
        let lab = Self(tempfile::tempdir().expect("a folder"));
        std::fs::create_dir(lab.path("logs")).expect("room");
        for (name, text) in files {
            std::fs::write(lab.path("logs").join(name), text).expect("room");
        }
        lab
    }

    fn rows(columns: &[(String, Signal)]) -> Self {
        Self::of(&[("a.csv", table(columns, ROWS, DT))])
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn import(&self, mapping: Option<&Path>) -> Outcome {
        let (files, out, questions) = ([self.path("logs")], self.path("session"), self.path("import.toml"));
        import(Order { mapping, ..lab::order(&files, &out, &questions) }, |_, _| {}).expect("a log")
    }

    fn done(&self) -> (Clip, Vec<Note>) {
        match self.import(None) {
            Outcome::Done { notes, .. } => (self.clip(), notes),
            Outcome::Open { notes, .. } => panic!("open: {notes:?}"),
        }
    }

    fn clip(&self) -> Clip {
        let session = Session::open(&self.path("session")).expect("a session");
        session.read(&session.clips[0]).expect("a clip")
    }

    fn asked(&self) -> Vec<String> {
        match self.import(None) {
            Outcome::Done { notes, .. } => panic!("nothing was asked: {notes:?}"),
            Outcome::Open { notes, .. } => notes.into_iter().filter(|note| note.open).map(|note| note.line).collect(),
        }
    }
}

/// Holds rows against the arm's motion, so much later.
fn follows_q(name: &str, series: &JointSeries, lag: f64) {
    assert!(series.len() > 100 && series.dof == JOINTS, "{name}: {} rows of {}", series.len(), series.dof);
    for row in 0..series.len() {
        let t = (series.stamps_ns[row] - series.stamps_ns[0]) as f64 * 1e-9 - lag;
        for (joint, found) in series.q_row(row).iter().enumerate() {
            assert!(
                (found - q(joint, t)).abs() < 1e-6,
                "{name}: row {row}, joint {joint}: {found} for {}",
                q(joint, t)
            );
        }
    }
}

#[test]
fn commands_and_states_are_found_whatever_they_are_called() {
    let degrees = 360.0 / std::f64::consts::TAU;
    for (measured, commanded, scale) in [
        ("q_meas#", "q#", 1.0),
        ("j#_pos", "j#_cmd_pos", 1.0),
        ("motor#_position", "motor#_goal_position", 1.0),
        ("state.joint#.pos", "command.joint#.pos", 1.0),
        ("/joint_states/a#/position", "/joint_commands/a#/position", 1.0),
        ("q#", "qd#", 1.0),
        ("q#", "qdes#", 1.0),
        ("q#(t)", "qd#(t)", 1.0),
        ("q#", "qr#", 1.0),
        ("q# [deg]", "q#_des [deg]", degrees),
        ("J#_act [deg]", "J#_cmd [deg]", degrees),
        ("Achse # Ist [°]", "Achse # Soll [°]", degrees),
        ("Axis#.ActPos", "Axis#.SetPos", 1.0),
        ("A#_Ist [°]", "A#_Soll [°]", degrees),
    ] {
        let mut all = time();
        all.extend(columns(commanded, move |j, t| scale * q(j, t)));
        all.extend(columns(measured, move |j, t| scale * q(j, t - LAG)));
        let (clip, notes) = Lab::rows(&all).done();
        follows_q(&format!("{measured}: {notes:?}"), &clip.measured, LAG);
        follows_q(&format!("{commanded}: {notes:?}"), &clip.desired, 0.0);
    }
}

#[test]
fn commands_without_a_name_do_not_take_the_velocities_that_were_measured() {
    let mut all = time();
    all.extend(columns("pos#", |j, t| q(j, t - LAG)));
    all.extend(columns("vel#", |j, t| dq(j, t - LAG)));
    all.extend(columns("input_pos#", q));
    let lab = Lab::rows(&all);
    let (clip, _) = lab.done();
    follows_q("input_pos", &clip.desired, 0.0);
    assert!(clip.measured.dq_row(3).is_some() && clip.desired.dq_row(3).is_none());
}

#[test]
fn numbers_that_come_out_of_others_are_not_what_was_measured() {
    let mut all = time();
    all.extend(columns("q_raw#", |j, t| q(j, t - LAG)));
    all.extend(columns("q_filt#", |j, t| q(j, t - LAG - 0.03)));
    all.extend(columns("q_cmd#", q));
    follows_q("q_raw", &Lab::rows(&all).done().0.measured, LAG);
}

#[test]
fn a_unit_in_the_name_counts_and_one_that_nothing_tells_is_asked_for() {
    let small = |j: usize, t: f64| 0.02 * q(j, t) * 57.29577951308232;
    let mut all = time();
    all.extend(columns("q_deg_#", small));
    let lab = Lab::rows(&all);
    let (clip, _) = lab.done();
    assert!((clip.measured.q_row(0)[1] - 0.02 * q(1, 0.0)).abs() < 1e-6, "{:?}", clip.measured.q_row(0));
    let turning: fn(usize, f64) -> f64 = |j, t| q(j, t) + if j == 3 { 3.0 * t } else { 0.0 };
    let counts: fn(usize, f64) -> f64 = |j, t| (q(j, t) * 4096.0 / std::f64::consts::TAU + 2048.0).round();
    for of in [counts, turning] {
        let mut all = time();
        all.extend(columns("q#", of));
        let lab = Lab::rows(&all);
        assert_eq!(lab.asked(), ["measured.q_unit"]);
        if of(0, 0.0) > 100.0 {
            continue;
        }
        let file = lab.path("import.toml");
        let text = std::fs::read_to_string(&file).expect("questions");
        std::fs::write(&file, text.replace("q_unit = \"not_known\"", "q_unit = \"rad\"")).expect("room");
        assert!(matches!(lab.import(Some(&file)), Outcome::Done { .. }));
        assert!((lab.clip().measured.q_row(7)[2] - of(2, 0.07)).abs() < 1e-6);
    }
}

#[test]
fn columns_that_a_person_fills_in_get_the_unit_that_their_numbers_tell() {
    let mut all = time();
    all.extend(columns("foo#", |j, t| 57.29577951308232 * q(j, t)));
    let lab = Lab::rows(&all);
    assert!(lab.asked().contains(&"measured.q".to_owned()));
    let file = lab.path("import.toml");
    let text = std::fs::read_to_string(&file).expect("questions");
    assert!(!text.contains("q_unit"), "{text}");
    let text = text.replacen("q = []", "q = [\"foo1\", \"foo2\", \"foo3\", \"foo4\"]", 1);
    let text = text.split("[desired]").next().expect("a text").to_owned();
    std::fs::write(&file, text).expect("room");
    assert!(matches!(lab.import(Some(&file)), Outcome::Done { .. }));
    follows_q("foo", &lab.clip().measured, 0.0);
    let written = Mapping::read(&lab.path("session/import.toml")).expect("a mapping");
    assert_eq!(written.measured.expect("a block").q_unit, AngleUnit::Degree);
}

#[test]
fn a_column_that_counts_rows_is_no_clock_of_milliseconds() {
    let with = |velocities: bool| {
        let mut all: Vec<(String, Signal)> = vec![("t".to_owned(), Box::new(|t| (t / DT).round()))];
        all.extend(columns("q#", q));
        all.extend(columns("dq#", dq).into_iter().filter(|_| velocities));
        Lab::rows(&all)
    };
    follows_q("t", &with(true).done().0.measured, 0.0);
    assert_eq!(with(false).asked(), ["measured.rate"]);
}

#[test]
fn the_states_and_the_commands_of_one_run_in_two_files_are_one_clip() {
    let mut state = time();
    state.extend(columns("q#", |j, t| q(j, t - LAG)));
    let mut command = time();
    command.extend(columns("q#", q));
    let lab = Lab::of(&[("state.csv", table(&state, ROWS, DT)), ("command.csv", table(&command, 2 * ROWS, DT / 2.0))]);
    let (clip, _) = lab.done();
    follows_q("state", &clip.measured, LAG);
    follows_q("command", &clip.desired, 0.0);
}

#[test]
fn a_table_with_a_row_of_each_joint_is_a_table_of_joints() {
    let row = |k: u32| -> String {
        let t = f64::from(k) * DT;
        (0..JOINTS).map(|j| format!("{t},joint_{j},{},{}\n", q(j, t), dq(j, t))).collect()
    };
    let text = "time,joint,position,velocity\n".to_owned() + &(0..ROWS).map(row).collect::<String>();
    let (clip, _) = Lab::of(&[("a.csv", text)]).done();
    follows_q("long", &clip.measured, 0.0);
    assert!(clip.measured.dq_row(3).is_some());
}

#[test]
fn a_hand_or_a_base_is_no_arm() {
    for name in ["cart_pos#", "flange_position_#", "end_effector_position_#", "base_theta_#"] {
        let mut all = time();
        all.extend(columns(name, q));
        assert!(Lab::rows(&all).asked().contains(&"measured.q".to_owned()), "{name}");
    }
    let mut all = time();
    all.extend(columns("position_#", q).into_iter().take(3));
    all.extend(columns("orientation_#", q).into_iter().take(3));
    assert!(Lab::rows(&all).asked().contains(&"measured.q".to_owned()));
}
