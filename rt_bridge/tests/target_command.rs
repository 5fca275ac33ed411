//! `rt_bridge target` against a running bridge: joints and poses are reached, a sender that is killed has the arm braked, and a
//! second one is refused in one line. Each test has its own domain of shared memory.
#![allow(missing_docs)]

mod running;

use running::{CELL, LONG, bridge, end, program, said, target, wait_for};
use serde_json::Value;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::target::ArmTarget;
use shared_mem::recording::{ClipMessages, Payload};
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_STATE, ARM_TARGET, GRIPPER};
use shared_mem::transport::Node;
use std::time::{Duration, Instant};

/// The same, sent now.
fn fresh(target: &ArmTarget) -> ArmTarget {
    ArmTarget { stamp_ns: now_ns(), ..*target }
}

#[test]
fn joints_poses_and_fingers_get_where_they_are_sent() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("clip.mcap");
    let bridge = bridge("targets", &["--record", clip.to_str().expect("a path")]);
    let here = target("targets", &["joints", "0,-0.6,0,-2.2,0,1.6,0.785", "--speed", "0.5", "--json"]);
    assert!(here.status.success(), "{}", said(&here));
    let answer: Value = serde_json::from_slice(&here.stdout).expect("JSON");
    assert!((answer["q_d"][1].as_f64().expect("a number") + 0.6).abs() < 1e-6, "{answer}");
    let up = target("targets", &["shift", "0,0.03,0.05", "--cell", CELL, "--json"]);
    assert!(up.status.success(), "{}", said(&up));
    let answer: Value = serde_json::from_slice(&up.stdout).expect("JSON");
    assert!(answer["off_m"].as_f64().expect("a number") < 1e-4, "{answer}");
    let fingers = target("targets", &["fingers", "0.03", "--json"]);
    assert!(fingers.status.success(), "{}", said(&fingers));
    assert!(end(bridge).status.success());
    // What the arm was steered by is in the recording.
    let (mut joints, mut widths) = (0, 0);
    for message in ClipMessages::open(&clip, &[]).expect("a clip") {
        match message.expect("a message").payload {
            Payload::ArmTarget(target) => joints += usize::from((target.q[1] + 0.6).abs() < 1e-9),
            Payload::GripperTarget(target) => widths += usize::from((target.width - 0.03).abs() < 1e-9),
            _ => {}
        }
    }
    assert!(joints > 0 && widths > 0, "{joints} and {widths} targets");
}

#[test]
fn a_sender_that_dies_has_the_arm_braked_and_a_second_one_is_refused() {
    let bridge = bridge("dies", &[]);
    let node = Node::open_in(&format!("dies{}", std::process::id()), "a test").expect("shared memory");
    let (states, targets) =
        (node.subscriber(ARM_STATE).expect("a place"), node.publisher(ARM_TARGET).expect("a place"));
    let here = wait_for(&states, |state| state.cycle > 10);
    let mut far = ArmTarget { stream: 5, dof: 7, speed: 0.2, q: here.q_d, ..ArmTarget::default() };
    far.q[0] += 2.0;
    let send_until = |wanted: &dyn Fn(&ArmState) -> bool| {
        let begin = Instant::now();
        while begin.elapsed() < LONG {
            targets.send(&fresh(&far)).expect("shared memory");
            if states.newest().expect("shared memory").is_some_and(|state| wanted(&state)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("not within half a minute");
    };
    send_until(&|state| state.motion_id == 5 && state.dq_d[0] > 0.2);
    let mut second = program("dies", &["target", "joints", "0,-0.6,0,-2.2,0,1.6,0.785"]).spawn().expect("it starts");
    let begin = Instant::now();
    while second.try_wait().expect("a child").is_none() {
        assert!(begin.elapsed() < LONG, "it is refused");
        send_until(&|_| true);
    }
    let second = second.wait_with_output().expect("it ended");
    assert_eq!(second.status.code(), Some(1));
    assert!(said(&second).contains("motion 5 is under way"), "{}", said(&second));
    // Nobody sends any more.
    let begin = Instant::now();
    let braked = wait_for(&states, |state| state.motion == MotionStatus::Braked);
    assert!(braked.dq_d[0] > 0.0 || braked.motion_id == 5);
    let rests = wait_for(&states, |state| state.motion == MotionStatus::Braked && state.dq_d[0] == 0.0);
    eprintln!("braked and at rest {:.3} s after the last target", begin.elapsed().as_secs_f64());
    let later = wait_for(&states, |state| state.cycle > rests.cycle + 200);
    assert_eq!(later.q_d, rests.q_d, "it holds");
    let output = end(bridge);
    assert_eq!(said(&output).matches("refused").count(), 1, "{}", said(&output));
    assert!(said(&output).contains("no target came for 0.2 s"), "{}", said(&output));
}

/// 2 for 0.2, a minus too many, a zero too few.
#[test]
fn what_a_person_mistypes_is_said_before_anything_moves() {
    let folder = tempfile::tempdir().expect("a folder");
    let with_gripper = folder.path().join("cell.toml");
    let cell = std::fs::read_to_string(CELL).expect("a cell") + "\n[gripper]\nmodel = \"franka_hand\"\n";
    std::fs::write(&with_gripper, cell).expect("a file");
    let with_gripper = with_gripper.to_str().expect("a path");
    let bridge = bridge("mistyped", &[]);
    let node = Node::open_in(&format!("mistyped{}", std::process::id()), "a test").expect("shared memory");
    let (states, fingers) = (node.subscriber(ARM_STATE).expect("a place"), node.subscriber(GRIPPER).expect("a place"));
    wait_for(&states, |state| state.cycle > 10);
    let apart = || {
        let newest = (0..500).find_map(|_| {
            std::thread::sleep(Duration::from_millis(10));
            fingers.newest().expect("shared memory")
        });
        newest.expect("a gripper").width
    };
    let width = apart();
    let stays = |arguments: &[&str], why: &str| {
        let here = wait_for(&states, |_| true);
        let output = target("mistyped", arguments);
        assert!(output.status.code() == Some(1) && said(&output).contains(why), "{arguments:?}: {}", said(&output));
        let later = wait_for(&states, |_| true);
        assert_eq!((later.q_d, later.motion_id), (here.q_d, here.motion_id), "{arguments:?}");
    };
    for (arguments, why) in [
        (&["pose", "2,0.1,0.4,0,1,0,0", "--cell", CELL][..], "out of reach"),
        (&["pose", "1.4,0,0.4,0,1,0,0", "--cell", CELL], "out of reach"),
        (&["pose", "0.307,0,-0.15,0,1,0,0", "--cell", CELL], "workspace"),
        (&["shift", "0.9,0,0", "--cell", CELL], "out of reach"),
        (&["shift", "0,0,-0.5", "--cell", CELL], "workspace"),
        (&["joints", "0,-0.6,0,1.2,0,1.6,0.785"], "joint 4"),
        (&["joints", "0,-0.6,0,1.2,0,1.6,0.785", "--cell", CELL], "nothing moved: at that goal joint 4"),
        (&["joints", "0,1.6,0,-0.6,0,1.5,0.785"], "workspace"),
        (&["joints", "0,1.6,0,-0.6,0,1.5,0.785", "--cell", CELL], "nothing moved: at that goal arm or tool"),
        (&["joints", "0,-0.6,0,-2.2,0,1.6", "--cell", CELL], "7 joints and 6 positions"),
        (&["fingers", "0.3", "--cell", with_gripper], "opens to 0.08 m"),
    ] {
        stays(arguments, why);
    }
    assert!((apart() - width).abs() < 1e-9);
    // Here and there the arm is clear of the table, and on the way between it is not.
    let here = target("mistyped", &["joints", "0,0.3,0,-2.4,0,1.2,0.785", "--speed", "1", "--cell", CELL]);
    assert!(here.status.success(), "{}", said(&here));
    stays(&["joints", "0,0.6,0,-2.4,0,4.3,0.785", "--cell", CELL], "nothing moved: on the way there arm or tool");
    let output = end(bridge);
    assert_eq!(said(&output).matches("began").count(), 1, "{}", said(&output));
}

#[test]
fn a_stop_from_anybody_brakes_the_arm_and_voids_what_was_sending() {
    let nobody = program("stops", &["stop"]).output().expect("the program runs");
    assert!(nobody.status.code() == Some(1) && said(&nobody).contains("nothing was stopped"), "{}", said(&nobody));
    let bridge = bridge("stops", &[]);
    let node = Node::open_in(&format!("stops{}", std::process::id()), "a test").expect("shared memory");
    let states = node.subscriber(ARM_STATE).expect("a place");
    wait_for(&states, |state| state.cycle > 10);
    let sender = program("stops", &["target", "joints", "1.5,-0.6,0,-2.2,0,1.6,0.785", "--speed", "0.3"])
        .spawn()
        .expect("it starts");
    wait_for(&states, |state| state.dq_d[0] > 0.2);
    let stopped = program("stops", &["stop", "--json"]).output().expect("the program runs");
    assert!(stopped.status.success(), "{}", said(&stopped));
    let answer: Value = serde_json::from_slice(&stopped.stdout).expect("JSON");
    let sender = sender.wait_with_output().expect("it ended");
    assert_eq!(sender.status.code(), Some(1), "{}", said(&sender));
    let rests = wait_for(&states, |state| state.dq_d[0] == 0.0);
    let later = wait_for(&states, |state| state.cycle > rests.cycle + 800);
    assert_eq!(answer["q_d"][0].as_f64(), Some(later.q_d[0]), "it stays where it was stopped");
    assert!(later.q_d[0] < 1.4, "before it came to its goal: {}", later.q_d[0]);
    assert!(end(bridge).status.success());
}
