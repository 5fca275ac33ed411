//! A sweep of many small units, killed halfway: what is merged is what one process would have found, and no unit ran twice.

use rustix::process::Signal;
use serde_json::Value;
use std::path::Path;
use std::time::Duration;
use tests::{Cell, Finished};

/// A box that falls for a twentieth of a second.
const TASK: &str = r#"horizon = 0.05
hold = 0.01
[[body]]
name = "table"
hold = "fixed"
friction = 0.5
piece = [{ shape = "box", size = [1.0, 1.0, 0.1], position = [0.0, 0.0, -0.05] }]
[[body]]
name = "box"
mass = 0.2
friction = 0.5
position = [0.0, 0.0, 0.2]
piece = [{ shape = "box", size = [0.05, 0.05, 0.05] }]
start = { x = [-0.1, 0.1] }
[[success]]
body = "box"
low = [0.0, -1.0, 0.0]
high = [1.0, 1.0, 0.199]
"#;
const UNITS: usize = 200;

fn run(cell: &Cell, line: &str) -> Finished {
    let words: Vec<&str> = line.split_whitespace().collect();
    cell.start("calibration", &words).wait(Duration::from_secs(120))
}

fn results(sweep: &Path) -> Vec<(String, std::time::SystemTime)> {
    let entries = std::fs::read_dir(sweep.join("results")).expect("results").flatten();
    let mut found: Vec<_> = entries
        .filter(|entry| entry.path().extension().is_some_and(|ending| ending == "json"))
        .map(|entry| {
            let written = entry.metadata().and_then(|found| found.modified()).expect("a time");
            (entry.file_name().to_string_lossy().into_owned(), written)
        })
        .collect();
    found.sort();
    found
}

#[test]
fn a_sweep_that_was_killed_goes_on_and_is_merged_as_one_process_would_have_done_it() {
    let cell = Cell::shipped();
    std::fs::write(cell.path("task.toml"), TASK).expect("room");
    let command = format!(
        "evaluate --policies expert --tasks {} --seed {{seed}} --episodes 1 --out {{out}}",
        cell.text("task.toml")
    );
    std::fs::write(cell.path("commands.txt"), command).expect("room");
    let _planned =
        run(&cell, &format!("sweep plan {{dir}}/commands.txt --each seed=0..{UNITS} --out {{dir}}/sweep")).succeeded();
    let sweep = cell.path("sweep");
    let gaps = run(&cell, "sweep merge {dir}/sweep --out {dir}/merged");
    assert!(gaps.complaint().contains("200 of 200 units have no result"), "{}", gaps.stderr);

    let mut first = cell.start("calibration", &["sweep", "local", "{dir}/sweep", "--jobs", "2"]);
    Cell::until("half of the units are done", Duration::from_secs(120), || results(&sweep).len() >= UNITS / 2);
    first.kill_without_warning();
    let before = results(&sweep);
    assert!(before.len() < UNITS, "it was to be killed before its end");
    // The rest as two slices, as two machines would run them.
    let (mut now, mut known) = (0, 0);
    for slice in ["1/2", "2/2"] {
        let ran = run(&cell, &format!("sweep run {{dir}}/sweep --slice {slice} --jobs 2 --json")).succeeded().json();
        let number = |key: &str| ran[key].as_u64().expect("a number") as usize;
        assert_eq!(number("units"), UNITS / 2);
        (now, known) = (now + number("now"), known + number("before"));
    }
    assert!(known == before.len() && now == UNITS - known, "{now} {known} {}", before.len());
    let after = results(&sweep);
    assert!(after.len() == UNITS && before.iter().all(|result| after.contains(result)), "a result was written again");

    let merged = run(&cell, "sweep merge {dir}/sweep --out {dir}/merged --json").succeeded().json();
    assert_eq!(merged["units"], Value::from(UNITS));
    let _whole = run(
        &cell,
        &format!("evaluate --policies expert --tasks {{dir}}/task.toml --episodes {UNITS} --out {{dir}}/whole"),
    )
    .succeeded();
    for name in ["trials.csv", "findings.json"] {
        let [ours, whole] =
            ["merged", "whole"].map(|folder| std::fs::read_to_string(cell.path(folder).join(name)).expect(name));
        assert!(ours == whole, "{name} differs:\n{ours}\n{whole}");
    }
    let share = merged["findings"]["cells"][0]["success"].as_f64().expect("a share");
    assert!((0.3..0.7).contains(&share), "half of the starts lie on the right side: {share}");

    std::fs::write(cell.path("task.toml"), TASK.replace("0.05\n", "0.06\n")).expect("room");
    std::fs::remove_file(sweep.join("results").join(&after[0].0)).expect("a result");
    let other = run(&cell, "sweep local {dir}/sweep");
    assert!(other.complaint().contains("plan the sweep again"), "{}", other.stderr);
}

#[test]
fn units_that_fail_are_said_and_what_makes_no_sense_is_refused() {
    let cell = Cell::shipped();
    std::fs::write(cell.path("task.toml"), TASK).expect("room");
    let command = format!("evaluate --policies {{who}} --tasks {} --episodes 1 --out {{out}}", cell.text("task.toml"));
    std::fs::write(cell.path("commands.txt"), command).expect("room");
    let plan = "sweep plan {dir}/commands.txt --each who=expert,ws://127.0.0.1:9 --out {dir}/sweep";
    let _planned = run(&cell, plan).succeeded();
    let end = run(&cell, "sweep local {dir}/sweep");
    assert!(
        end.complaint().contains("1 of 2 units failed, the first, 1") && end.complaint().contains("start its server")
    );
    let again = run(&cell, plan);
    assert!(again.complaint().contains("not empty"), "{}", again.stderr);
    let none = run(&cell, "sweep local {dir}/nowhere");
    assert!(none.complaint().contains("no sweep is planned there"), "{}", none.stderr);
    let slurm = run(&cell, "sweep slurm {dir}/sweep --slices 4 --time 00:10:00").succeeded();
    assert!(slurm.stdout.starts_with("#!/bin/bash\n") && slurm.stdout.contains("--array=1-4"));
    for (flag, value) in [("--time", "1;id"), ("--partition", "a\n#SBATCH --uid=0")] {
        let arguments = ["sweep", "slurm", "{dir}/sweep", "--slices", "4", flag, value];
        let refused = cell.start("calibration", &arguments).wait(Duration::from_secs(60));
        assert!(refused.status.code() == Some(2) && refused.stderr.contains("give "), "{}", refused.stderr);
    }
}

#[test]
fn links_in_circles_are_planned_and_an_interruption_ends_hashing_at_once() {
    let cell = Cell::shipped();
    let session = cell.path("session");
    std::fs::create_dir(&session).expect("room");
    for name in ["a", "b"] {
        std::os::unix::fs::symlink(".", session.join(name)).expect("a link");
    }
    std::fs::write(cell.path("commands.txt"), format!("check {} --seed {{seed}}", cell.text("session"))).expect("room");
    let plan = |out: &str| {
        let line = format!("sweep plan {{dir}}/commands.txt --each seed=0..2 --out {{dir}}/{out}");
        cell.start("calibration", &line.split(' ').collect::<Vec<&str>>())
    };
    let _planned = plan("sweep").wait(Duration::from_secs(60)).succeeded();
    // Hours of hashing, without any bytes on the disk.
    let large = std::fs::File::create(session.join("clip_00.mcap")).and_then(|file| file.set_len(1 << 42));
    large.expect("a sparse file");
    for signal in [Signal::INT, Signal::TERM] {
        let planning = plan("other");
        let begun = || {
            let mut names = std::fs::read_dir(cell.path("")).expect("the cell's folder").flatten();
            names.any(|entry| entry.file_name().to_string_lossy().starts_with(".unfinished-other"))
        };
        Cell::until("it is at work", Duration::from_secs(60), begun);
        let end = planning.end_by(signal);
        assert!(end.complaint().contains("interrupted"), "{}", end.stderr);
        assert!(!cell.path("other").exists() && !begun(), "nothing is left");
    }
}

#[test]
fn a_result_that_was_changed_is_not_merged() {
    let cell = Cell::shipped();
    std::fs::write(cell.path("task.toml"), TASK).expect("room");
    let command = format!(
        "evaluate --policies expert --tasks {} --seed {{seed}} --episodes 1 --out {{out}}",
        cell.text("task.toml")
    );
    std::fs::write(cell.path("commands.txt"), command).expect("room");
    let _planned = run(&cell, "sweep plan {dir}/commands.txt --each seed=0..2 --out {dir}/sweep").succeeded();
    let _ran = run(&cell, "sweep local {dir}/sweep").succeeded();
    let file = cell.path("sweep").join("results").join(&results(&cell.path("sweep"))[0].0);
    let text = std::fs::read_to_string(&file).expect("a result");
    let changed = text.replacen("\"success\":", "\"success\": ", 1);
    assert_ne!(changed, text, "{text}");
    std::fs::write(&file, changed).expect("room");
    let refused = run(&cell, "sweep merge {dir}/sweep --out {dir}/merged");
    let name = file.to_str().expect("UTF-8");
    assert!(refused.complaint().contains(name) && refused.stderr.contains("was changed"), "{}", refused.stderr);
    std::fs::remove_file(&file).expect("a result");
    let _again = run(&cell, "sweep local {dir}/sweep").succeeded();
    let _merged = run(&cell, "sweep merge {dir}/sweep --out {dir}/merged").succeeded();
}
