//! Sessions there and back: what a format can hold survives it, what it cannot is told, and nothing is guessed.

use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::arm::{ArmCommand, ArmState};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding};
use shared_mem::msg::object::ObjectPose;
use shared_mem::msg::twin::{TwinGap, TwinState};
use shared_mem::msg::wrench::Wrench;
use shared_mem::recording::{
    Clip, ClipInfo, ClipMessages, ClipWriter, Exported, Format, LeftOut, Order, Payload, Picture, Session,
    export_session, read_arm_states,
};
use shared_mem::topics;
use std::path::{Path, PathBuf};

const CELL: &str = "[robot]\nmodel = \"fr3\"\nbase_frame = \"fr3_link0\"\n\
    [controller]\nkind = \"joint_impedance\"\nstiffness = [600, 600, 600, 600, 250, 150, 50]\ndamping = [50, 50, 50, 50, 30, 25, 15]\n\
    [camera]\nlatency = 0.01\npose = { position = [1.0, 0.0, 0.5], orientation = [0.0, 1.0, 0.0, 0.0] }\n\
    [[clip]]\nfile = \"clip_00.mcap\"\nkind = \"control_hit_slide\"\n";
const START: u64 = 5_000_000_000;
const MS: u64 = 1_000_000;

/// A rigid transform with no number that is round.
fn flange(t: f64) -> [f64; 16] {
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.2 + t, 0.7);
    let pose = nalgebra::Isometry3::from_parts(nalgebra::Translation3::new(0.4 + t, 0.1, 0.3), turn);
    let mut out = [0.0; 16];
    out.copy_from_slice(pose.to_homogeneous().as_slice());
    out
}

fn state(i: u64) -> ArmState {
    let t = 1e-3 * i as f64;
    let row =
        |scale: f64| std::array::from_fn(|j| if j < 7 { scale * (t * (1.0 + 0.1 * j as f64)).sin() } else { 0.0 });
    ArmState {
        // The robot's clock is even, this machine's is not.
        stamp_ns: START + i * MS + (i * 7919) % 60_000,
        device_ns: 777 + i * MS,
        cycle: i,
        dof: 7,
        q: row(1.0),
        dq: row(0.9),
        q_d: row(1.01),
        dq_d: row(0.91),
        tau_J: row(20.0),
        tau_J_d: row(2.0),
        tau_ext: row(0.3),
        O_T_EE: flange(t),
        ..ArmState::default()
    }
}

/// 0.4 s of everything.
fn record(folder: &Path) -> Session {
    std::fs::write(folder.join("cell.toml"), CELL).expect("room");
    let mut writer = ClipWriter::create(&folder.join("clip_00.mcap"), &ClipInfo::default()).expect("a new file");
    let known =
        CameraInfo { stamp_ns: START, width: 4, height: 2, intrinsics: [3.0, 3.5, 1.5, 0.5], ..CameraInfo::default() };
    writer.camera_info(&known).expect("room");
    for i in 0..400 {
        let state = state(i);
        writer.arm_state(&state).expect("room");
        let stamp_ns = state.stamp_ns + 100;
        if i % 2 == 0 {
            let force = [0.1 * i as f64, -2.5, 1.0 / 3.0];
            writer.wrench(&Wrench { stamp_ns, force, torque: [0.1, 0.2, 0.3], ..Wrench::default() }).expect("room");
        }
        if i % 20 == 0 {
            let width = 0.08 - 1e-4 * i as f64;
            writer.gripper(&GripperState { stamp_ns, width, force: 20.0, ..GripperState::default() }).expect("room");
        }
        if i % 33 == 0 {
            let (x, half) = (0.5 + 1e-3 * i as f64 / 3.0, 0.02 * i as f64);
            let wxyz = [half.cos(), 0.0, 0.0, half.sin()];
            writer
                .object_pose(&ObjectPose { stamp_ns, position: [x, 0.1, 0.05], wxyz, ..ObjectPose::default() })
                .expect("room");
            let header = ImageHeader { stamp_ns, width: 4, height: 2, stride: 12, ..ImageHeader::default() };
            let pixels: Vec<u8> = (0..24).map(|k| (i + k) as u8).collect();
            writer.image(topics::CAMERA_COLOR, &header, &pixels).expect("room");
            let depth = ImageHeader { stride: 8, encoding: PixelEncoding::Depth16, depth_scale: 1e-3, ..header };
            writer.image(topics::CAMERA_DEPTH, &depth, &pixels[..16]).expect("room");
        }
    }
    let event = Event::new(EventLevel::Warning, EventSource::Capture, "the object left its place");
    writer.event(&Event { stamp_ns: START + 400 * MS, ..event }).expect("room");
    writer.finish().expect("room");
    Session::open(folder).expect("a session")
}

/// Exports into a new folder.
fn export(session: &Session, to: Format, into: &Path) -> (Session, Vec<Exported>) {
    let flange_at = |q: &[f64]| Some(([q[0], 0.0, 0.5], [1.0, 0.0, 0.0, 0.0]));
    let order = Order { to, out: into, force: false, flange_at: &flange_at, robot: None };
    let done = export_session(session, order, |_| {}).unwrap_or_else(|e| panic!("{e}"));
    (Session::open(into).expect("a session"), done)
}

fn clip(session: &Session) -> Clip {
    session.read(&session.clips[0]).unwrap_or_else(|e| panic!("{e}"))
}

/// Whether two lists hold the same numbers; text may cost the last bit of one.
fn near(a: &[f64], b: &[f64], within: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= within)
}

/// The same numbers at the same moments, whatever the clocks count from.
fn same(a: &Clip, b: &Clip, within: f64) {
    let base = |clip: &Clip| clip.measured.stamps_ns[0];
    let since = |clip: &Clip, stamps: &[u64]| -> Vec<i64> {
        stamps.iter().map(|stamp| *stamp as i64 - base(clip) as i64).collect()
    };
    for (x, y) in [(&a.measured, &b.measured), (&a.desired, &b.desired)] {
        assert_eq!(since(a, &x.stamps_ns), since(b, &y.stamps_ns));
        for (numbers, others) in [(&x.q, &y.q), (&x.dq, &y.dq), (&x.tau, &y.tau)] {
            assert!(near(numbers, others, within));
        }
    }
    assert_eq!((a.torques_end_at_rows, &a.joint_names), (b.torques_end_at_rows, &b.joint_names));
    assert_eq!(since(a, &a.object.stamps_ns), since(b, &b.object.stamps_ns));
    for (x, y) in a.object.poses.iter().zip(&b.object.poses) {
        assert!((x.isometry().to_homogeneous() - y.isometry().to_homogeneous()).norm() <= 10.0 * within, "{x:?} {y:?}");
    }
}

/// Payloads of a kind, without their stamps.
fn payloads<T>(session: &Session, pick: impl Fn(Payload) -> Option<T>) -> Vec<T> {
    let messages = ClipMessages::open(&session.folder.join(&session.clips[0].file), &[]).expect("a clip");
    messages.filter_map(|message| pick(message.expect("it decodes").payload)).collect()
}

fn pictures(session: &Session) -> Vec<(PixelEncoding, Vec<u8>)> {
    payloads(session, |payload| match payload {
        Payload::Picture(Picture::Pixels { header, pixels }) => Some((header.encoding, pixels)),
        _ => None,
    })
}

fn devices(session: &Session) -> (Vec<Wrench>, Vec<(f64, f64)>, Vec<String>) {
    let wrenches = payloads(session, |payload| match payload {
        Payload::Wrench(wrench) => Some(Wrench { stamp_ns: 0, device_ns: 0, ..wrench }),
        _ => None,
    });
    let widths = payloads(session, |payload| match payload {
        Payload::Gripper(gripper) => Some((gripper.width, gripper.force)),
        _ => None,
    });
    let words = payloads(session, |payload| match payload {
        Payload::Event(event) => Some(format!("{:?} {:?} {}", event.level, event.source, event.text())),
        _ => None,
    });
    (wrenches, widths, words)
}

#[test]
fn an_own_session_survives_a_bag_and_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = record(folder.path());
    let (bag, done) = export(&own, Format::Ros2, &folder.path().join("bags"));
    assert_eq!((done[0].measured, done[0].poses, done[0].pictures), (400, 13, 26), "{done:?}");
    assert_eq!(bag.clips[0].kind, ClipKind::ControlHitSlide);
    same(&clip(&own), &clip(&bag), 0.0);
    assert_eq!(pictures(&own), pictures(&bag));
    assert_eq!(devices(&own), devices(&bag));
    let stamps = clip(&bag).measured.stamps_ns;
    assert!(stamps[0] > 1_600_000_000_000_000_000, "a bag counts Unix time");

    let (back, done) = export(&bag, Format::Own, &folder.path().join("back"));
    assert_eq!(done[0].warnings, Vec::<String>::new());
    same(&clip(&own), &clip(&back), 0.0);
    assert_eq!(pictures(&own), pictures(&back));
    assert_eq!(devices(&own), devices(&back));
    let [before, after] = [&own, &back].map(|s| read_arm_states(&s.folder.join(&s.clips[0].file)).expect("states"));
    for (x, y) in before.iter().zip(&after) {
        assert_eq!((x.q_d, x.tau_J, x.tau_ext), (y.q_d, y.tau_J, y.tau_ext));
        assert!(x.O_T_EE.iter().zip(y.O_T_EE).all(|(a, b)| (a - b).abs() < 1e-14), "{:?} {:?}", x.O_T_EE, y.O_T_EE);
    }
    let stands =
        payloads(
            &back,
            |p| if let Payload::CameraInfo(info) = p { Some((info.intrinsics, info.position)) } else { None },
        );
    assert_eq!(stands, [([3.0, 3.5, 1.5, 0.5], [1.0, 0.0, 0.5])]);
}

#[test]
fn a_twinaligner_folder_holds_commands_frames_poses_and_pictures_and_survives_a_bag() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = record(folder.path());
    let (folders, done) = export(&own, Format::TwinAligner, &folder.path().join("folders"));
    assert!(done[0].warnings.iter().any(|w| w.contains("387 joint rows between the frames")), "{done:?}");
    assert!(done[0].warnings.iter().any(|w| w.contains("velocities and torques")), "{done:?}");
    let (mine, theirs) = (clip(&own), clip(&folders));
    assert_eq!((theirs.desired.len(), theirs.measured.len(), theirs.object.len()), (400, 13, 13));
    assert!(near(&theirs.desired.q, &mine.desired.q, 1e-15));
    assert_eq!(theirs.warnings, Vec::<String>::new());
    let first = theirs.desired.stamps_ns[0] as i64 - mine.desired.stamps_ns[0] as i64;
    for (i, stamp) in theirs.object.stamps_ns.iter().enumerate() {
        assert_eq!(*stamp as i64 - first, mine.object.stamps_ns[i] as i64);
    }
    let at: PathBuf = folders.folder.join("traj_00000");
    for file in ["init.json", "cam_K.txt", "rgb/00012.png", "depth/00012.npz"] {
        assert!(at.join(file).is_file(), "{file}");
    }

    let (bag, done) = export(&folders, Format::Ros2, &folder.path().join("bags"));
    assert_eq!(done[0].pictures, 26);
    same(&theirs, &clip(&bag), 1e-15);
    assert_eq!(pictures(&own), pictures(&bag));
    let (again, _) = export(&bag, Format::TwinAligner, &folder.path().join("again"));
    same(&theirs, &clip(&again), 1e-14);
    for file in ["cam_K.txt", "rgb/00003.png", "depth/00003.npz"] {
        let read = |session: &Session| std::fs::read(session.folder.join("traj_00000").join(file)).expect("a file");
        assert_eq!(read(&folders), read(&again), "{file}");
    }
}

#[test]
fn an_own_session_survives_a_twinaligner_folder_and_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = record(folder.path());
    let (folders, _) = export(&own, Format::TwinAligner, &folder.path().join("folders"));
    let (back, done) = export(&folders, Format::Own, &folder.path().join("back"));
    assert_eq!((done[0].desired, done[0].measured, done[0].poses, done[0].pictures), (400, 13, 13, 26), "{done:?}");
    assert_eq!(done[0].left_out, [LeftOut { topic: "init.json".into(), messages: 1 }]);
    let (theirs, ours) = (clip(&folders), clip(&back));
    same(&theirs, &ours, 1e-15);
    assert_eq!(ours.warnings, Vec::<String>::new());
    // What a folder does not hold is not 0 afterwards.
    assert!([&ours.measured, &ours.desired].iter().all(|series| series.dq.is_empty() && series.tau.is_empty()));
    assert_eq!(pictures(&own), pictures(&back));
    let states = read_arm_states(&back.folder.join(&back.clips[0].file)).expect("states");
    assert_eq!(states.len(), 13);
    // The newest command, for whoever reads states alone.
    let newest = ours.desired.stamps_ns.partition_point(|stamp| *stamp <= ours.measured.stamps_ns[12]) - 1;
    assert_eq!(states[12].q_d[..7], *ours.desired.q_row(newest));
    let (again, _) = export(&back, Format::TwinAligner, &folder.path().join("again"));
    same(&theirs, &clip(&again), 1e-14);
}

#[test]
fn an_own_clip_becomes_an_own_clip_bit_by_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = record(folder.path());
    let (copy, done) = export(&own, Format::Own, &folder.path().join("copy"));
    assert_eq!((done[0].measured, done[0].pictures, done[0].left_out.len()), (400, 26, 0), "{done:?}");
    let bytes = |session: &Session| std::fs::read(session.folder.join(&session.clips[0].file)).expect("a clip");
    assert_eq!(bytes(&own), bytes(&copy));
}

/// Messages of every topic that was left out.
fn left_out(done: &[Exported]) -> Vec<(&str, usize)> {
    done[0].left_out.iter().map(|left| (left.topic.as_str(), left.messages)).collect()
}

#[test]
fn every_topic_that_is_not_carried_over_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("cell.toml"), CELL).expect("room");
    let mut writer = ClipWriter::create(&folder.path().join("clip_00.mcap"), &ClipInfo::default()).expect("a new file");
    for i in 0..400 {
        let state = state(i);
        let stamp_ns = state.stamp_ns;
        writer.arm_state(&state).expect("room");
        writer.twin_state(&TwinState { stamp_ns, dof: 7, ..TwinState::default() }).expect("room");
        if i % 2 == 0 {
            writer.arm_command(&ArmCommand { stamp_ns, dof: 7, ..ArmCommand::default() }).expect("room");
            writer.twin_gap(&TwinGap { stamp_ns, dof: 7, ..TwinGap::default() }).expect("room");
        }
        if i % 20 == 0 {
            writer.wrench(&Wrench { stamp_ns, ..Wrench::default() }).expect("room");
            let position = [0.5 + 1e-3 * i as f64, 0.1, 0.05];
            writer.object_pose(&ObjectPose { stamp_ns, position, ..ObjectPose::default() }).expect("room");
        }
    }
    writer.finish().expect("room");
    let own = Session::open(folder.path()).expect("a session");
    let twin = [("/arm/command", 200), ("/twin/gap", 200), ("/twin/state", 400)];
    let (bags, done) = export(&own, Format::Ros2, &folder.path().join("bags"));
    assert_eq!(left_out(&done), twin);
    let (_, done) = export(&own, Format::TwinAligner, &folder.path().join("folders"));
    assert_eq!(left_out(&done), [&twin[..], &[("/wrench", 20)]].concat());
    let (_, done) = export(&bags, Format::Own, &folder.path().join("back"));
    assert_eq!(left_out(&done), []);
    // A bag's own extras are for own clips alone.
    let (_, done) = export(&bags, Format::Ros2, &folder.path().join("again"));
    let extras =
        ["/franka_robot_state_broadcaster/current_pose", "/franka_robot_state_broadcaster/external_joint_torques"];
    assert_eq!(left_out(&done), extras.map(|topic| (topic, 400)));
}

#[test]
fn on_failure_nothing_stays_behind_not_even_a_folder_on_the_way() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = record(folder.path());
    let clip = folder.path().join("clip_00.mcap");
    std::fs::write(&clip, b"no clip at all").expect("room");
    let out = folder.path().join("new/deep/out");
    let order = Order { to: Format::Ros2, out: &out, force: false, flange_at: &|_| None, robot: None };
    let error = export_session(&own, order, |_| {}).expect_err("no clip").to_string();
    assert!(error.contains("clip_00.mcap"), "{error}");
    assert!(!folder.path().join("new").exists(), "an empty folder stayed behind");
}

#[test]
fn a_session_is_replaced_only_where_that_was_asked_for_and_nothing_else_lies_in_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = record(folder.path());
    let (folders, _) = export(&own, Format::TwinAligner, &folder.path().join("folders"));
    let export_to = |session: &Session, out: &Path, force: bool| {
        let order = Order { to: Format::Ros2, out, force, flange_at: &|_| None, robot: None };
        export_session(session, order, |_| {}).map_err(|error| error.to_string())
    };
    let error = export_to(&own, &folders.folder, false).expect_err("it is full");
    assert!(error.contains("folders") && error.contains("it is not empty") && error.contains("--force"), "{error}");
    assert!(folders.folder.join("traj_00000/control.json").is_file());
    let error = export_to(&folders, &folders.folder, true).expect_err("the source");
    assert!(error.contains("it holds what is exported"), "{error}");
    let notes = folders.folder.join("notes.txt");
    std::fs::write(&notes, "mine").expect("room");
    let error = export_to(&own, &folders.folder, true).expect_err("somebody's notes");
    assert!(error.contains("notes.txt"), "{error}");
    std::fs::remove_file(&notes).expect("it is there");
    export_to(&own, &folders.folder, true).expect("asked for");
    let names: Vec<String> = std::fs::read_dir(&folders.folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    assert!(names.len() == 2 && names.contains(&"clip_00.mcap".to_owned()), "{names:?}");
    let beside = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(beside, 3, "what was replaced is gone: cell.toml, clip_00.mcap, folders");
}

#[test]
fn a_folder_s_poses_need_a_camera_s_place() {
    let folder = tempfile::tempdir().expect("a folder");
    record(folder.path());
    let unposed = CELL.replace("pose = {", "# pose = {");
    std::fs::write(folder.path().join("cell.toml"), unposed).expect("room");
    let session = Session::open(folder.path()).expect("a session");
    let (_, done) = export(&session, Format::TwinAligner, &folder.path().join("unposed"));
    assert!(done[0].poses == 0 && done[0].warnings.iter().any(|w| w.contains("[camera] pose")), "{done:?}");
    assert!(left_out(&done).contains(&("/object/pose", 13)), "{done:?}");
    let _ = Cell::read(&folder.path().join("unposed/cell.toml")).expect("a cell");
}
