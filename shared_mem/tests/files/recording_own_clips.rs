//! Own clips: what is written comes back, a killed writer loses little, a full disk is told.

use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface, MotionStatus};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::gripper::GripperState;
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding, StampDomain};
use shared_mem::msg::joints_from;
use shared_mem::msg::object::{ObjectName, ObjectPose};
use shared_mem::msg::target::{ArmTarget, GripperTarget, TargetKind};
use shared_mem::msg::twin::{TwinGap, TwinObject, TwinState};
use shared_mem::msg::wrench::Wrench;
use shared_mem::recording::{
    ClipInfo, ClipMessages, ClipWriter, Payload, Picture, Session, WriteError, read_arm_states, read_clip,
    read_clip_info,
};
use shared_mem::topics;
use std::io::{self, Write};
use std::path::Path;

const CELL: &str = "[robot]\nmodel = \"fr3\"\n";

fn info() -> ClipInfo {
    ClipInfo {
        cell_toml: Some(CELL.into()),
        configuration: "rate = 1000\n".into(),
        program: "test 1.2.3".into(),
        ..ClipInfo::default()
    }
}

/// A state whose every number differs from every other.
fn state(i: u64) -> ArmState {
    let joints = |k: f64| joints_from(&(0..7).map(|j| k + 0.1 * f64::from(j) + 1e-3 * i as f64).collect::<Vec<_>>());
    ArmState {
        stamp_ns: 5_000_000_000 + i * 1_000_000,
        device_ns: i * 1_000_000,
        cycle: i,
        session: 77,
        dof: 7,
        mode: ArmMode::Reflex,
        q: joints(0.0),
        dq: joints(-1.0),
        q_d: joints(1.0),
        dq_d: joints(2.0),
        tau_J: joints(3.0),
        tau_J_d: joints(4.0),
        tau_ext: joints(5.0),
        O_T_EE: std::array::from_fn(|k| k as f64),
        success_rate: 0.97,
        motion_id: 3,
        motion_played: 11,
        motion_queued: 12,
        motion: MotionStatus::Braked,
        ..ArmState::default()
    }
}

fn pose(i: u64) -> ObjectPose {
    ObjectPose {
        stamp_ns: 5_000_000_000 + i * 33_000_000,
        device_ns: i,
        sequence: i,
        position: [0.1, 0.2, 0.3],
        wxyz: [0.5, 0.5, -0.5, 0.5],
        covariance: std::array::from_fn(|k| k as f64 * 1e-6),
    }
}

/// What arm and gripper are steered by.
fn targets() -> [Payload; 2] {
    let arm_target = ArmTarget {
        stamp_ns: 1,
        stream: 2,
        kind: TargetKind::Pose,
        dof: 2,
        speed: 0.3,
        q: joints_from(&[0.4, 0.5]),
        position: [0.6, 0.7, 0.8],
        wxyz: [0.0, 0.0, 1.0, 0.0],
    };
    let gripper_target = GripperTarget { stamp_ns: 1, stream: 2, width: 0.03, speed: 0.04, force: 5.0 };
    [Payload::ArmTarget(Box::new(arm_target)), Payload::GripperTarget(gripper_target)]
}

/// One payload of every kind.
fn one_of_each() -> Vec<Payload> {
    let header = ImageHeader {
        stamp_ns: 9,
        device_ns: 8,
        sequence: 7,
        exposure_ns: 6,
        width: 2,
        height: 1,
        stride: 4,
        encoding: PixelEncoding::Depth16,
        depth_scale: 0.001,
        stamp_domain: StampDomain::GlobalTime,
        reserved: 0,
    };
    let event = Event { stamp_ns: 4, ..Event::new(EventLevel::Warning, EventSource::Capture, "the arm stopped: ä") };
    let camera = CameraInfo {
        stamp_ns: 3,
        width: 640,
        height: 480,
        intrinsics: [600.0, 601.0, 320.5, 240.5],
        distortion: [0.1, 0.2, 0.3, 0.4, 0.5],
        position: [1.0, 2.0, 3.0],
        wxyz: [0.0, 1.0, 0.0, 0.0],
    };
    let command = ArmCommand {
        stamp_ns: 2,
        answers_device_ns: 1,
        cycle: 9,
        dof: 2,
        interface: CommandInterface::JointPosition,
        q_d: joints_from(&[0.1, 0.2]),
        dq_d: joints_from(&[0.3, 0.4]),
        tau_J_d: joints_from(&[0.5, 0.6]),
    };
    let twin = TwinState {
        stamp_ns: 1,
        mirrors_ns: 2,
        cycle: 3,
        dof: 1,
        has_object: 1,
        q: joints_from(&[0.7]),
        dq: joints_from(&[0.8]),
        tau_J: joints_from(&[0.9]),
        object_position: [0.1, 0.2, 0.3],
        object_wxyz: [1.0, 0.0, 0.0, 0.0],
        contact_force: 4.5,
    };
    let gap = TwinGap {
        stamp_ns: 6,
        cycle: 7,
        dof: 1,
        alignments: 8,
        joint_error: joints_from(&[0.01]),
        joint_rms: joints_from(&[0.02]),
        object_add_m: 0.03,
        object_add_s_m: 0.04,
        age_ns: 9,
    };
    let wrench =
        Wrench { stamp_ns: 1, device_ns: 2, sequence: 3, force: [4.0; 3], torque: [5.0; 3], saturated: 6, reserved: 0 };
    let gripper = GripperState { stamp_ns: 1, width: 0.08, width_d: 0.02, force: 30.0, grasped: 1, fault: 2 };
    let [arm_target, gripper_target] = targets();
    vec![
        arm_target,
        gripper_target,
        Payload::ArmState(Box::new(state(1))),
        Payload::ArmCommand(Box::new(command)),
        Payload::ObjectPose(Box::new(pose(1))),
        Payload::CameraInfo(Box::new(camera)),
        Payload::Picture(Picture::Pixels { header, pixels: vec![1, 2, 3, 4] }),
        Payload::Wrench(wrench),
        Payload::Gripper(gripper),
        Payload::TwinState(Box::new(twin)),
        Payload::TwinGap(Box::new(gap)),
        Payload::TwinObject(Box::new(twin_object())),
        Payload::Event(Box::new(event)),
    ]
}

fn twin_object() -> TwinObject {
    TwinObject {
        stamp_ns: 7,
        mirrors_ns: 5,
        position: [0.1, 0.2, 0.3],
        wxyz: [0.0, 1.0, 0.0, 0.0],
        add_m: 0.004,
        add_s_m: 0.003,
        name: ObjectName::new("milk_box").expect("a name"),
    }
}

fn write<W: Write>(writer: &mut ClipWriter<W>, payload: &Payload) -> Result<(), WriteError> {
    match payload {
        Payload::ArmState(m) => writer.arm_state(m),
        Payload::ArmCommand(m) => writer.arm_command(m),
        Payload::ObjectPose(m) => writer.object_pose(m),
        Payload::CameraInfo(m) => writer.camera_info(m),
        Payload::Picture(Picture::Pixels { header, pixels }) => writer.image(topics::CAMERA_DEPTH, header, pixels),
        Payload::Picture(other) => panic!("{other:?}"),
        Payload::Wrench(m) => writer.wrench(m),
        Payload::Gripper(m) => writer.gripper(m),
        Payload::ArmTarget(m) => writer.arm_target(m),
        Payload::GripperTarget(m) => writer.gripper_target(m),
        Payload::TwinState(m) => writer.twin_state(m),
        Payload::TwinGap(m) => writer.twin_gap(m),
        Payload::TwinObject(m) => writer.twin_object(m),
        Payload::Event(m) => writer.event(m),
    }
}

fn fr3() -> Cell {
    Cell::parse(CELL, Path::new("cell.toml")).expect("a valid cell")
}

#[test]
fn every_payload_comes_back_as_it_was_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    let mut writer = ClipWriter::create(&path, &info()).expect("a new file");
    let payloads = one_of_each();
    for payload in &payloads {
        write(&mut writer, payload).expect("room on the disk");
    }
    let summary = writer.finish().expect("room on the disk");
    assert_eq!(summary.messages, payloads.len() as u64);
    assert_eq!(summary.bytes, std::fs::metadata(&path).expect("the file").len());
    let mut messages = ClipMessages::open(&path, &[]).expect("a clip");
    let read: Vec<Payload> = messages.by_ref().map(|m| m.expect("a message").payload).collect();
    assert_eq!(read, payloads);
    assert_eq!(messages.damage(), None);
    assert_eq!(read_clip_info(&path).expect("a clip"), Some(info()));
    let wrench = ClipMessages::open(&path, &["/wrench"]).expect("a clip").count();
    assert_eq!(wrench, 1);
}

#[test]
fn messages_are_logged_in_unix_time_and_keep_their_own_stamps() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    let mut writer = ClipWriter::create(&path, &info()).expect("a new file");
    let now = ArmState { stamp_ns: shared_mem::time::now_ns(), ..state(0) };
    writer.arm_state(&now).expect("room");
    writer.finish().expect("room");
    let message = ClipMessages::open(&path, &[]).expect("a clip").next().expect("one message").expect("a message");
    let unix = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970");
    let age_s = unix.as_secs_f64() - message.log_time_ns as f64 * 1e-9;
    assert!((0.0..60.0).contains(&age_s), "logged {age_s} s ago");
    assert_eq!(message.payload, Payload::ArmState(Box::new(now)));
}

#[test]
fn a_killed_writer_loses_only_what_came_after_its_last_flush() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    let mut writer = ClipWriter::create(&path, &info()).expect("a new file");
    for i in 0..100 {
        writer.arm_state(&state(i)).expect("room");
    }
    writer.flush().expect("room");
    assert_eq!(writer.bytes_written(), std::fs::metadata(&path).expect("the file").len());
    writer.arm_state(&state(100)).expect("room");
    std::mem::forget(writer); // what a kill leaves behind: no destructor runs
    assert_eq!(read_arm_states(&path).expect("a readable clip"), (0..100).map(state).collect::<Vec<_>>());
    let clip = read_clip(&path, ClipKind::Excitation, &fr3()).expect("a readable clip");
    assert_eq!(clip.measured.len(), 100);
    assert!(clip.damage.is_some_and(|d| d.contains("cut")));
}

#[test]
fn a_clip_without_its_cell_toml_opens_with_the_one_it_carries() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("alone.mcap");
    let mut writer = ClipWriter::create(&path, &info()).expect("a new file");
    (0..30).for_each(|i| writer.arm_state(&state(i)).expect("room"));
    writer.finish().expect("room");
    let session = Session::open(&path).expect("the clip carries its cell");
    assert_eq!(session.clips.len(), 1);
    let clip = session.read(&session.clips[0]).expect("a clip");
    assert_eq!(clip.joint_names[6], "fr3_joint7");
    assert_eq!(clip.measured.q_row(3), &state(3).q[..7]);
    assert_eq!(clip.desired.tau_row(3), Some(&state(3).tau_J_d[..7]));
    assert_eq!(clip.warnings, Vec::<String>::new());
}

#[test]
fn a_clip_that_no_cell_toml_lists_is_about_what_was_recorded() {
    let folder = tempfile::tempdir().expect("a folder");
    let object = "[object]\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n";
    let info = ClipInfo { cell_toml: Some(format!("{CELL}{object}")), ..info() };
    for (name, poses, kind) in [("arm", 0, ClipKind::Excitation), ("stroke", 3, ClipKind::ControlHitSlide)] {
        let path = folder.path().join(name);
        let mut writer = ClipWriter::create(&path, &info).expect("a new file");
        (0..30).for_each(|i| writer.arm_state(&state(i)).expect("room"));
        (0..poses).for_each(|i| writer.object_pose(&pose(i)).expect("room"));
        writer.finish().expect("room");
        let session = Session::open(&path).expect("the clip carries its cell");
        assert_eq!(session.clips[0].kind, kind, "{name}");
        assert_eq!(session.read(&session.clips[0]).expect("a clip").object.len(), poses as usize);
    }
}

#[test]
fn an_existing_file_is_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    std::fs::write(&path, b"precious").expect("a file");
    let error = ClipWriter::create(&path, &info()).err().expect("a refusal").to_string();
    assert!(error.contains("exists"), "{error}");
    assert_eq!(std::fs::read(&path).expect("the file"), b"precious");
}

#[test]
fn a_file_that_a_killed_recorder_left_empty_is_told_from_one_that_is_no_clip() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    let how = "is no MCAP file; record one with `rt_bridge record --out clip.mcap` or `ros2 bag record -s mcap";
    for (text, told) in
        [(&b""[..], "is empty: its recorder"), (b"a poem", how), (b"SQLite format 3\0", "`calibration import FILE")]
    {
        std::fs::write(&path, text).expect("a file");
        let error = read_arm_states(&path).expect_err("nothing to read").to_string();
        assert!(error.contains(told), "{error}");
    }
}

/// A disk with little room.
struct SmallDisk {
    room: usize,
    written: std::sync::Arc<std::sync::Mutex<Vec<u8>>>,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut written = self.written.lock().expect("one writer");
        let fits = bytes.len().min(self.room - written.len());
        if fits == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        written.extend(&bytes[..fits]);
        Ok(fits)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_told_and_what_was_flushed_stays_readable() {
    let written = std::sync::Arc::default();
    let disk = SmallDisk { room: 60_000, written: std::sync::Arc::clone(&written) };
    let mut writer = ClipWriter::with_sink(disk, Path::new("/full/clip.mcap"), &info()).expect("room for the start");
    let (mut flushed, mut error) = (0, None);
    for i in 0..10_000 {
        let result = writer.arm_state(&state(i)).and_then(|()| if i % 50 == 49 { writer.flush() } else { Ok(()) });
        match result {
            Ok(()) if i % 50 == 49 => flushed = i + 1,
            Ok(()) => {}
            Err(e) => {
                error = Some(e);
                break;
            }
        }
    }
    let error = error.expect("the disk fills up");
    assert!(matches!(error, WriteError::DiskFull { .. }), "{error:?}");
    assert!(error.to_string().contains("/full/clip.mcap") && error.to_string().contains("free some space"));
    assert!(writer.arm_state(&state(0)).and_then(|()| writer.flush()).is_err(), "a failed writer stays failed");
    drop(writer);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    std::fs::write(&path, &*written.lock().expect("one writer")).expect("room");
    assert!(flushed > 50, "{flushed}");
    assert_eq!(read_arm_states(&path).expect("a readable clip"), (0..flushed).map(state).collect::<Vec<_>>());
}

#[test]
#[cfg(target_os = "linux")]
fn the_systems_own_word_for_a_full_disk_is_understood() {
    let device = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has a full device");
    let error = ClipWriter::with_sink(device, Path::new("/dev/full"), &info()).err().expect("no room at all");
    assert!(matches!(error, WriteError::DiskFull { bytes: 0, .. }), "{error:?}");
}

#[test]
#[ignore = "needs a file system of a few MB, say a tmpfs: TWINALIGN_SMALL_DISK=FOLDER cargo test --release -p shared_mem --test files recording_own_clips -- --ignored"]
fn a_file_system_that_fills_up_leaves_a_readable_clip() {
    let folder = std::env::var_os("TWINALIGN_SMALL_DISK").expect("TWINALIGN_SMALL_DISK names a folder");
    let path = Path::new(&folder).join("clip.mcap");
    let _ = std::fs::remove_file(&path);
    let mut writer = ClipWriter::create(&path, &info()).expect("room for the start");
    let error = (0..10_000_000u64).find_map(|i| {
        let written = writer.arm_state(&state(i));
        written.and_then(|()| if i % 500 == 499 { writer.flush() } else { Ok(()) }).err()
    });
    assert!(matches!(error, Some(WriteError::DiskFull { .. })), "{error:?}");
    drop(writer);
    let states = read_arm_states(&path).expect("a readable clip");
    assert!(states.len() >= 500 && states.len().is_multiple_of(500), "{} states", states.len());
}

const DAY: u64 = 86_400_000_000_000;
const BEGIN: u64 = 200_000_000_000_000;

/// 0.4 s of states at 1 kHz and poses at 100 Hz; `change` may change what is written, or leave it out.
fn stroke(folder: &Path, change: impl Fn(&mut Payload, u64) -> bool) -> shared_mem::recording::Clip {
    let path = folder.join("clip.mcap");
    let _not_there = std::fs::remove_file(&path);
    let mut writer = ClipWriter::create(&path, &info()).expect("a new file");
    for i in 0..400 {
        let at = BEGIN + i * 1_000_000;
        let own = ArmState { stamp_ns: at + (i * 7919) % 60_000, device_ns: BEGIN / 2 + i * 1_000_000, ..state(i) };
        let mut payloads = vec![Payload::ArmState(Box::new(own))];
        if i % 4 == 0 {
            payloads.push(Payload::ObjectPose(Box::new(ObjectPose { stamp_ns: at, ..pose(i / 4) })));
        }
        for mut payload in payloads {
            let row = if matches!(payload, Payload::ArmState(_)) { i } else { i / 4 };
            if change(&mut payload, row) {
                write(&mut writer, &payload).expect("room");
            }
        }
    }
    writer.finish().expect("room");
    read_clip(&path, ClipKind::ControlHitSlide, &fr3()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_row_with_a_stamp_of_zero_or_a_day_off_is_left_out_and_the_rest_is_as_if_it_had_not_been_recorded() {
    type Stamp = fn(&mut Payload) -> Option<&mut u64>;
    let host: Stamp = |payload| if let Payload::ArmState(s) = payload { Some(&mut s.stamp_ns) } else { None };
    let device: Stamp = |payload| if let Payload::ArmState(s) = payload { Some(&mut s.device_ns) } else { None };
    let of_pose: Stamp = |payload| if let Payload::ObjectPose(p) = payload { Some(&mut p.stamp_ns) } else { None };
    let folder = tempfile::tempdir().expect("a folder");
    for (stamp, topic) in [(host, "/arm/state"), (device, "/arm/state"), (of_pose, "/object/pose")] {
        for row in [0, 41, 99] {
            let without = stroke(folder.path(), |payload, i| stamp(payload).is_none() || i != row);
            for shift in [0, DAY, DAY.wrapping_neg()] {
                let clip = stroke(folder.path(), |payload, i| {
                    if let Some(stamp) = stamp(payload).filter(|_| i == row) {
                        *stamp = if shift == 0 { 0 } else { stamp.wrapping_add(shift) };
                    }
                    true
                });
                let told = clip.warnings.iter().filter(|w| w.contains(topic) && w.contains("left out")).count();
                let named = format!("row {row}: ");
                assert!(told == 1 && clip.warnings.iter().any(|w| w.contains(&named)), "{:?}", clip.warnings);
                let rest = |clip: &shared_mem::recording::Clip| {
                    (clip.measured.clone(), clip.desired.clone(), clip.object.clone())
                };
                assert_eq!(rest(&clip), rest(&without), "{topic}, row {row}, {shift}");
            }
        }
    }
}
