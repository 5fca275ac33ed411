//! `twin shadow` as a person meets it: exit codes, one line of advice, one JSON object. Each test has its own
//! shared-memory domain, so none meets another or a running cell.

use std::path::PathBuf;
use std::process::{Command, Output};

fn shadow(domain: &str, arguments: &[&str]) -> Output {
    let config = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../config");
    Command::new(env!("CARGO_BIN_EXE_twin"))
        .arg("shadow")
        .args(arguments)
        .current_dir(config)
        .env("TWINALIGN_DOMAIN", format!("{domain}{}", std::process::id()))
        .output()
        .expect("the twin binary")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn without_a_bridge_it_waits_says_so_and_answers_with_empty_figures() {
    let out = shadow("wait", &["--cell", "fr3_cell.toml", "--duration", "1.5", "--json"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("waiting for `rt_bridge run"), "{}", text(&out.stderr));
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    assert_eq!(json["cycles"], 0);
    assert!(json["gap"]["object_add_m"].is_null());
}

#[test]
fn a_missing_cell_is_one_line_with_a_remedy() {
    let out = shadow("cell", &["--cell", "nowhere.toml"]);
    assert_eq!(out.status.code(), Some(1));
    let lines = text(&out.stderr);
    assert_eq!(lines.lines().count(), 1, "{lines}");
    assert!(lines.contains("nowhere.toml") && lines.contains("give the path"), "{lines}");
    assert!(out.stdout.is_empty());
}

#[test]
fn wrong_arguments_end_with_two() {
    assert_eq!(shadow("args", &["--cell", "fr3_cell.toml", "--duration", "-3"]).status.code(), Some(2));
    assert_eq!(shadow("args", &[]).status.code(), Some(2));
}

#[test]
fn the_help_shows_an_example() {
    let help = text(&shadow("help", &["--help"]).stdout);
    assert!(help.contains("twin shadow --cell config/fr3_cell.toml"), "{help}");
}
