//! `calibration init` as it is typed: what flags, a xacro file, a bag and clips make a cell.toml of, and what is refused.

use serde_json::Value;
use shared_mem::cell::Cell;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tests::program_path;
use tests::texts::root;

const ARM: &str = "\
<robot name='arm'>
  <link name='base'/>
  <link name='upper'><inertial><mass value='1.0'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>
  <joint name='shoulder' type='revolute'>
    <parent link='base'/><child link='upper'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='10' velocity='2'/>
  </joint>
</robot>
";

fn run(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(program_path("calibration"));
    command.args(words).current_dir(folder).stdin(Stdio::null()).env("PATH", folder.join("bin"));
    command.output().expect("it runs")
}

fn line(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr.clone()).expect("UTF-8");
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

fn written(folder: &Path, words: &[&str]) -> (Value, Cell) {
    let output = run(folder, &[words, &["--json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let cell = Cell::read(&folder.join(answer["file"].as_str().expect("a file"))).expect("a cell");
    (answer, cell)
}

#[test]
fn a_file_that_is_there_is_kept_and_without_a_terminal_nothing_is_asked() {
    let lab = tempfile::tempdir().expect("a folder");
    let asked = line(&run(lab.path(), &["init"]));
    assert!(asked.contains("--urdf FILE") && asked.contains("--model fr3"), "{asked}");
    let (answer, cell) = written(lab.path(), &["init", "--model", "fr3", "--table", "-0.01"]);
    assert_eq!(cell.table.map(|table| table.height), Some(-0.01));
    assert!(answer["not_known"].as_array().is_some_and(|list| list.contains(&"object".into())), "{answer}");
    let before = std::fs::read(lab.path().join("cell.toml")).expect("the file");
    let kept = line(&run(lab.path(), &["init", "--joints", "a,b"]));
    assert!(kept.contains("cell.toml") && kept.contains("--force"), "{kept}");
    assert_eq!(std::fs::read(lab.path().join("cell.toml")).expect("the file"), before);
    let (_, cell) = written(lab.path(), &["init", "--joints", "a,b", "--force"]);
    assert_eq!(cell.robot.expect("a robot").joints, ["a", "b"]);
}

#[test]
fn a_urdf_is_named_from_the_folder_of_the_file_and_a_xacro_file_is_expanded() {
    let lab = tempfile::tempdir().expect("a folder");
    std::fs::create_dir_all(lab.path().join("bin")).expect("room");
    std::fs::create_dir_all(lab.path().join("cells/robots")).expect("room");
    std::fs::write(lab.path().join("cells/robots/arm.urdf"), ARM).expect("room");
    let (answer, cell) = written(lab.path(), &["init", "--urdf", "cells/robots/arm.urdf", "--out", "cells/cell.toml"]);
    assert_eq!(cell.robot.and_then(|robot| robot.urdf), Some("robots/arm.urdf".into()));
    assert_eq!(answer["urdf"], Value::Null);

    std::fs::write(lab.path().join("arm.xacro"), ARM).expect("room");
    let absent = line(&run(lab.path(), &["init", "--urdf", "arm.xacro"]));
    assert!(
        absent.contains("no program `xacro` is installed") && absent.contains("xacro arm.xacro > arm.urdf"),
        "{absent}"
    );
    // Stands in for ROS's own, which copies where nothing is to be expanded.
    let stand_in = lab.path().join("bin/xacro");
    let mut script = std::fs::File::create(&stand_in).expect("room");
    script.write_all(b"#!/bin/sh\n/bin/cat \"$1\"\n").expect("room");
    drop(script);
    std::fs::set_permissions(&stand_in, std::os::unix::fs::PermissionsExt::from_mode(0o755)).expect("its owner");
    let (answer, cell) = written(lab.path(), &["init", "--urdf", "arm.xacro"]);
    assert_eq!(
        (&answer["urdf"], cell.robot.and_then(|robot| robot.urdf)),
        (&"cell.urdf".into(), Some("cell.urdf".into()))
    );
    assert_eq!(std::fs::read_to_string(lab.path().join("cell.urdf")).expect("the file"), ARM);
}

#[test]
fn a_bag_tells_its_robot_and_its_topics() {
    let lab = tempfile::tempdir().expect("a folder");
    let bag = root().join("shared_mem/import/tests/fixtures/rosbag2_mcap");
    let bag = bag.to_str().expect("UTF-8");
    let (answer, cell) = written(lab.path(), &["init", "--bag", bag]);
    assert_eq!(cell.robot.and_then(|robot| robot.model).as_deref(), Some("fr3"));
    assert_eq!(cell.clips.len(), 1);
    let text = std::fs::read_to_string(lab.path().join("cell.toml")).expect("the file");
    assert!(text.contains("# 50 states/s, 50 commands/s"), "{text}");
    assert!(answer["taken"].to_string().contains("its joint names"), "{answer}");
    // The verbs that need no more than clips and gains run on it as it is.
    let check = run(lab.path(), &["check", "."]);
    assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stderr));
}

#[test]
fn joints_that_recordings_call_otherwise_than_the_urdf_are_taken_by_place() {
    use std::fmt::Write as _;
    let lab = tempfile::tempdir().expect("a folder");
    let mut urdf = String::from("<robot name='arm'><link name='l0'/>");
    for i in 1..=7 {
        let one = ARM.lines().skip(2).take(4).collect::<String>();
        let own = [("base", i - 1), ("upper", i)];
        let one = own.into_iter().fold(one, |text, (name, n)| text.replace(&format!("'{name}'"), &format!("'l{n}'")));
        write!(urdf, "{}", one.replace("shoulder", &format!("axis{i}"))).expect("room");
    }
    std::fs::write(lab.path().join("arm.urdf"), urdf + "</robot>").expect("room");
    let bag = root().join("shared_mem/import/tests/fixtures/rosbag2_mcap");
    let bag = bag.to_str().expect("UTF-8");
    let (answer, cell) = written(lab.path(), &["init", "--urdf", "arm.urdf", "--bag", bag]);
    let recorded: Vec<String> = (1..=7).map(|i| format!("fr3_joint{i}")).collect();
    assert_eq!(cell.robot.expect("a robot").joints, recorded);
    assert!(answer["taken"].to_string().contains("robot.joints"), "{answer}");
    let toml = lab.path().join("cell.toml");
    let text = std::fs::read_to_string(&toml).expect("the file");
    assert!(text.contains("axis1, axis2"), "{text}");
    let replayed = |text: &str| {
        std::fs::write(&toml, text).expect("room");
        let check = run(lab.path(), &["check", ".", "--json"]);
        let page: Value = serde_json::from_slice(&check.stdout).expect("one JSON object");
        let replay = &page["clips"][0]["good_for"][0];
        (replay["good"].clone(), replay["why"].to_string())
    };
    assert_eq!(replayed(&text), (true.into(), "\"\"".to_owned()));
    let unnamed: String =
        text.lines().filter(|line| !line.starts_with("joints")).flat_map(|line| [line, "\n"]).collect();
    let (good, why) = replayed(&unnamed);
    assert!(good == false && why.contains("`joints` beside `urdf`"), "{why}");
}

#[test]
fn the_schema_is_one_json_object_that_names_the_blocks() {
    let lab = tempfile::tempdir().expect("a folder");
    let output = run(lab.path(), &["init", "--schema"]);
    let schema: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert!(output.status.success() && schema["properties"]["controller"].is_object());
    assert!(!lab.path().join("cell.toml").exists());
}

/// Six joints that turn all the way round with 30 N m, and what stands for the seventh.
fn six(more: &str) -> String {
    let link = |name: &str, inertial: &str| format!("<link name='{name}'>{inertial}</link>");
    let solid = "<inertial><origin xyz='0.01 0 0.1'/><mass value='0.8'/><inertia ixx='.004' iyy='.004' izz='.002' ixy='0' ixz='0' iyz='0'/></inertial>";
    let mut urdf = format!("<robot name='six'>{}", link("link_0", ""));
    for k in 1..=6 {
        let axis = if k % 2 == 1 { "0 0 1" } else { "0 1 0" };
        urdf += &link(&format!("link_{k}"), solid);
        urdf += &format!(
            "<joint name='joint_{k}' type='continuous'><origin xyz='0 0 .15'/><parent link='link_{}'/><child link='link_{k}'/><axis \
             xyz='{axis}'/><limit effort='30' velocity='1'/></joint>",
            k - 1
        );
    }
    format!("{urdf}{more}</robot>")
}

#[test]
fn what_hangs_on_the_arm_is_named_and_where_it_cannot_be_told_the_user_says_it() {
    let lab = tempfile::tempdir().expect("a folder");
    let jaw = |name: &str| {
        format!(
            "<link name='l7'/><joint name='{name}' type='revolute'><parent link='link_6'/><child link='l7'/><axis xyz='0 1 0'/><limit lower='0' \
             upper='1.5' effort='2' velocity='1'/></joint>"
        )
    };
    let six_names: Vec<String> = (1..=6).map(|k| format!("joint_{k}")).collect();
    std::fs::write(lab.path().join("arm.urdf"), six(&jaw("finger_joint"))).expect("room");
    let output = run(lab.path(), &["init", "--urdf", "arm.urdf", "--json"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("joint_6; held where they are: finger_joint (named as a finger is)"), "{said}");
    let answer: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(answer["arm"], serde_json::json!(six_names));
    assert_eq!(answer["held"], serde_json::json!([{"joint": "finger_joint", "why": "named as a finger is"}]));

    // What the refusal names can be done where it names it.
    std::fs::write(lab.path().join("arm.urdf"), six(&jaw("joint_7"))).expect("room");
    let refused = line(&run(lab.path(), &["init", "--urdf", "arm.urdf", "--force"]));
    let (_, command) = refused.split_once("`calibration ").expect("a command");
    let (command, _) = command.split_once('`').expect("its end");
    let words: Vec<&str> = command.split(' ').chain(["--force"]).collect();
    let (answer, cell) = written(lab.path(), &words);
    assert_eq!(answer["arm"], serde_json::json!(six_names));
    assert_eq!(cell.robot.as_ref().map(|robot| &robot.joints), Some(&six_names));
    assert_eq!(twin::arm::ArmModel::from_cell(&cell).expect("an arm").dof(), 6);
    let names = six_names.join(",").replace("joint", "q") + ",q_7";
    let refused = line(&run(lab.path(), &["init", "--urdf", "arm.urdf", "--joints", &names, "--force"]));
    assert!(refused.contains("--joints joint_1,"), "other names do not say which: {refused}");
}

#[test]
fn a_joint_that_moves_no_inertia_gets_a_rotor_to_be_filled_in() {
    let lab = tempfile::tempdir().expect("a folder");
    let seventh = |inertial: &str| {
        format!(
            "<link name='l7'>{inertial}</link><joint name='joint_7' type='continuous'><parent link='link_6'/><child link='l7'/><axis \
             xyz='0 0 1'/></joint>"
        )
    };
    let point = "<inertial><origin xyz='0 0 .05'/><mass value='.2'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>";
    for inertial in [point, ""] {
        std::fs::write(lab.path().join("arm.urdf"), six(&seventh(inertial))).expect("room");
        let (answer, cell) = written(lab.path(), &["init", "--urdf", "arm.urdf", "--force"]);
        let warnings = answer["warnings"].to_string();
        assert!(warnings.contains("joint_7 moves no inertia") && warnings.contains("`rotor_inertia`"), "{answer}");
        let rotors = &cell.controller.as_ref().expect("a controller").rotor_inertia;
        assert!(rotors[..6].iter().all(|rotor| *rotor == 0.0) && rotors[6] > 0.0, "{rotors:?}");
        assert_eq!(twin::arm::ArmModel::from_cell(&cell).expect("an arm").dof(), 7);
        let text = std::fs::read_to_string(lab.path().join("cell.toml")).expect("the file");
        assert!(text.contains("# joint_7 moves no inertia in the URDF"), "{text}");
    }
}

#[test]
fn a_motor_that_turns_against_its_joint_has_a_negative_constant() {
    let lab = tempfile::tempdir().expect("a folder");
    let (_, cell) = written(lab.path(), &["init", "--joints", "a,b,c,d"]);
    let text = cell.to_toml().replace("[controller]", "[controller]\ntorque_constant = [32.0, 32.0, 45.0, -48.0]");
    let read = Cell::parse(&text, Path::new("cell.toml")).expect("a cell");
    assert_eq!(read.controller.expect("a controller").torque_constant, [32.0, 32.0, 45.0, -48.0]);
}

#[test]
fn numbers_that_no_arm_has_are_remarked() {
    let lab = tempfile::tempdir().expect("a folder");
    for (limit, said) in [
        ("lower='0' upper='0' effort='10' velocity='2'", "gives shoulder no range"),
        ("lower='1' upper='-1' effort='10' velocity='2'", "above `upper` in <limit> of shoulder"),
        ("lower='-170' upper='170' effort='10' velocity='2'", "limits in degrees"),
        ("lower='-1' upper='1' effort='-10' velocity='inf'", "no finite `effort` above 0 for shoulder"),
    ] {
        let urdf = ARM.replace("lower='-1' upper='1' effort='10' velocity='2'", limit);
        std::fs::write(lab.path().join("arm.urdf"), urdf).expect("room");
        let (answer, _) = written(lab.path(), &["init", "--urdf", "arm.urdf", "--force"]);
        assert!(answer["warnings"].to_string().contains(said), "{limit}: {answer}");
    }
}
