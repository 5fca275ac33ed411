//! TwinAligner clip folders.

use proptest::prelude::*;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, Session, read_clip};
use std::fmt::Write as _;
use std::path::Path;

const CAMERA: &str = "[camera]\npose = { position = [1.0, 0.0, 0.5], orientation = [0.0, 1.0, 0.0, 0.0] }\n";

/// A folder of 20 commands and 5 frames; the object moves along the camera's x by 0.01 m a frame.
fn write_folder(folder: &Path) {
    let row = |i: usize| format!("[{0}, 0, 0, -1.5, 0, 1.5, 0.7]", i as f64 * 0.01);
    let (mut control, mut frame) = (String::new(), String::new());
    for i in 0..20 {
        let comma = if i == 0 { "" } else { "," };
        let _ = write!(control, "{comma}{{\"id\": {i}, \"ros_timestamp\": {}, \"cmd\": {}}}", i as f64 * 0.01, row(i));
    }
    for i in 0..5 {
        let comma = if i == 0 { "" } else { "," };
        let time = i as f64 / 30.0;
        let _ = write!(
            frame,
            "{comma}{{\"id\": {i}, \"ros_timestamp\": {time}, \"camera_timestamp\": {}, \"joint_state\": {}, \
             \"ee_trans\": [0.3, 0, 0.5], \"ee_quat_wxyz\": [1, 0, 0, 0]}}",
            time - 0.02,
            row(i)
        );
    }
    std::fs::write(folder.join("control.json"), format!("[{control}]")).expect("room");
    std::fs::write(folder.join("frame.json"), format!("[{frame}]")).expect("room");
    std::fs::write(folder.join("init.json"), "{\"init_pose\": [0,0,0,-1.5,0,1.5,0.7]}").expect("room");
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (5, 4, 4), }\n";
    npy.extend(u16::try_from(header.len()).expect("short").to_le_bytes());
    npy.extend(header.as_bytes());
    for i in 0..5u8 {
        let x = 0.01 * f32::from(i);
        // It stands upright below a camera that looks down.
        let pose = [1.0, 0.0, 0.0, x, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.4, 0.0, 0.0, 0.0, 1.0f32];
        npy.extend(pose.iter().flat_map(|v| v.to_le_bytes()));
    }
    std::fs::write(folder.join("pose.npy"), npy).expect("room");
}

fn read(folder: &Path, cell: &str) -> Clip {
    let cell = Cell::parse(&format!("[robot]\nmodel = \"fr3\"\n{cell}"), Path::new("cell.toml")).expect("a valid cell");
    read_clip(folder, ClipKind::ControlHitSlide, &cell).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn commands_states_and_poses_become_a_clip_in_the_base_frame() {
    let folder = tempfile::tempdir().expect("a folder");
    write_folder(folder.path());
    let clip = read(folder.path(), CAMERA);
    assert_eq!((clip.desired.len(), clip.measured.len(), clip.object.len()), (20, 5, 5));
    assert_eq!(clip.joint_names[3], "fr3_joint4");
    assert_eq!(clip.desired.q_row(4)[0], 0.04);
    assert!(clip.desired.dq.is_empty() && clip.measured.tau.is_empty());
    // The camera looks straight down from 0.5 m: its x is the base's x, its z points down.
    for (i, pose) in clip.object.poses.iter().enumerate() {
        let expected = [1.0 + 0.01 * i as f64, 0.0, 0.1];
        let error = pose.position().iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-6, "{pose:?}");
    }
    let age_ns = clip.measured.stamps_ns[2] - clip.object.stamps_ns[2];
    assert_eq!(age_ns, 20_000_000, "a pose is stamped when its picture was taken");
    assert_eq!(clip.warnings, Vec::<String>::new());
}

#[test]
fn without_the_cameras_pose_the_object_is_left_out_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    write_folder(folder.path());
    let clip = read(folder.path(), "");
    assert!(clip.object.is_empty());
    assert!(clip.warnings.iter().any(|w| w.contains("[camera] pose")), "{:?}", clip.warnings);
}

#[test]
fn a_clip_folder_is_a_clip_and_no_session() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("traj_00001");
    std::fs::create_dir(&clip).expect("room");
    write_folder(&clip);
    std::fs::write(folder.path().join("cell.toml"), "[robot]\nmodel = \"fr3\"\n").expect("room");
    let session = Session::open(&clip).expect("cell.toml lies beside it");
    assert_eq!(session.clips.len(), 1);
    assert_eq!(session.read(&session.clips[0]).expect("a clip").measured.len(), 5);
    std::fs::write(clip.join("frame.json"), "[{\"id\": 0}]").expect("room");
    let error = session.read(&session.clips[0]).unwrap_err().to_string();
    assert!(error.contains("frame.json") && error.contains("ros_timestamp"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn a_changed_or_cut_file_of_the_folder_is_refused_or_read_as_numbers(
        file in 0_usize..3,
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let folder = tempfile::tempdir().expect("a folder");
        write_folder(folder.path());
        let path = folder.path().join(["control.json", "frame.json", "pose.npy"][file]);
        let mut bytes = std::fs::read(&path).expect("a file");
        for (at, value) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        if changes.len() % 2 == 0 {
            bytes.truncate(cut.index(bytes.len()));
        }
        std::fs::remove_file(&path).expect("a file");
        std::fs::write(&path, bytes).expect("room");
        let text = format!("[robot]\nmodel = \"fr3\"\n{CAMERA}");
        let cell = Cell::parse(&text, Path::new("cell.toml")).expect("a valid cell");
        if let Ok(clip) = read_clip(folder.path(), ClipKind::ControlHitSlide, &cell) {
            let joints = clip.desired.q.iter().chain(&clip.measured.q);
            prop_assert!(joints.copied().all(f64::is_finite));
            prop_assert!(clip.object.poses.iter().all(|pose| pose.position().iter().all(|value| value.is_finite())));
        }
    }
}
