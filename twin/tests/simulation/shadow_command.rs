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
fn without_a_bridge_it_waits_as_long_as_it_says_and_fails_with_the_command_that_starts_one() {
    for limit in ["--wait", "--duration"] {
        let out = shadow("wait", &["--cell", "fr3_cell.toml", limit, "1.5", "--json"]);
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{limit}: {said}");
        let expected =
            if limit == "--wait" { "waiting 2 s for `rt_bridge run" } else { "waiting 30 s for `rt_bridge run" };
        assert!(said.contains(expected), "{said}");
        let complaint = said.trim_end().lines().last().expect("a complaint");
        assert!(complaint.contains("no arm state came within 1."), "{complaint}");
        assert!(complaint.contains("`rt_bridge run --cell fr3_cell.toml --arm sim`"), "{complaint}");
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
        assert_eq!(json["cycles"], 0);
        for figure in ["/real_time_factor", "/age_us/p50", "/age_us/max", "/gap/joint_rms_rad", "/gap/object_add_m"] {
            assert!(json.pointer(figure).is_some_and(serde_json::Value::is_null), "{figure}: {json}");
        }
    }
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
    for wrong in ["--duration=-3", "--duration=inf", "--wait=0", "--wait=1e9"] {
        let out = shadow("args", &["--cell", "fr3_cell.toml", wrong]);
        assert_eq!(out.status.code(), Some(2), "{wrong}");
        assert!(text(&out.stderr).contains("from 0.001 to 10000000 [s]"), "{}", text(&out.stderr));
    }
    assert_eq!(shadow("args", &[]).status.code(), Some(2));
}

#[test]
fn the_help_shows_an_example() {
    let help = text(&shadow("help", &["--help"]).stdout);
    assert!(help.contains("twin shadow --cell fr3"), "{help}");
}
