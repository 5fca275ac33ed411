//! A motion goes from plan to bridge over real shared memory, against a bridge that obeys and bridges that do not.

mod fake_bridge;

use capture::link::{Link, LinkError};
use capture::plan::Plan;
use capture::recovery::Recovery;
use capture::stream::{Motion, Outcome, StreamError, play};
use fake_bridge::{FakeBridge, Fault};
use inference::interrupt::Interrupt;
use shared_mem::msg::arm::ArmMode;
use shared_mem::msg::joints_from;
use shared_mem::msg::motion::SetPoint;
use std::time::{Duration, Instant};

const START: [f64; 8] = [0.1, -0.7, 0.0, -2.3, 0.0, 1.5, 0.7, 0.0];

/// Joint 1 swings once, `length` set points long.
fn swing(length: usize) -> Plan {
    let omega = std::f64::consts::TAU / (length - 1) as f64;
    let set_points: Vec<SetPoint> = (0..length)
        .map(|i| {
            let (sin, cos) = (omega * i as f64).sin_cos();
            let mut q_d = START;
            q_d[0] += 0.1 * (1.0 - cos);
            SetPoint { q_d, dq_d: joints_from(&[0.1 * omega * sin * 1e3]) }
        })
        .collect();
    Plan { set_points, dof: 7, amplitude: vec![0.2; 7], bound_by: vec![None; 7], peak_speed: 0.1 * omega * 1e3 }
}

/// A cell of its own for each test.
fn domain(test: &str) -> String {
    format!("{test}-{}", std::process::id())
}

fn attempt(test: &str, mode: ArmMode, fault: Fault, length: usize) -> Result<Outcome, StreamError> {
    let domain = domain(test);
    let _bridge = FakeBridge::start(&domain, mode, START, fault);
    let mut link = Link::open(Some(&domain)).expect("shared memory");
    play(&mut link, swing(length).motion(), &Interrupt::default(), |_| {})
}

#[test]
fn every_set_point_arrives_once_and_in_order() {
    let domain = domain("order");
    let bridge = FakeBridge::start(&domain, ArmMode::Move, START, Fault::None);
    let mut link = Link::open(Some(&domain)).expect("shared memory");
    let plan = swing(1234);
    let mut states = 0;
    for _ in 0..2 {
        let outcome = play(&mut link, plan.motion(), &Interrupt::default(), |_| states += 1).expect("played");
        assert_eq!(outcome, Outcome::Done);
    }
    let played = bridge.finish();
    assert_eq!(played.len(), 2 * plan.set_points.len());
    assert!(played[..1234] == plan.set_points[..] && played[1234..] == plan.set_points[..]);
    assert!(states >= 2 * 1234, "{states} states were watched");
}

#[test]
fn a_refusal_is_told_with_the_bridges_reason() {
    let error = attempt("refuse", ArmMode::Move, Fault::Refuse, 600).unwrap_err();
    assert!(matches!(&error, StreamError::Refused { reason } if reason.contains("joint 2")), "{error}");
}

#[test]
fn a_brake_is_told_with_the_bridges_reason() {
    let error = attempt("brake", ArmMode::Move, Fault::BrakeAfter(200), 600).unwrap_err();
    assert!(matches!(&error, StreamError::Braked { played: 200, reason } if reason.contains("joint 4")), "{error}");
}

#[test]
fn a_bridge_that_dies_is_noticed_and_the_remedy_named() {
    let start = Instant::now();
    let error = attempt("die", ArmMode::Move, Fault::DieAfter(100), 600).unwrap_err();
    assert!(matches!(error, StreamError::Link(LinkError::Silent { .. })), "{error}");
    assert!(error.to_string().contains("rt_bridge run"), "{error}");
    assert!(start.elapsed() < Duration::from_secs(5));
}

#[test]
fn a_bridge_that_restarts_is_noticed() {
    let error = attempt("restart", ArmMode::Move, Fault::RestartAfter(100), 600).unwrap_err();
    assert!(matches!(error, StreamError::Link(LinkError::Restarted)), "{error}");
}

#[test]
fn a_bridge_that_takes_no_motion_up_is_not_waited_for_forever() {
    let error = attempt("deaf", ArmMode::Move, Fault::Deaf, 600).unwrap_err();
    assert!(matches!(error, StreamError::NotTaken), "{error}");
}

#[test]
fn a_robot_in_reflex_is_not_moved_and_the_remedy_is_named() {
    let error = attempt("reflex", ArmMode::Reflex, Fault::None, 600).unwrap_err();
    assert!(matches!(error, StreamError::Link(LinkError::NotReady { .. })), "{error}");
    assert!(error.to_string().contains("recover"), "{error}");
}

#[test]
fn a_robot_that_stops_itself_is_recovered_a_few_times_and_no_more() {
    let (_bridge, mut link) = robot_that_stops_itself("recovery");
    let (mut recovery, interrupt) = (Recovery::new(3), Interrupt::default());
    assert!(!recovery.settle(&mut link, &interrupt).expect("nothing to settle"));
    for _ in 0..3 {
        stops_itself(&mut link, &mut recovery);
        assert!(recovery.settle(&mut link, &interrupt).expect("recovered"));
    }
    stops_itself(&mut link, &mut recovery);
    let error = recovery.settle(&mut link, &interrupt).expect_err("too often").to_string();
    assert!(error.contains("3 times"), "{error}");
    assert!(error.contains("cartesian_reflex") && error.contains("session is continued"), "{error}");
}

#[test]
fn no_robot_is_recovered_unless_that_was_allowed_beforehand() {
    let (_bridge, mut link) = robot_that_stops_itself("forbidden");
    let mut recovery = Recovery::new(0);
    stops_itself(&mut link, &mut recovery);
    let error = recovery.settle(&mut link, &Interrupt::default()).expect_err("nobody allowed it").to_string();
    assert!(error.contains("--recover") && !error.contains('\n'), "{error}");
    assert!(matches!(link.ready_state(), Err(LinkError::NotReady { .. })), "still in its reflex");
}

#[test]
fn a_robot_that_a_person_stopped_or_whose_run_was_ended_is_not_recovered() {
    let (_bridge, mut link) = robot_that_stops_itself("stopped");
    let (mut recovery, interrupt) = (Recovery::new(3), Interrupt::default());
    stops_itself(&mut link, &mut recovery);
    interrupt.ask();
    assert!(!recovery.settle(&mut link, &interrupt).expect("ended"));
    assert!(matches!(link.ready_state(), Err(LinkError::NotReady { .. })), "still in its reflex");

    let domain = domain("button");
    let _bridge = FakeBridge::start(&domain, ArmMode::UserStopped, START, Fault::None);
    let mut link = Link::open(Some(&domain)).expect("shared memory");
    assert!(link.wait_for_bridge(Duration::from_secs(5), || false).expect("shared memory").is_some());
    let error = link.recover().expect_err("a person's stop is a person's to lift").to_string();
    assert!(error.contains("stop button"), "{error}");
}

fn robot_that_stops_itself(name: &str) -> (FakeBridge, Link) {
    let domain = domain(name);
    let bridge = FakeBridge::start(&domain, ArmMode::Move, START, Fault::ReflexAfter(300));
    (bridge, Link::open(Some(&domain)).expect("shared memory"))
}

fn stops_itself(link: &mut Link, recovery: &mut Recovery) {
    let from = link.ready_state().expect("a robot that is well").q_d;
    let set_points = vec![SetPoint { q_d: from, dq_d: [0.0; 8] }; 600];
    let motion = Motion { set_points: &set_points, dof: 7 };
    let outcome = play(link, motion, &Interrupt::default(), |_| {}).expect("a reflex is no error");
    assert_eq!(outcome, Outcome::Reflex);
    recovery.note(outcome, link).expect("shared memory");
    assert_eq!(recovery.reason().as_deref(), Some("the robot stopped itself (cartesian_reflex)"));
}

/// Plays a long motion and interrupts it at its five hundredth state.
fn interrupted(link: &mut Link, interrupt: &Interrupt, ask: fn(&Interrupt)) -> Result<Outcome, StreamError> {
    let mut states = 0;
    play(link, swing(5000).motion(), interrupt, |_| {
        states += 1;
        if states == 500 {
            ask(interrupt);
        }
    })
}

#[test]
fn ctrl_c_brakes_the_arm_and_waits_for_rest() {
    let domain = domain("ctrl-c");
    let bridge = FakeBridge::start(&domain, ArmMode::Move, START, Fault::None);
    let mut link = Link::open(Some(&domain)).expect("shared memory");
    let outcome = interrupted(&mut link, &Interrupt::default(), Interrupt::ask);
    assert!(matches!(outcome, Ok(Outcome::Stopped)));
    assert!(bridge.finish().len() < 2000, "the motion was cut short");
}

#[test]
fn a_pause_brakes_the_arm_and_another_motion_goes_on_from_there() {
    let domain = domain("pause");
    let bridge = FakeBridge::start(&domain, ArmMode::Move, START, Fault::None);
    let mut link = Link::open(Some(&domain)).expect("shared memory");
    let interrupt = Interrupt::default();
    let outcome = interrupted(&mut link, &interrupt, Interrupt::toggle_pause);
    assert!(matches!(outcome, Ok(Outcome::Paused)));
    let again = play(&mut link, swing(100).motion(), &interrupt, |_| {});
    assert!(matches!(again, Ok(Outcome::Paused)), "nothing is begun while paused");
    interrupt.toggle_pause();
    let again = play(&mut link, swing(100).motion(), &interrupt, |_| {});
    assert!(matches!(again, Ok(Outcome::Done)));
    assert!(bridge.finish().len() < 2100, "the first motion was cut short");
}

#[test]
fn without_a_bridge_nobody_waits_long() {
    let mut link = Link::open(Some(&domain("nobody"))).expect("shared memory");
    assert!(link.wait_for_bridge(Duration::from_millis(50), || false).expect("shared memory").is_none());
}
