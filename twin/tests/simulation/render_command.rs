//! `twin render` and `twin label-splats` as a person meets them.

use std::process::Command;

#[test]
fn a_folder_with_frames_of_before_is_refused_before_anything_is_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let render = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twin"));
        let output =
            command.args(["render", "nowhere.mcap", "--out"]).arg(folder.path()).output().expect("the twin binary");
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).expect("text")
    };
    std::fs::write(folder.path().join("notes.txt"), "").expect("a file");
    assert!(render().contains("nowhere.mcap"), "other files do no harm");
    std::fs::write(folder.path().join("frame_00041.png"), "").expect("a file");
    let said = render();
    assert!(said.contains("frame_00041.png") && said.contains("--force"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn degrees_and_millimetres_are_refused_with_range_and_unit() {
    let q = "--joints=0,-0.78,0,-2.36,0,1.57,0.78";
    for (wrong, allowed) in [
        (&["--joints=0,-45,0,-135,0,90,45"][..], "from -7 to 7 [rad"),
        (&["--joints=0,nan"], "from -7 to 7 [rad"),
        (&[q, "--hand=40"], "from 0 to 0.08 [m]"),
        (&[q, "--reach=15"], "from 0.0001 to 0.2 [m]"),
        (&[q, "--start=inf,0,0,1,0,0,0"], "from -1000 to 1000 [m"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twin"));
        command.args(["label-splats", "scan.ply", "--cell", "cell.toml", "--out", "links"]).args(wrong);
        let output = command.output().expect("the twin binary");
        let said = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {said}");
        assert!(said.contains(allowed), "{wrong:?}: {said}");
    }
}
