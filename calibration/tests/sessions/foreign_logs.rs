//! Logs of other programs through `init`, `import` and `check`, as their users type them: what was not measured is not explained,
//! and what the numbers do not tell is not acted upon.

use serde_json::Value;
use shared_mem::msg::joints_from;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;
use twin::arm::ArmModel;

const JOINTS: usize = 4;

/// An arm that stands upright; `limit`: the last attributes of its limits.
fn urdf(limit: &str) -> String {
    let link = |name: &str, mass: f64| {
        format!(
            "<link name='{name}'><inertial><origin xyz='0 0 0.1'/><mass value='{mass}'/><inertia ixx='0.02' ixy='0' ixz='0' \
             iyy='0.02' iyz='0' izz='0.01'/></inertial></link>"
        )
    };
    let joint = |number: usize, axis: &str, parent: &str, child: &str| {
        format!(
            "<joint name='j{number}' type='revolute'><origin xyz='0 0 0.22'/><parent link='{parent}'/><child link='{child}'/>\
             <axis xyz='{axis}'/><limit lower='-2.9' upper='2.9' {limit}/></joint>"
        )
    };
    let links: String =
        [("a", 3.5), ("b", 2.8), ("c", 1.2), ("d", 0.7)].iter().map(|(name, mass)| link(name, *mass)).collect();
    format!(
        "<robot name='made'><link name='base'/>{links}{}{}{}{}</robot>",
        joint(1, "0 0 1", "base", "a"),
        joint(2, "0 1 0", "a", "b"),
        joint(3, "0 1 0", "b", "c"),
        joint(4, "1 0 0", "c", "d")
    )
}

fn calibration(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibration"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the binary runs")
}

/// A folder with the arm's cell.toml.
fn lab() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("arm.urdf"), urdf("effort='40' velocity='2'")).expect("room");
    assert!(calibration(folder.path(), &["init", "--urdf", "arm.urdf", "--out", "cell.toml"]).status.success());
    folder
}

type Row = [f64; JOINTS];

/// A log of so many seconds and rows a second: what is commanded, what is measured, and its torques.
fn log(folder: &Path, (seconds, rate): (f64, f64), row: impl Fn(f64) -> (Row, Row, Option<Row>)) {
    let mut text = "time".to_owned();
    let with_torques = row(0.0).2.is_some();
    for name in ["q", "q_d"].iter().chain(with_torques.then_some(&"tau")) {
        (0..JOINTS).for_each(|j| write!(text, ",{name}{j}").expect("room"));
    }
    for i in 0..(seconds * rate) as usize {
        let t = i as f64 / rate;
        let (told, done, tau) = row(t);
        write!(text, "\n{t:.5}").expect("room");
        for value in done.iter().chain(&told).chain(tau.iter().flatten()) {
            write!(text, ",{value:.6}").expect("room");
        }
    }
    std::fs::write(folder.join("log.csv"), text + "\n").expect("room");
}

/// A motion that goes forth and back, and its velocities.
fn waves(t: f64) -> [Row; 2] {
    let wave = |j: usize, t: f64| 0.7 * ((0.9 + 0.23 * j as f64) * t + j as f64).sin() + 0.1 * (2.9 * t).sin();
    [std::array::from_fn(|j| wave(j, t)), std::array::from_fn(|j| (wave(j, t + 1e-4) - wave(j, t - 1e-4)) / 2e-4)]
}

/// Noise of one size [1].
fn noise(t: f64, joint: usize) -> f64 {
    2.0 * ((t * 7919.7 + joint as f64 * 78.233).sin() * 43_758.545).fract()
}

/// Torques of the arm under a free fall in the base frame, with dry friction of 0.3 N m, and a factor a joint.
fn torques(falls: [f64; 3], factors: Row) -> impl Fn(f64) -> (Row, Row, Option<Row>) {
    let arm = ArmModel::from_urdf(&urdf("effort='40' velocity='2'"), Path::new("arm.urdf"), &[]).expect("an arm");
    move |t| {
        let [q, dq] = waves(t);
        let weight = arm.holding(&joints_from(&q), falls);
        let tau = std::array::from_fn(|j| factors[j] * (weight[j] + 0.3 * (dq[j] / 0.01).tanh()) + 0.02 * noise(t, j));
        (waves(t + 0.0304)[0], q, Some(tau))
    }
}

/// What `import` says, the import.toml of the session, and what `check` finds.
fn imported(folder: &Path, more: &[&str]) -> (String, String, Value) {
    let base = ["import", "log.csv", "--out", "session", "--cell", "./cell.toml", "--force"];
    let output = calibration(folder, &[&base[..], more].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let mapping = std::fs::read_to_string(folder.join("session/import.toml")).expect("written");
    let checked = calibration(folder, &["check", "session", "--json"]);
    (said, mapping, serde_json::from_slice(&checked.stdout).expect("JSON"))
}

fn faults(checked: &Value) -> Vec<&str> {
    checked["remarks"].as_array().expect("a list").iter().filter_map(|remark| remark["fault"].as_str()).collect()
}

/// What `check` says under a fault.
fn what<'a>(checked: &'a Value, fault: &str) -> &'a str {
    let remarks = checked["remarks"].as_array().expect("a list");
    let found = remarks.iter().find(|remark| remark["fault"] == fault);
    found.unwrap_or_else(|| panic!("no {fault} in {remarks:?}"))["what"].as_str().expect("a sentence")
}

#[test]
fn an_arm_that_hangs_on_its_side_is_said_to_before_anything_is_added() {
    let lab = lab();
    log(lab.path(), (20.0, 100.0), torques([9.81, 0.0, 0.0], [1.0; JOINTS]));
    let (said, mapping, checked) = imported(lab.path(), &[]);
    assert!(said.contains("along +x of the base by 9.8") && !said.contains("was added"), "{said}");
    assert!(mapping.contains("torque = \"with_gravity\""), "{mapping}");
    assert!(what(&checked, "gravity_direction").contains("along +x of the base by 9.8"), "{checked}");
    // Of the model as it stands all of it, and nothing odd.
    log(lab.path(), (20.0, 100.0), torques([0.0, 0.0, -9.81], [1.0; JOINTS]));
    let (said, _, checked) = imported(lab.path(), &[]);
    assert!(said.contains("100 % of the model's gravity shows"), "{said}");
    assert!(faults(&checked).is_empty(), "{checked}");
    // None of it: the model's is added, and that is what is said.
    log(lab.path(), (20.0, 100.0), torques([0.0; 3], [1.0; JOINTS]));
    let (said, mapping, _) = imported(lab.path(), &[]);
    assert!(said.contains("no weight along any other axis") && said.contains("was added"), "{said}");
    assert!(mapping.contains("torque = \"without_gravity\""), "{mapping}");
}

#[test]
fn a_turned_torque_and_a_missing_constant_are_named() {
    let lab = lab();
    log(lab.path(), (20.0, 100.0), torques([0.0, 0.0, -9.81], [1.0, 1.0, -1.0, 1.0]));
    let (said, mapping, _) = imported(lab.path(), &[]);
    assert!(said.contains("torque of joint 3") && said.contains("other way round"), "{said}");
    let given = mapping.replace("torque = \"not_known\"", "torque = \"with_gravity\"");
    std::fs::write(lab.path().join("given.toml"), given).expect("room");
    let (_, _, checked) = imported(lab.path(), &["--mapping", "given.toml"]);
    assert!(what(&checked, "torque_unit").contains("joint 3"), "{checked}");
    log(lab.path(), (20.0, 100.0), torques([0.0, 0.0, -9.81], [0.08; JOINTS]));
    let (said, ..) = imported(lab.path(), &[]);
    assert!(said.contains("torque constant"), "{said}");
}

#[test]
fn efforts_of_zeros_are_no_torques_and_said_once() {
    let lab = lab();
    for value in [0.0, f64::NAN, 1.25] {
        log(lab.path(), (6.0, 100.0), |t| (waves(t + 0.0304)[0], waves(t)[0], Some([value; JOINTS])));
        let (said, mapping, checked) = imported(lab.path(), &[]);
        let words = if value.is_nan() { "`tau` of `rows`: it holds no number" } else { "no torques" };
        assert_eq!(said.matches(words).count(), 1, "{said}");
        assert!(mapping.contains("tau = []") && !said.contains("gravity"), "{said}");
        assert!(faults(&checked).is_empty(), "{checked}");
    }
    log(lab.path(), (6.0, 100.0), |t| (waves(t + 0.0304)[0], waves(t)[0], Some([0.0; JOINTS])));
    let (_, mapping, _) = imported(lab.path(), &[]);
    // Whoever says that gravity was taken off does not make torques of them.
    let (before, after) = mapping.split_once("tau = []").expect("the measured block");
    let after = after.replacen("torque = \"not_known\"", "torque = \"without_gravity\"", 1);
    let given = format!("{before}tau = [\"tau0\", \"tau1\", \"tau2\", \"tau3\"]{after}");
    std::fs::write(lab.path().join("given.toml"), given).expect("room");
    let (said, ..) = imported(lab.path(), &["--mapping", "given.toml"]);
    assert!(said.contains("0 in all 600 rows") && !said.contains("was added"), "{said}");
}

#[test]
fn one_slow_stroke_that_leads_its_commands_is_not_shifted_by_the_edge_of_a_search() {
    let lab = lab();
    let stroke = |t: f64| -> Row {
        std::array::from_fn(|j| -1.2 + 0.02 * j as f64 + (0.3 - 0.02 * j as f64) * t + 0.13 * t * t)
    };
    log(lab.path(), (2.3, 1000.0), |t| {
        let done = stroke(t + 0.05);
        (stroke(t), std::array::from_fn(|j| done[j] + 1e-4 * noise(t, j)), None)
    });
    let (said, mapping, checked) = imported(lab.path(), &[]);
    assert!(said.contains("nothing is shifted"), "{said}");
    assert!(mapping.contains("shift = 0.0\n") && !mapping.contains("shift = -"), "{mapping}");
    let lag = &checked["clips"][0]["lag"];
    let ends = [0, 1].map(|end| lag["interval"][end].as_f64().expect("a number"));
    assert!((ends[0]..=ends[1]).contains(&-0.05) && ends[1] < 0.0, "{lag}");
    assert!(what(&checked, "misaligned_logs").contains("before it is commanded"), "{checked}");
}

#[test]
fn commands_that_are_the_measurements_and_an_arm_that_leads_cannot_be() {
    let lab = lab();
    log(lab.path(), (8.0, 200.0), |t| (waves(t)[0], waves(t)[0], None));
    let (_, _, checked) = imported(lab.path(), &[]);
    assert_eq!(faults(&checked), ["copied_commands"], "{checked}");
    log(lab.path(), (8.0, 200.0), |t| (waves(t - 0.045)[0], waves(t)[0], None));
    let (said, mapping, _) = imported(lab.path(), &[]);
    assert!(said.contains("45 ms before its commands") && mapping.contains("shift = -0.045"), "{said}");
    let given = mapping.replace("shift = -0.045", "shift = 0.0");
    std::fs::write(lab.path().join("given.toml"), given).expect("room");
    let (_, _, checked) = imported(lab.path(), &["--mapping", "given.toml"]);
    assert!(what(&checked, "misaligned_logs").contains("45 ms before"), "{checked}");
}

#[test]
fn limits_of_zero_or_none_are_remarked_by_init_with_what_is_taken() {
    for limit in ["effort='0' velocity='0'", "", "effort='0.0'"] {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("arm.urdf"), urdf(limit)).expect("room");
        let output = calibration(folder.path(), &["init", "--urdf", "arm.urdf", "--out", "cell.toml"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{limit}: {said}");
        for word in [
            "no finite `effort` above 0 for j1, j2, j3, j4",
            "no finite `velocity` above 0 for j1",
            "no limit is taken",
        ] {
            assert!(said.contains(word), "{limit}: {said}");
        }
    }
}
