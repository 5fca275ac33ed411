//! A whole run of the program on the simulated cell: what it records can be read and replayed, a stop overtakes what is queued,
//! a second bridge is refused, and Ctrl-C ends it in order. Each test has its own domain of shared memory.
#![allow(missing_docs)]

use rt_bridge::rt::process::ask_to_end;
use rustix::fs::{OFlags, fcntl_setfl};
use serde_json::Value;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, SetPoint};
use shared_mem::msg::twin::TwinState;
use shared_mem::origin::Origin;
use shared_mem::recording::{ClipMessages, Payload, read_arm_states, read_origins};
use shared_mem::time::now_ns;
use shared_mem::topics::{self, ARM_MOTION, ARM_STATE};
use shared_mem::transport::{Node, Subscriber};
use std::fs::File;
use std::io::{PipeReader, PipeWriter, Write as _};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const CELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/fr3_cell.toml");

fn start(domain: &str, arguments: &[&str]) -> Child {
    start_into(domain, arguments, Stdio::piped(), Stdio::piped())
}

fn start_into(domain: &str, arguments: &[&str], stdout: Stdio, stderr: Stdio) -> Child {
    Command::new(env!("CARGO_BIN_EXE_rt_bridge"))
        .env("TWINALIGN_DOMAIN", format!("{domain}{}", std::process::id()))
        .args(["run", "--cell", CELL, "--realtime", "ignore", "--json"])
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(stdout)
        .stderr(stderr)
        .spawn()
        .expect("the program starts")
}

fn end(child: Child) -> (Output, Value) {
    let output = child.wait_with_output().expect("the program ends");
    let answer = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output, answer)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Replays a clip and records that; the messages of the kind that `wanted` likes.
fn replay(clip: &Path, again: &Path, wanted: fn(&Payload) -> bool) -> usize {
    let arguments = ["--arm", &format!("replay://{}", clip.display()), "--record", again.to_str().expect("a path")];
    let (output, answer) = end(start("replay", &arguments));
    assert!(output.status.success(), "{}", said(&output));
    assert!(answer["cycles"].as_u64() > Some(1000), "{answer}");
    let twin = "the recording's /twin/state and /twin/gap are not shown again; `twin shadow`";
    assert_eq!(said(&output).matches(twin).count(), 1, "{}", said(&output));
    // Whatever the recording was of, this one is of it.
    let name = clip.file_name().expect("a name").to_string_lossy();
    assert_eq!(Some(read_origins(again).expect("a clip")), Origin::replay(&name).map(Into::into));
    let messages = ClipMessages::open(again, &[]).expect("a clip");
    messages.filter(|m| m.as_ref().is_ok_and(|m| wanted(&m.payload))).count()
}

#[test]
fn what_was_recorded_holds_every_cycle_pictures_and_poses_and_can_be_replayed() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("clip.mcap");
    let clip_path = clip.to_str().expect("a path");
    let arguments = ["--arm", "sim", "--gripper", "sim", "--wrench", "sim", "--duration", "2", "--record", clip_path];
    let bridge = start("record", &arguments);
    // What a twin says beside it is recorded, too.
    let node = Node::open_in(&format!("record{}", std::process::id()), "a twin").expect("shared memory");
    let (states, twin) =
        (node.subscriber(ARM_STATE).expect("a place"), node.publisher(topics::TWIN_STATE).expect("a place"));
    let state = wait_for(&states, |_| true);
    for _ in 0..10 {
        let mirrored = TwinState { stamp_ns: now_ns(), dof: 7, q: state.q, ..TwinState::default() };
        twin.send(&mirrored).expect("shared memory");
        std::thread::sleep(Duration::from_millis(20));
    }
    let (output, answer) = end(bridge);
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(answer["recorded"]["lost"], 0, "{answer}");
    assert_eq!(read_origins(&clip).expect("a clip"), Origin::Simulation.into());
    let states = read_arm_states(&clip).expect("a clip");
    assert!(states.len() as u64 == answer["cycles"], "{} states of {answer}", states.len());
    assert!(states.windows(2).all(|pair| pair[1].cycle == pair[0].cycle + 1));
    // The arm holds its pose: where it was told to be, within the sag of its gains.
    assert!(states.iter().all(|s| (0..7).all(|j| (s.q[j] - s.q_d[j]).abs() < 1e-3)));
    let count = |wanted: fn(&Payload) -> bool| {
        let messages = ClipMessages::open(&clip, &[]).expect("a clip");
        messages.filter(|m| m.as_ref().is_ok_and(|m| wanted(&m.payload))).count()
    };
    assert!(count(|p| matches!(p, Payload::Picture(_))) > 20);
    assert!(count(|p| matches!(p, Payload::ObjectPose(_))) > 20);
    assert!(count(|p| matches!(p, Payload::CameraInfo(_))) > 0);
    assert!(count(|p| matches!(p, Payload::Gripper(_))) > 0);
    // The sensor carries the tool, which hangs still.
    assert!(count(|p| matches!(p, Payload::Wrench(w) if (w.force[2] - 2.4525).abs() < 0.1)) > 100);
    // Replayed, force sensor and gripper are there again, the twin of then is not.
    let (again, wrenches) = (folder.path().join("again.mcap"), count(|p| matches!(p, Payload::Wrench(_))));
    assert!(count(|p| matches!(p, Payload::TwinState(_))) > 5);
    let replayed = replay(&clip, &again, |p| matches!(p, Payload::Wrench(w) if (w.force[2] - 2.4525).abs() < 0.1));
    assert!(2 * replayed > wrenches, "{replayed} of {wrenches}");
    let third = folder.path().join("third.mcap");
    assert!(replay(&clip, &third, |p| matches!(p, Payload::Gripper(_))) > 0);
    let twins = ClipMessages::open(&third, &[topics::TWIN_STATE.name]).expect("a clip").count();
    assert_eq!(twins, 0, "nobody made a twin");
}

#[test]
fn the_bridge_tracks_the_object_in_its_own_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("clip.mcap");
    let clip_path = clip.to_str().expect("a path");
    let arguments = ["--arm", "sim", "--tracker", "rgbd", "--duration", "3", "--record", clip_path];
    let (output, _) = end(start("tracker", &arguments));
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("turned by 180 degrees it would look the same"), "{}", said(&output));
    let messages = ClipMessages::open(&clip, &[]).expect("a clip");
    let poses: Vec<_> = messages
        .filter_map(|m| match m.expect("a message").payload {
            Payload::ObjectPose(pose) => Some(pose),
            _ => None,
        })
        .collect();
    assert!(poses.len() > 3, "{} poses", poses.len());
    // Where cell.toml puts the box.
    for pose in poses {
        let [x, y, z] = pose.position;
        assert!((x - 0.55).hypot(y).hypot(z - 0.05) < 0.003, "{:?}", pose.position);
        assert!(pose.covariance[0] > 0.0 && pose.covariance[0] < 1e-5, "{}", pose.covariance[0]);
    }
    let refused = end(start("tracker2", &["--arm", "sim", "--tracker", "replay"])).0;
    assert!(!refused.status.success() && said(&refused).contains("--arm replay://"), "{}", said(&refused));
}

#[test]
fn a_running_bridge_passes_orders_on_to_its_gripper() {
    let bridge = start("grip", &["--arm", "sim", "--camera", "off", "--gripper", "sim"]);
    let ask = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_rt_bridge"))
            .env("TWINALIGN_DOMAIN", format!("grip{}", std::process::id()))
            .args(["grip", "--json"])
            .args(arguments)
            .output()
            .expect("the program starts")
    };
    let told = |arguments: &[&str]| {
        // A busy machine takes its time until the bridge is up.
        let mut answers = std::iter::repeat_with(|| ask(arguments)).take(12);
        let output = answers.find(|answer| !said(answer).contains("no bridge shows a gripper"));
        let output = output.expect("a bridge within a minute");
        assert!(output.status.success(), "{}", said(&output));
        serde_json::from_slice::<Value>(&output.stdout).expect("one object")
    };
    let answer = told(&["move", "0.03"]);
    assert_eq!((answer["width"].as_f64(), answer["width_d"].as_f64()), (Some(0.03), Some(0.03)));
    assert_eq!(told(&["home"])["width"].as_f64(), Some(0.08));
    // Nothing stands between the fingers, and they open no wider.
    for (order, why) in [
        (["grasp", "0.04"], "nothing is held"),
        (["grasp", "0.002"], "nothing is held"),
        (["move", "0.3"], "opens no further than 0.080 m"),
    ] {
        let output = ask(&order);
        assert_eq!(output.status.code(), Some(1), "{order:?}: {}", said(&output));
        assert!(said(&output).contains(why), "{order:?}: {}", said(&output));
        assert!(serde_json::from_slice::<Value>(&output.stdout).expect("one object")["width"].is_f64());
    }
    ask_to_end(bridge.id()).expect("it still runs");
    let (output, _) = end(bridge);
    assert!(output.status.success(), "{}", said(&output));
}

/// Waits for the newest state that `wanted` likes.
fn wait_for(states: &Subscriber<ArmState>, wanted: impl Fn(&ArmState) -> bool) -> ArmState {
    for _ in 0..6000 {
        if let Some(state) = states.newest().expect("shared memory").filter(&wanted) {
            return state;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("not within half a minute");
}

/// The last joint swings by `0.1 (1 - cos wt)^2` rad at `w` = 2 rad/s: begins at rest.
fn swing(from: &ArmState, index: u32) -> MotionChunk {
    let mut chunk = MotionChunk { motion_id: 7, index, length: 50, dof: 7, ..MotionChunk::default() };
    for (k, point) in (50 * index..).zip(&mut chunk.set_points) {
        let (sin, cos) = (2e-3 * f64::from(k)).sin_cos();
        *point = SetPoint { q_d: from.q_d, dq_d: [0.0; 8] };
        point.q_d[6] += 0.1 * (1.0 - cos) * (1.0 - cos);
        point.dq_d[6] = 0.4 * (1.0 - cos) * sin;
    }
    chunk
}

#[test]
fn a_stop_of_another_sender_overtakes_a_motion_that_fills_every_queue() {
    let bridge = start("stop", &["--arm", "sim", "--camera", "off", "--duration", "60"]);
    let node = Node::open_in(&format!("stop{}", std::process::id()), "a test").expect("shared memory");
    let states = node.subscriber(ARM_STATE).expect("a place");
    let (motions, stops) = (node.publisher(ARM_MOTION).expect("a place"), node.publisher(ARM_MOTION).expect("a place"));
    let held = wait_for(&states, |_| true);
    // 81 chunks fit into the player's queue and 80 before it; the bridge takes a chunk a cycle.
    for index in 0..160 {
        motions.send(&swing(&held, index)).expect("shared memory");
        std::thread::sleep(Duration::from_millis(3));
    }
    let full = wait_for(&states, |state| state.motion_queued > 3900);
    assert_eq!(full.motion, MotionStatus::Playing);
    // More than shared memory keeps, as fast as it goes: the oldest of them are lost, and the stop is not.
    let flood = || (160..300).for_each(|index| motions.send(&swing(&held, index)).expect("shared memory"));
    flood();
    stops.send(&MotionChunk { kind: MotionKind::Stop, ..MotionChunk::default() }).expect("shared memory");
    flood();
    let braked = wait_for(&states, |state| state.motion == MotionStatus::Braked);
    // Not in its turn, which would be some 4000 cycles later; a busy machine takes its time to hand it over.
    assert!(braked.motion_played < full.motion_played + 1000, "{} after {}", braked.motion_played, full.motion_played);
    let rests = wait_for(&states, |state| state.motion == MotionStatus::Braked && state.dq_d[6] == 0.0);
    assert_eq!((rests.motion_id, rests.motion_queued), (7, 0));
    motions.send(&swing(&held, 160)).expect("shared memory");
    let later = wait_for(&states, |state| state.cycle > rests.cycle + 100);
    assert_eq!((later.motion, later.q_d), (MotionStatus::Braked, rests.q_d));
    ask_to_end(bridge.id()).expect("it still runs");
    let (output, _) = end(bridge);
    assert!(output.status.success(), "{}", said(&output));
    assert!(!said(&output).contains("refused"), "{}", said(&output));
}

#[test]
fn a_device_that_is_not_there_is_refused_before_the_arm_is_driven() {
    let (output, _) = end(start("absent", &["--arm", "sim", "--gripper", "serial:///dev/no-such-port"]));
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("serial:///dev/no-such-port cannot be opened"), "{}", said(&output));
    let (output, _) = end(start("absent", &["--arm", "replay://clip.mcap", "--wrench", "sim"]));
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_second_bridge_is_refused_in_one_line_and_the_first_goes_on() {
    let first = start("second", &["--arm", "sim", "--camera", "off"]);
    std::thread::sleep(Duration::from_millis(800));
    let (output, _) = end(start("second", &["--arm", "sim", "--camera", "off", "--duration", "1"]));
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said(&output).contains("another rt_bridge is running; stop it, or set TWINALIGN_DOMAIN"),
        "{}",
        said(&output)
    );
    ask_to_end(first.id()).expect("it still runs");
    let (output, answer) = end(first);
    assert!(output.status.success(), "{}", said(&output));
    assert!(answer["cycles"].as_u64() > Some(500), "{answer}");
}

/// Longest wait for something that takes a second; only a fault uses it up.
const LONG: Duration = Duration::from_secs(30);

/// Has the arm of a bridge play a motion that holds its pose, so that the bridge has something to say, and waits until
/// states tell that it is done and go on after it.
fn play(domain: &str) {
    let node = Node::open_in(&format!("{domain}{}", std::process::id()), "test").expect("shared memory");
    let states = node.subscriber(ARM_STATE).expect("a place to read");
    let motions = node.publisher(ARM_MOTION).expect("a place to write");
    let wait_for = |what: &str, wanted: &dyn Fn(&ArmState) -> bool| {
        let begin = Instant::now();
        loop {
            match states.newest().expect("a state") {
                Some(state) if wanted(&state) => return state,
                _ => assert!(begin.elapsed() < LONG, "{what}: no such state came"),
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    let here = wait_for("the bridge is up", &|_| true);
    let set_points = [SetPoint { q_d: here.q_d, ..SetPoint::default() }; CHUNK_LENGTH];
    let (kind, length) = (MotionKind::Last, CHUNK_LENGTH as u32);
    motions
        .send(&MotionChunk { motion_id: 7, kind, length, dof: here.dof, set_points, ..MotionChunk::default() })
        .expect("room for a chunk");
    let done = wait_for("the motion is played", &|state| state.motion_id == 7 && state.motion == MotionStatus::Done);
    wait_for("the bridge goes on", &|state| state.cycle > done.cycle + 100);
}

/// Ends a bridge as Ctrl-C does.
fn interrupt(mut bridge: Child) -> (Output, Value) {
    ask_to_end(bridge.id()).expect("it still runs");
    let begin = Instant::now();
    while bridge.try_wait().expect("a child").is_none() {
        if begin.elapsed() > LONG {
            let _dead = bridge.kill();
            panic!("it does not end: {}", said(&end(bridge).0));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    end(bridge)
}

/// The clip is whole: states without a gap up to the last one, and what the bridge had to say.
fn assert_recorded(clip: &Path, count: Option<u64>) {
    let states = read_arm_states(clip).expect("a clip");
    assert!(states.windows(2).all(|pair| pair[1].cycle == pair[0].cycle + 1));
    assert!(count.is_none_or(|count| count == states.len() as u64), "{} states of {count:?}", states.len());
    let messages = ClipMessages::open(clip, &[topics::EVENTS.name]).expect("a clip");
    let events: Vec<String> = messages
        .filter_map(|m| match m.expect("a message").payload {
            Payload::Event(event) => Some(event.text().to_owned()),
            _ => None,
        })
        .collect();
    assert!(events.iter().any(|text| text == "motion 7 done"), "{events:?}");
}

/// A pipe that takes nothing more as long as nobody reads.
fn full_pipe() -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = std::io::pipe().expect("a pipe");
    fcntl_setfl(&writer, OFlags::NONBLOCK).expect("a flag");
    for size in [4096, 1] {
        while writer.write(&[b'.'; 4096][..size]).is_ok() {}
    }
    fcntl_setfl(&writer, OFlags::empty()).expect("a flag");
    (reader, writer)
}

#[test]
fn a_standard_error_that_takes_nothing_stops_neither_arm_nor_recording_nor_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let (unread, full) = full_pipe();
    let (reader, closed) = std::io::pipe().expect("a pipe");
    drop(reader);
    let disk = File::options().write(true).open("/dev/full").expect("Linux has it");
    for (name, stderr) in [("full", Stdio::from(full)), ("closed", Stdio::from(closed)), ("disk", Stdio::from(disk))] {
        let clip = folder.path().join(format!("{name}.mcap"));
        let clip_path = clip.to_str().expect("a path");
        let arguments = ["--arm", "sim", "--camera", "off", "--record", clip_path];
        let bridge = start_into(name, &arguments, Stdio::piped(), stderr);
        play(name);
        let (output, answer) = interrupt(bridge);
        assert_eq!(output.status.code(), Some(0), "{name}: {answer}");
        assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{name}: {answer}");
        assert_recorded(&clip, answer["cycles"].as_u64());
    }
    drop(unread);
}

#[test]
fn an_answer_that_nobody_takes_is_one_line_and_the_recording_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("clip.mcap");
    let disk = File::options().write(true).open("/dev/full").expect("Linux has it");
    let arguments = ["--arm", "sim", "--camera", "off", "--record", clip.to_str().expect("a path")];
    let bridge = start_into("answer", &arguments, Stdio::from(disk), Stdio::piped());
    play("answer");
    let (output, _) = interrupt(bridge);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let last = said(&output).lines().last().unwrap_or_default().to_owned();
    assert!(last.starts_with("error: the answer cannot be written"), "{}", said(&output));
    assert!(!said(&output).contains("panicked"), "{}", said(&output));
    assert_recorded(&clip, None);
}
