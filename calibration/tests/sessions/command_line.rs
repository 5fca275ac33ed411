//! The command line as its users meet it: help that teaches, wrong arguments that are refused.

use std::process::{Command, Output};

fn calibration(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibration")).args(arguments).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

#[test]
fn every_verb_teaches_with_an_example() {
    for verb in [&["capture", "excitation"][..], &["demo"]] {
        let output = calibration(&[verb, &["--help"]].concat());
        let example = format!("calibration {}", verb.join(" "));
        let help = text(&output.stdout);
        assert!(output.status.success());
        let examples = help.split_once("Examples:").unwrap_or_else(|| panic!("no examples in:\n{help}")).1;
        assert!(examples.contains(&example), "no example of `{example}` in:\n{help}");
    }
}

#[test]
fn wrong_arguments_exit_with_2_and_say_what_is_allowed() {
    let common = ["capture", "excitation", "--cell", "cell.toml", "--out", "session", "--clips"];
    let viewpoint = ["viewpoint", "photo.png"];
    let cases: [(&[&str], &[&str], &str); 7] = [
        (&common, &["0"], "from 1 to 1000"),
        (&common, &["1", "--amplitude", "7"], "from 0.01 to 1.5 [rad]"),
        (&common, &["1", "--duration", "nan"], "from 2 to 600 [s]"),
        (&common, &["1", "--frequency", "0.2", "1e9"], "from 0.05 to 50 [Hz]"),
        (&viewpoint, &["--hand", "30"], "from 0 to 0.08 [m]"),
        (&viewpoint, &["--reach", "20,-1"], "from 0 to 180 [degrees]"),
        (&viewpoint, &["--reach", "20,50"], "from 0 to 10 [m]"),
    ];
    for (common, wrong, allowed) in cases {
        let output = calibration(&[common, wrong].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(allowed), "{}", text(&output.stderr));
    }
}

#[test]
fn a_missing_cell_fails_in_one_line_that_names_the_file() {
    let output =
        calibration(&["capture", "excitation", "--cell", "nowhere/cell.toml", "--clips", "1", "--out", "session"]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("nowhere/cell.toml"), "{said}");
}

#[test]
fn a_clip_that_is_not_there_to_be_repeated_leaves_the_folder_as_it_was() {
    let logs = tempfile::tempdir().expect("a folder");
    let (cell, out) = ("../config/fr3_cell.toml", logs.path().display().to_string());
    for verb in ["excitation", "control-hit-slide"] {
        let output = calibration(&["capture", verb, "--cell", cell, "--out", &out, "--repeat", "9"]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("no clip 9 to repeat; it has none"), "{said}");
        assert_eq!(logs.path().read_dir().expect("a folder").count(), 0, "{verb} left something");
    }
}

#[test]
fn two_outputs_that_are_one_file_are_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().join("theta.toml").display().to_string();
    for verb in [&["identify", "arm", "nowhere", "--report", &place][..], &["diagnose", "nowhere"]] {
        let output = calibration(&[verb, &["--out", &place]].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("another output's place; give each a name of its own"), "{said}");
    }
}

#[test]
fn a_policy_in_a_file_says_what_it_lacks_to_be_computed() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("policy.onnx");
    let run = || {
        let policy = file.display().to_string();
        let arguments = ["policy", "run", "--task", "../twin/tasks/push_milk.toml", "--policy", &policy];
        let mut command = Command::new(env!("CARGO_BIN_EXE_calibration"));
        let output = command.args(arguments).env("ORT_DYLIB_PATH", "/nowhere.so").output().expect("it runs");
        assert_eq!(output.status.code(), Some(1));
        text(&output.stderr).to_owned()
    };
    let said = run();
    assert!(said.contains("there is no such file") && said.lines().count() == 1, "{said}");
    std::fs::write(&file, "no model").expect("a file");
    let said = run();
    assert!(said.contains("pip install onnxruntime") && said.lines().count() == 1, "{said}");
}

#[test]
fn a_demo_that_lacks_a_program_leaves_its_folder_for_the_next_call() {
    let folder = tempfile::tempdir().expect("a folder");
    // A program of that name in the folder above is somebody else's.
    std::fs::write(folder.path().join("rt_bridge"), "").expect("a file");
    let alone = folder.path().join("alone");
    std::fs::create_dir(&alone).expect("a folder");
    let [program, out] = ["calibration", "demo"].map(|name| alone.join(name));
    // By another program: a copy that this one writes is busy for as long as a child of another test holds it open.
    let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_calibration")).arg(&program).status().expect("it runs");
    assert!(copied.success());
    let output = Command::new(&program).args(["demo", "--out"]).arg(&out).env("PATH", "").output().expect("it runs");
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(said.contains("cannot find the program `rt_bridge`; build it with"), "{said}");
    assert!(!out.exists(), "written before it is known to work");
}
