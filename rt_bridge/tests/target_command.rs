//! `rt_bridge target` against a running bridge: joints and poses are reached, a sender that is killed has the arm braked, and a
//! second one is refused in one line. Each test has its own domain of shared memory.
#![allow(missing_docs)]

use rt_bridge::rt::process::ask_to_end;
use serde_json::Value;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::target::ArmTarget;
use shared_mem::recording::{ClipMessages, Payload};
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_STATE, ARM_TARGET};
use shared_mem::transport::{Node, Subscriber};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const CELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/fr3_cell.toml");
/// Longest wait for something that takes a second; only a fault uses it up.
const LONG: Duration = Duration::from_secs(30);

fn program(domain: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rt_bridge"));
    command
        .env("TWINALIGN_DOMAIN", format!("{domain}{}", std::process::id()))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn bridge(domain: &str, further: &[&str]) -> Child {
    let mut command = program(domain, &["run", "--cell", CELL, "--arm", "sim", "--camera", "off", "--gripper", "sim"]);
    // It ends with this test, however that ends.
    command.args(["--realtime", "ignore", "--json", "--parent", &std::process::id().to_string()]).args(further);
    command.spawn().expect("the program starts")
}

fn target(domain: &str, arguments: &[&str]) -> Output {
    let all: Vec<&str> = ["target"].iter().chain(arguments).copied().collect();
    program(domain, &all).output().expect("the program runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn wait_for(states: &Subscriber<ArmState>, wanted: impl Fn(&ArmState) -> bool) -> ArmState {
    let begin = Instant::now();
    while begin.elapsed() < LONG {
        match states.newest().expect("shared memory") {
            Some(state) if wanted(&state) => return state,
            _ => std::thread::sleep(Duration::from_millis(2)),
        }
    }
    panic!("not within half a minute");
}

/// The same, sent now.
fn fresh(target: &ArmTarget) -> ArmTarget {
    ArmTarget { stamp_ns: now_ns(), ..*target }
}

fn end(bridge: Child) -> Output {
    ask_to_end(bridge.id()).expect("it still runs");
    bridge.wait_with_output().expect("it ends")
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
    let away = target("targets", &["pose", "1.4,0,0.4,0,1,0,0", "--cell", CELL]);
    assert!(!away.status.success() && said(&away).contains("out of reach"), "{}", said(&away));
    let wrong = target("targets", &["joints", "0,-0.6,0,1.2,0,1.6,0.785"]);
    assert!(!wrong.status.success() && said(&wrong).contains("joint 4"), "{}", said(&wrong));
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
