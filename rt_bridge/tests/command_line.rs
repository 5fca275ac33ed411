//! The program from outside: it explains itself, refuses wrong arguments with 2, and fails in one line with 1.
#![allow(missing_docs)]

use std::process::{Command, Output};

fn rt_bridge(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rt_bridge")).args(arguments).output().expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn every_verb_explains_itself_with_an_example() {
    assert_eq!(rt_bridge(&["--version"]).status.code(), Some(0));
    for verb in ["run", "record", "convert", "doctor"] {
        let help = rt_bridge(&[verb, "--help"]);
        assert_eq!(help.status.code(), Some(0), "{verb}");
        assert!(text(&help.stdout).contains(&format!("rt_bridge {verb}")), "{verb} shows no example");
    }
}

#[test]
fn wrong_arguments_exit_with_two_and_name_what_there_is() {
    let camera = rt_bridge(&["run", "--cell", "cell.toml", "--arm", "sim", "--camera", "webcam"]);
    assert_eq!(camera.status.code(), Some(2));
    assert!(text(&camera.stderr).contains("use sim, realsense, bag://FILE.bag"), "{}", text(&camera.stderr));
    let arm = rt_bridge(&["run", "--cell", "cell.toml", "--arm", "172.16.0.2"]);
    assert_eq!(arm.status.code(), Some(2));
    assert!(text(&arm.stderr).contains("fci://172.16.0.2"), "{}", text(&arm.stderr));
}

#[test]
#[cfg(not(feature = "realsense"))]
fn a_program_without_librealsense_says_how_to_get_it() {
    let end = rt_bridge(&["convert", "table.bag", "--out", "/nowhere/table.mcap"]);
    assert_eq!(end.status.code(), Some(1));
    let said = text(&end.stderr);
    assert!(said.contains("--features realsense") && said.trim_end().lines().count() == 1, "{said}");
}

#[test]
fn a_missing_cell_is_one_line_with_the_file() {
    let end = rt_bridge(&["run", "--cell", "/nowhere/cell.toml", "--arm", "sim"]);
    assert_eq!(end.status.code(), Some(1));
    let said = text(&end.stderr);
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    assert!(said.contains("/nowhere/cell.toml") && end.stdout.is_empty(), "{said}");
}

#[test]
fn control_characters_in_names_do_not_reach_the_terminal() {
    let name = "/nowhere/\x1b]0;title\x07\u{9b}2J\nerror: all is well\r.toml";
    let shown = "/nowhere/\\u{1b}]0;title\\u{7}\\u{9b}2J";
    let missing = rt_bridge(&["run", "--cell", name, "--arm", "sim"]);
    let said = text(&missing.stderr);
    assert!(said.contains(&format!("{shown}\\nerror: all is well\\r.toml")), "{said:?}");
    assert_eq!((missing.status.code(), said.lines().count()), (Some(1), 1), "{said:?}");
    let wrong = rt_bridge(&["run", name]);
    let said = text(&wrong.stderr);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(said.contains("nowhere") && !said.contains(|c: char| c.is_control() && c != '\n'), "{said:?}");
}

#[test]
fn the_doctor_answers_with_one_object_of_findings() {
    let end = rt_bridge(&["doctor", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&end.stdout).expect("one JSON object");
    let checks: Vec<_> = report["findings"].as_array().expect("findings").iter().map(|f| &f["check"]).collect();
    for check in ["kernel", "scheduling", "memory lock", "shared memory", "processes", "wake-up"] {
        assert!(checks.iter().any(|c| *c == check), "{check} is not looked at: {checks:?}");
    }
    assert!(report["wake_us"]["p999"].as_f64() > Some(0.0));
}
