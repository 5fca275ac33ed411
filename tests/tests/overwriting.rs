//! Nothing is overwritten unasked: an output that is there, or has no place, is refused before any work begins.

use shared_mem::msg::arm::ArmState;
use shared_mem::recording::{ClipInfo, ClipWriter};
use std::path::Path;
use std::time::Duration;
use tests::{Cell, Finished};

const BEFORE: &[u8] = b"of before";
const JOINTS: &str = "0,-0.78,0,-2.36,0,1.57,0.78";

/// A clip of an arm at rest.
fn clip(path: &Path) {
    let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
    for i in 0..300 {
        let stamp_ns = 1_000_000_000_000 + i * 1_000_000;
        let q = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];
        let state = ArmState { stamp_ns, device_ns: stamp_ns, cycle: i, dof: 7, q, q_d: q, ..ArmState::default() };
        writer.arm_state(&state).expect("room");
    }
    writer.finish().expect("room");
}

fn run(cell: &Cell, line: &str) -> Finished {
    let words: Vec<&str> = line.split_whitespace().collect();
    cell.start(words[0], &words[1..]).wait(Duration::from_secs(30))
}

#[test]
fn an_output_that_is_there_is_kept_and_the_way_to_replace_it_is_told_at_once() {
    let cell = Cell::shipped();
    clip(&cell.path("clip.mcap"));
    for folder in ["full", "frames", "links"] {
        std::fs::create_dir(cell.path(folder)).expect("a folder");
    }
    let outputs = ["there.toml", "there.json", "there.html", "there.svg", "there.mcap", "full/notes.txt"];
    let pictures = ["frames/frame_00000.png", "links/link0.ply"];
    for name in outputs.iter().chain(&pictures) {
        std::fs::write(cell.path(name), BEFORE).expect("room");
    }
    // No session is there: nothing else is looked at before.
    for (line, name) in [
        ("calibration identify arm {dir}/none --out {dir}/there.toml", "there.toml"),
        ("calibration identify arm {dir}/none --report {dir}/there.html", "there.html"),
        ("calibration identify object {dir}/none --out {dir}/there.toml", "there.toml"),
        ("calibration identify object {dir}/none --report {dir}/there.html", "there.html"),
        ("calibration identify joint {dir}/none --out {dir}/there.toml", "there.toml"),
        ("calibration identify joint {dir}/none --report {dir}/there.html", "there.html"),
        ("calibration diagnose {dir}/none --out {dir}/there.json", "there.json"),
        ("calibration diagnose {dir}/none --report {dir}/there.html", "there.html"),
        ("calibration diagnose {dir}/none --theta {dir}/there.toml", "there.toml"),
        ("calibration check {dir}/none --report {dir}/there.html", "there.html"),
        ("calibration benchmark --short --cell {cell} --report {dir}/there.html", "there.html"),
        ("calibration viewpoint {dir}/none --out {dir}/there.toml", "there.toml"),
        ("calibration viewpoint {dir}/none --report {dir}/there.html", "there.html"),
        (
            "calibration capture control-hit-slide --clips 1 --cell {cell} --out {dir}/new --preview {dir}/there.svg",
            "there.svg",
        ),
        ("calibration export {dir}/clip.mcap --to ros2 --out {dir}/full", "full"),
        ("calibration demo --out {dir}/full", "full"),
        ("calibration evaluate --policies expert --tasks {dir}/none --out {dir}/full", "full"),
        ("twin replay {dir}/clip.mcap --out {dir}/there.mcap", "there.mcap"),
        ("twin render {dir}/clip.mcap --out {dir}/frames", "frame_00000.png"),
        (&format!("twin label-splats {{dir}}/none --cell {{cell}} --joints {JOINTS} --out {{dir}}/links"), "link0.ply"),
        ("rt_bridge run --cell {cell} --arm sim --realtime ignore --record {dir}/there.mcap", "there.mcap"),
        ("rt_bridge record --out {dir}/there.mcap", "there.mcap"),
    ] {
        let end = run(&cell, line);
        let said = end.complaint();
        assert!(said.contains(name) && said.contains("--force"), "{line}:\n{}", end.stderr);
        assert!(end.took < Duration::from_secs(5), "{line}: {:?}", end.took);
    }
    for name in outputs.iter().chain(&pictures) {
        assert_eq!(std::fs::read(cell.path(name)).expect("it is there"), BEFORE, "{name}");
    }
    assert!(!cell.path("new").exists());
}

#[test]
fn an_output_without_a_folder_is_told_before_the_work() {
    let cell = Cell::shipped();
    for line in [
        "calibration identify arm {dir}/none --report {dir}/nowhere/page.html",
        "calibration identify object {dir}/none --out {dir}/nowhere/theta.toml",
        "calibration identify joint {dir}/none --out {dir}/nowhere/found.urdf",
        "calibration diagnose {dir}/none --report {dir}/nowhere/page.html",
        "calibration diagnose {dir}/none --out {dir}/nowhere/d.json",
        "calibration benchmark --short --cell {cell} --report {dir}/nowhere/page.html",
        "calibration viewpoint {dir}/none --report {dir}/nowhere/outline.png",
    ] {
        let end = run(&cell, line);
        assert!(
            end.complaint().contains("there is no folder") && end.complaint().contains("nowhere"),
            "{}",
            end.stderr
        );
    }
}

#[test]
fn a_diagnosis_leaves_parameters_alone_that_nobody_named_and_writes_none_that_it_did_not_find() {
    let cell = Cell::shipped();
    std::fs::create_dir(cell.path("session")).expect("a folder");
    clip(&cell.path("session/clip_00.mcap"));
    let listed = format!("{}\n[[clip]]\nfile = \"clip_00.mcap\"\nkind = \"excitation\"\n", tests::lab_cell());
    std::fs::write(cell.path("session/cell.toml"), listed).expect("room");
    let mine = "# measured by hand\n[object]\nmass = 0.42\n";
    std::fs::write(cell.path("theta.toml"), mine).expect("room");
    let line = "calibration diagnose {dir}/session --parameters {dir}/theta.toml --out {dir}/d.json --json";
    let end = run(&cell, line).succeeded();
    assert_eq!(std::fs::read_to_string(cell.path("theta.toml")).expect("mine"), mine);
    assert!(end.stderr.contains("theta.toml is there, and is kept"), "{}", end.stderr);
    let answer = end.json();
    assert_eq!((&answer["verdict"]["kind"], &answer["budget_spent"]), (&"not_testable".into(), &false.into()));
    assert!(answer["theta_file"].is_null() && cell.path("d.json").is_file());
    let end = run(&cell, "calibration diagnose {dir}/session --theta {dir}/found.toml").succeeded();
    assert!(end.stderr.contains("found.toml: not written") && !cell.path("found.toml").exists(), "{}", end.stderr);
    assert!(!cell.path("session/.diagnose.state").exists());
}
