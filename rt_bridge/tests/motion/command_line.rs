//! The program from outside: it explains itself, refuses wrong arguments with 2, and fails in one line with 1.

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
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
fn a_number_with_a_unit_is_refused_outside_of_its_range_which_is_told() {
    let run = ["run", "--cell", "cell.toml", "--arm", "sim"];
    let serve = ["serve", "--cell", "cell.toml"];
    let cases: [(&[&str], &str, &str); 9] = [
        (&["grip", "move"], "30", "from 0 to 0.5 [m]"),
        (&["grip", "move"], "-0.01", "from 0 to 0.5 [m]"),
        (&["grip", "grasp"], "nan", "from 0 to 0.5 [m]"),
        (&["grip", "grasp", "0.04"], "--force=1e9", "from 0.1 to 500 [N]"),
        (&["grip", "move", "0.04"], "--speed=inf", "from 0.001 to 1 [m/s]"),
        (&run, "--duration=-1", "from 0.001 to 10000000 [s]"),
        (&["record", "--out", "clip.mcap"], "--wait=1e30", "from 0.001 to 10000000 [s]"),
        (&serve, "--port=65536", "from 0 to 65535"),
        (&serve, "--hand-port=-1", "from 0 to 65535"),
    ];
    for (common, wrong, allowed) in cases {
        let end = rt_bridge(&[common, &[wrong]].concat());
        assert_eq!(end.status.code(), Some(2), "{common:?} {wrong}");
        assert!(text(&end.stderr).contains(allowed), "{common:?} {wrong}: {}", text(&end.stderr));
    }
}

#[test]
fn a_recording_of_nothing_is_an_error_with_the_command_that_starts_a_bridge_and_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("clip.mcap");
    for limit in ["--wait", "--duration"] {
        let end = Command::new(env!("CARGO_BIN_EXE_rt_bridge"))
            .env("TWINALIGN_DOMAIN", format!("silent{}", std::process::id()))
            .args(["record", limit, "0.3", "--json", "--out"])
            .arg(&clip)
            .output()
            .expect("the program runs");
        let said = text(&end.stderr);
        assert_eq!(end.status.code(), Some(1), "{limit}: {said}");
        assert!(said.contains("nothing was sent within 0.") && said.contains("`rt_bridge run --cell"), "{said}");
        assert!(said.trim_end().lines().count() == 1 && end.stdout.is_empty() && !clip.exists(), "{limit}: {said}");
    }
}

#[test]
#[cfg(not(feature = "realsense"))]
fn a_program_without_librealsense_says_how_to_get_it_of_a_recording_that_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let bag = folder.path().join("table.bag");
    for words in ["cannot read", "--features realsense"] {
        let end = rt_bridge(&["convert", &bag.display().to_string(), "--out", "/nowhere/table.mcap"]);
        assert_eq!(end.status.code(), Some(1));
        let said = text(&end.stderr);
        assert!(said.contains(words) && said.trim_end().lines().count() == 1, "{said}");
        std::fs::write(&bag, "").expect("room");
    }
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
    assert!(report["communication_constraints_violation"].is_array(), "{report}");
    let ready = report["ready"].as_bool().expect("ready");
    assert_eq!((ready, end.status.code()), (report["conclusion"] == "ready", Some(i32::from(!ready))), "{report}");
}

#[test]
fn the_doctor_ends_in_one_line_and_a_robot_that_does_not_answer_is_named_there() {
    let end = rt_bridge(&["doctor", "--arm", "fci://127.0.0.1:1"]);
    let said = text(&end.stdout);
    let last = said.lines().last().unwrap_or_default();
    assert!(last.starts_with("not ready: ") && last.contains("robot ("), "{said}");
    assert_eq!((end.status.code(), text(&end.stderr)), (Some(1), String::new()));
}

/// Whoever may write in the folder, or owns a file under a name of ours, could stop a bridge at any moment.
#[test]
fn what_other_users_may_write_or_put_in_the_way_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = format!("foreign-{}", std::process::id());
    let start = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rt_bridge"));
        command.args(arguments).env("XDG_RUNTIME_DIR", folder.path()).env("TWINALIGN_DOMAIN", &domain);
        command.output().expect("the program runs")
    };
    let cell = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/fr3_cell.toml");
    let refusal = || {
        let end = start(&["run", "--cell", cell, "--arm", "sim", "--realtime", "ignore", "--duration", "1"]);
        assert_eq!(end.status.code(), Some(1), "{}", text(&end.stderr));
        text(&end.stderr).lines().last().unwrap_or_default().to_owned()
    };
    let mode = |mode| fs::set_permissions(folder.path(), Permissions::from_mode(mode)).expect("its mode");
    mode(0o777);
    let said = refusal();
    assert!(said.contains("can be written by others (mode 777)") && said.contains("`chmod go-w /"), "{said}");
    mode(0o700);
    if fs::metadata(folder.path()).expect("a folder").uid() != 0 {
        return; // only root can give files away
    }
    let file = format!("/dev/shm/twinalign_0_{domain}_node");
    fs::write(&file, "").expect("a file");
    chown(&file, Some(12_345), None).expect("given away");
    let said = refusal();
    let report: serde_json::Value =
        serde_json::from_slice(&start(&["doctor", "--json"]).stdout).expect("one JSON object");
    fs::remove_file(&file).expect("removed");
    assert!(said.contains(&format!("{file} belongs to user 12345, not to user 0; have that user")), "{said}");
    let findings = report["findings"].as_array().expect("findings");
    let others = findings.iter().find(|finding| finding["check"] == "other users").expect("a look at other users");
    assert!(others["remedy"].as_str().is_some_and(|remedy| remedy.contains(&format!("`sudo rm {file}`"))), "{others}");
    assert_eq!(
        start(&["run", "--cell", cell, "--arm", "sim", "--realtime", "ignore", "--duration", "0.2"]).status.code(),
        Some(0)
    );
}
