//! A scan by the arm, whole: the simulated bridge carries a camera around a point, and what is kept is a scan.

use shared_mem::hand_eye::{HandEye, Matrix};
use shared_mem::recording::{Picture, read_picture};
use std::time::Duration;
use tests::{Cell, Program, lab_cell};

const MOUNT: &str = "\
mount = \"eye_in_hand\"
[EE_T_camera]
position = [0.06, 0.0, 0.03]
orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
";

/// The middle of the box that stands before the arm, and how far the camera stays from it: a D455 measures nothing nearer than 0.4 m.
const AT: [f64; 3] = [0.55, 0.0, 0.05];
const DISTANCE: f64 = 0.5;

/// A capture of this many views of the box.
fn scan(cell: &Cell, views: &str, out: &str) -> Program {
    std::fs::write(cell.path("hand_eye.toml"), MOUNT).expect("a file");
    let files = [cell.text("hand_eye.toml"), cell.text(out)];
    let [hand_eye, out] = files.each_ref().map(String::as_str);
    let asked = ["capture", "scan", "--cell", "{cell}", "--hand-eye", hand_eye, "--at", "0.55,0,0.05", "--out", out];
    let more = ["--distance", "0.5", "--radius", "0.12", "--views", views, "--realtime", "ignore", "--json"];
    cell.start("calibration", &[&asked[..], &more].concat())
}

/// The scan's list, each picture of which is there, of one size, and shows the box in its middle and in its mask.
fn frames(cell: &Cell, out: &str) -> usize {
    let text = std::fs::read_to_string(cell.path(out).join("poses.json")).expect("a list");
    let list: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let mount = HandEye::read(&cell.path(out).join("hand_eye.toml")).expect("the mount");
    let mount = mount.end_effector_from_camera().expect("a pose");
    let frames = list["frames"].as_array().expect("frames");
    for frame in frames {
        let read = |path: &str| {
            let picture = read_picture(&cell.path(out).join(path)).expect("a picture");
            let Picture::Pixels { header, pixels } = picture else { panic!("packed") };
            assert_eq!((header.width, header.height), (640, 480), "{path}");
            (header.encoding.bytes_per_pixel() as usize, pixels)
        };
        let path = frame["file_path"].as_str().expect("a path");
        assert_eq!(read(path).0, 3);
        let (bytes, depth) = read(frame["depth_file_path"].as_str().expect("a path"));
        assert_eq!(bytes, 2);
        // The box's corners are 71 mm from its middle, its nearest faces 30.
        let middle = 2 * (640 * 240 + 320);
        let millimetres = u16::from_le_bytes([depth[middle], depth[middle + 1]]);
        assert!((425..=475).contains(&millimetres), "{millimetres} mm in {path}");
        let (_, mask) = read(&path.replace("images", "masks"));
        let white = mask.chunks_exact(3).filter(|rgb| rgb[0] > 127).count();
        // At 0.5 m a face of the box covers 60 x 80 mm or more of 0.82 mm a pixel, its outline at most 1.7 times as much.
        assert!(mask[3 * (640 * 240 + 320)] > 127 && (5000..26_000).contains(&white), "{white} pixels in {path}");
        let matrix: Matrix = serde_json::from_value(frame["O_T_EE"].clone()).expect("a matrix");
        let camera = matrix.isometry().expect("a pose") * mount;
        let seen = camera.inverse_transform_point(&AT.into());
        // The tenth part of a millimetre is seen; the arm's noise and its friction have room.
        assert!(seen.x.hypot(seen.y) < 0.01 && (seen.z - DISTANCE).abs() < 0.01, "{seen}");
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
    assert_eq!(answer["with_mask"].as_u64(), Some(pictures));
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

/// The shipped cell with its box by the name of `box` and another one of this height beside it.
fn beside(place: [f64; 2], height: f64) -> String {
    let (before, after) = lab_cell().split_once("[object]").expect("an object");
    let (_, after) = after.split_once("[camera]").expect("a camera");
    let object = |name: &str, [x, y]: [f64; 2], size: [f64; 3]| {
        format!("[[object]]\nname = \"{name}\"\nshape = \"box\"\nsize = {size:?}\nmass = 0.3\nstart = [{x:?}, {y:?}]\n")
    };
    let objects = object("box", [0.55, 0.0], [0.08, 0.06, 0.10]) + &object("tall", place, [0.1, 0.1, height]);
    format!("{before}{objects}[camera]{after}")
}

#[test]
fn views_that_another_object_is_in_the_way_of_are_left_out_with_what_helps() {
    let cell = Cell::with(&beside([0.55, 0.4], 0.4));
    let running = scan(&cell, "16", "scan");
    Cell::until("a picture", Duration::from_secs(90), || cell.path("scan/poses.json").exists());
    let done = running.interrupt().succeeded();
    let blocked = done.json()["blocked"].as_u64().expect("a number");
    assert!((1..=8).contains(&blocked), "{blocked} of 16\n{}", done.stderr);
    let said = format!("{blocked} of ");
    let said = done.stderr.lines().find(|line| line.starts_with(&said)).unwrap_or_else(|| panic!("{}", done.stderr));
    assert!(said.contains("views are left out") && said.contains("move `tall` away by about"), "{said}");
    assert!(!done.stderr.contains("no poses of"), "{}", done.stderr);
}

#[test]
fn a_scan_of_which_another_object_leaves_too_few_views_is_refused_before_the_arm_moves() {
    let cell = Cell::with(&beside([0.55, 0.2], 0.5));
    let refused = scan(&cell, "10", "scan").wait(Duration::from_secs(60));
    let complaint = refused.complaint();
    assert!(complaint.contains("clear of other objects") && complaint.contains("move `tall` away by"), "{complaint}");
    assert!(!cell.path("scan").exists());
}
