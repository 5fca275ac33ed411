//! `calibration hand-eye` as a program: lists of corners in, hand_eye.toml out; what cannot be used is refused in one line.

use rand::SeedableRng as _;
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use shared_mem::hand_eye::{HandEye, Mount};
use shared_mem::lens::Distortion;
use std::path::Path;
use std::process::{Command, Output};
use vision::hand_eye::chain::Chain;
use vision::hand_eye::simulated::{World, off};
use vision::hand_eye::view::View;

const WORLD: World =
    World { mount: Mount::EyeInHand, views: 12, pixel: 0.1, arm: [1e-3, 0.5e-3], turns: [0.5, 0.5, 1.0] };

/// The list of a world's pictures, corners in place of pixels.
fn list(views: &[View]) -> Value {
    let frame = |view: &View| {
        let points: Vec<[f64; 4]> =
            view.seen.iter().map(|s| [s.place[0], s.place[1], s.pixel[0] + 0.5, s.pixel[1] + 0.5]).collect();
        let matrix = view.base_from_end_effector.to_homogeneous();
        json!({ "file_path": view.name, "O_T_EE": matrix.as_slice(), "points": points })
    };
    let lens = views[0].lens;
    json!({
        "fl_x": lens.focal[0], "fl_y": lens.focal[1], "cx": lens.centre[0] + 0.5, "cy": lens.centre[1] + 0.5,
        "frames": views.iter().map(frame).collect::<Vec<_>>(),
    })
}

fn drawn(world: &World) -> (Chain, Vec<View>) {
    world.draw(&mut Pcg64::seed_from_u64(5))
}

fn hand_eye(folder: &Path, list: &Value, more: &[&str]) -> Output {
    std::fs::write(folder.join("poses.json"), list.to_string()).expect("a file");
    let out = folder.join("hand_eye.toml");
    Command::new(env!("CARGO_BIN_EXE_calibration"))
        .arg("hand-eye")
        .arg(folder)
        .args(["--json", "--out"])
        .arg(out)
        .args(more)
        .output()
        .expect("the program runs")
}

/// The line of a refusal.
fn refused(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr).trim_end().to_owned();
    assert!(!said.contains('\n'), "{said}");
    said
}

#[test]
fn corners_of_another_detector_give_the_mount_and_its_file() {
    let folder = tempfile::tempdir().expect("a folder");
    for (mount, more) in [(Mount::EyeInHand, &[][..]), (Mount::FixedCamera, &["--fixed-camera", "--force"][..])] {
        let (truth, mut views) = drawn(&World { mount, ..WORLD });
        let wrong = views[6].base_from_end_effector;
        views[3].base_from_end_effector = wrong;
        let output = hand_eye(folder.path(), &list(&views), more);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(answer["residual"]["left_out"], json!(["003.png"]), "{answer}");
        let file = HandEye::read(&folder.path().join("hand_eye.toml")).expect("the file");
        let pose = [file.EE_T_camera, file.O_T_camera][usize::from(mount == Mount::FixedCamera)].expect("a mount");
        let off = off(&pose.isometry().expect("a pose"), &truth.camera);
        assert!(off[..3].iter().all(|turn| turn.abs() < 5e-3) && off[3..].iter().all(|m| m.abs() < 5e-3), "{off:?}");
        let left = file.residual.expect("what is left");
        assert!(left.held_out_px > left.corner_sigma_px && left.held_out_px < 8.0 && left.pictures == 11, "{left:?}");
        assert!(pose.covariance.is_some() && answer["not_identifiable"] == json!([]));
    }
}

#[test]
fn corners_through_lenses_of_every_model_give_the_same_mount() {
    let folder = tempfile::tempdir().expect("a folder");
    let (truth, views) = drawn(&WORLD);
    let cases = [
        (
            Distortion::Polynomial([0.45, -2.55, 4e-4, 1e-4, 1.48, 0.33, -2.37, 1.41]),
            json!({ "k1": 0.45, "k2": -2.55, "p1": 4e-4, "p2": 1e-4, "k3": 1.48, "k4": 0.33, "k5": -2.37, "k6": 1.41 }),
        ),
        (
            Distortion::Fisheye([-0.04, 0.02, -0.006, 0.001]),
            json!({ "camera_model": "OPENCV_FISHEYE", "k1": -0.04, "k2": 0.02, "k3": -0.006, "k4": 0.001 }),
        ),
    ];
    for (distortion, keys) in cases {
        let mut bent = views.clone();
        for view in &mut bent {
            view.seen.iter_mut().for_each(|seen| seen.pixel = view.lens.bent(&distortion, seen.pixel));
        }
        let mut list = list(&bent);
        list.as_object_mut().expect("keys").extend(keys.as_object().expect("keys").clone());
        let output = hand_eye(folder.path(), &list, &["--force"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let file = HandEye::read(&folder.path().join("hand_eye.toml")).expect("the file");
        let pose = file.EE_T_camera.and_then(|pose| pose.isometry()).expect("a mount");
        assert!(off(&pose, &truth.camera).iter().all(|off| off.abs() < 5e-3), "{distortion:?}");
        // What was used stands in the file, and comes back from it.
        assert_eq!(file.camera.expect("a camera").distortion, distortion);
    }
    for (keys, what) in [
        (json!({ "k4": 0.1 }), "`k4`"),
        (json!({ "s1": 0.1 }), "`s1`"),
        (json!({ "distCoeffs": [0.1, 0.0, 0.0, 0.0, 0.0] }), "`distCoeffs`"),
        (json!({ "camera_model": "omni", "distortion_model": "radtan", "k1": 0.1 }), "`omni`"),
        (json!({ "camera": { "k1": 0.1 } }), "`camera` holds `k1`"),
    ] {
        let mut list = list(&views);
        list.as_object_mut().expect("keys").extend(keys.as_object().expect("keys").clone());
        let line = refused(&hand_eye(folder.path(), &list, &["--force"]));
        assert!(line.contains(what), "{line}");
    }
}

#[test]
fn intrinsics_that_are_given_leave_the_lens_as_the_files_say_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, mut views) = drawn(&WORLD);
    let (lens, distortion) = (views[0].lens, Distortion::brown([-0.3, 0.1, 0.0, 0.0, 0.0]));
    for view in &mut views {
        view.seen.iter_mut().for_each(|seen| seen.pixel = lens.bent(&distortion, seen.pixel));
    }
    let mut list = list(&views);
    let keys = list.as_object_mut().expect("keys");
    ["fl_x", "fl_y", "cx", "cy"].iter().for_each(|key| drop(keys.remove(*key)));
    let pinhole = [lens.focal[0], lens.focal[1], lens.centre[0], lens.centre[1]].map(|v| v.to_string()).join(",");
    let alone = hand_eye(folder.path(), &list, &["--force", "--intrinsics", &pinhole]);
    assert!(String::from_utf8_lossy(&alone.stdout).contains("pinhole without distortion"), "{alone:?}");
    list["k1"] = json!(-0.3);
    list["k2"] = json!(0.1);
    let with_lens = hand_eye(folder.path(), &list, &["--force", "--intrinsics", &pinhole]);
    assert!(with_lens.status.success() && !String::from_utf8_lossy(&with_lens.stdout).contains("without distortion"));
    let file = HandEye::read(&folder.path().join("hand_eye.toml")).expect("the file");
    assert_eq!(file.camera.expect("a camera").distortion, distortion);
}

#[test]
fn what_gives_no_mount_is_said_in_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, views) = drawn(&World { turns: [0.0, 0.0, 1.0], ..WORLD });
    let said = hand_eye(folder.path(), &list(&views), &[]);
    let answer: Value = serde_json::from_slice(&said.stdout).expect("JSON");
    assert!(answer["not_identifiable"][0]["parameter"].as_str().is_some_and(|what| what.contains("shift along")));
    assert!(refused(&said).contains("one axis") && !folder.path().join("hand_eye.toml").exists());
    let (_, views) = drawn(&WORLD);
    let few = refused(&hand_eye(folder.path(), &list(&views[..2]), &[]));
    assert!(few.contains("2 pictures"), "{few}");
    let whole = list(&views);
    type Damage = fn(&mut Value);
    let cases: [(Damage, &str); 5] = [
        (|list| drop(list["frames"][2].as_object_mut().expect("a frame").remove("O_T_EE")), "O_T_EE"),
        (|list| list["frames"][2]["O_T_EE"][0] = json!(3.0), "no pose"),
        (|list| ["fl_x", "fl_y"].iter().for_each(|key| list[*key] = Value::Null), "no intrinsics"),
        (|list| drop(list["frames"][2].as_object_mut().expect("a frame").remove("points")), "012.png"),
        (|list| list["frames"] = json!(7), "docs/hand_eye.md"),
    ];
    for (damage, what) in cases {
        let mut list = whole.clone();
        list["frames"][2]["file_path"] = json!("012.png");
        damage(&mut list);
        let said = refused(&hand_eye(folder.path(), &list, &[]));
        assert!(said.contains(what), "{what}: {said}");
    }
    assert!(!folder.path().join("hand_eye.toml").exists());
}
