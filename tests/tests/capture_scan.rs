//! A scan by the arm, whole: the simulated bridge carries a camera around a point, and what is kept is a scan.

use shared_mem::hand_eye::{HandEye, Matrix};
use shared_mem::recording::{Picture, read_picture};
use std::time::Duration;
use tests::{Cell, Program};

const MOUNT: &str = "\
mount = \"eye_in_hand\"
[EE_T_camera]
position = [0.06, 0.0, 0.03]
orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
";

/// A capture of this many views of a place before the arm.
fn scan(cell: &Cell, views: &str, out: &str) -> Program {
    std::fs::write(cell.path("hand_eye.toml"), MOUNT).expect("a file");
    let files = [cell.text("hand_eye.toml"), cell.text(out)];
    let [hand_eye, out] = files.each_ref().map(String::as_str);
    let asked = ["capture", "scan", "--cell", "{cell}", "--hand-eye", hand_eye, "--at", "0.5,0,0.1", "--out", out];
    cell.start("calibration", &[&asked[..], &["--views", views, "--realtime", "ignore", "--json"]].concat())
}

/// The scan's list, each picture of which is there, of one size, and taken with the camera's axis through the place.
fn frames(cell: &Cell, out: &str) -> usize {
    let text = std::fs::read_to_string(cell.path(out).join("poses.json")).expect("a list");
    let list: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let mount = HandEye::read(&cell.path(out).join("hand_eye.toml")).expect("the mount");
    let mount = mount.end_effector_from_camera().expect("a pose");
    let frames = list["frames"].as_array().expect("frames");
    for frame in frames {
        for (key, is_depth) in [("file_path", false), ("depth_file_path", true)] {
            let path = cell.path(out).join(frame[key].as_str().expect("a path"));
            let Picture::Pixels { header, .. } = read_picture(&path).expect("a picture") else { panic!("packed") };
            assert_eq!((header.width, header.height), (640, 480));
            assert_eq!(header.depth_scale != 0.0 || header.encoding.bytes_per_pixel() == 2, is_depth, "{key}");
        }
        let matrix: Matrix = serde_json::from_value(frame["O_T_EE"].clone()).expect("a matrix");
        let camera = matrix.isometry().expect("a pose") * mount;
        let seen = camera.inverse_transform_point(&[0.5, 0.0, 0.1].into());
        // The tenth part of a millimetre is seen; the arm's noise and its friction have room.
        assert!(seen.x.hypot(seen.y) < 0.01 && (seen.z - 0.35).abs() < 0.01, "{seen}");
    }
    frames.len()
}

#[test]
fn the_arm_goes_round_and_what_it_sees_is_a_scan() {
    let cell = Cell::shipped();
    let answer = scan(&cell, "10", "scan").wait(Duration::from_secs(240)).succeeded().json();
    let (pictures, left) = (answer["pictures"].as_u64().expect("a number"), answer["without_way"].as_u64());
    assert!(pictures >= 8 && answer["own_bridge"] == true, "{answer}");
    assert_eq!((frames(&cell, "scan") as u64, answer["with_depth"].as_u64()), (pictures, Some(pictures)));
    assert!(pictures + left.expect("a number") <= 10, "{answer}");
    let again = scan(&cell, "10", "scan").wait(Duration::from_secs(20));
    assert!(again.complaint().contains("holds a scan already"), "{}", again.complaint());
    // Ctrl-C keeps what was taken.
    let running = scan(&cell, "40", "ended");
    Cell::until("a picture", Duration::from_secs(90), || cell.path("ended/poses.json").exists());
    let answer = running.interrupt().succeeded().json();
    assert_eq!(answer["interrupted"], true);
    assert_eq!(Some(frames(&cell, "ended") as u64), answer["pictures"].as_u64());
}
