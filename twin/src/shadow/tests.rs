//! Behaviour of the shadow against a simulated robot, without processes.

use super::*;
use crate::sensors::tracker::SimTracker;
use crate::shipped::shipped_exact;
use crate::sim::SimCell;
use nalgebra::{Isometry3, Vector3};
use shared_mem::frames::Pose;
use shared_mem::theta::ArmTheta;

/// A simulated robot with its bridge: all joints swing, each at its own frequency.
struct Robot {
    cell: SimCell,
    tracker: SimTracker,
    start: Joints,
    session: u64,
    cycle: u64,
}

impl Robot {
    fn new(cell: &Cell, theta: Option<&Theta>) -> Self {
        let sim = SimCell::new(cell, theta).expect("a cell");
        Self { start: sim.q(), cell: sim, tracker: SimTracker::new(cell), session: 1, cycle: 0 }
    }

    /// The state of now, with the command of the coming period, and what the tracker says; then the period passes.
    fn cycle(&mut self) -> (ArmState, Option<ObjectPose>) {
        let t = self.cell.time_ns() as f64 * 1e-9;
        let rate = |i: usize| 2.0 + i as f64;
        let swing = |i: usize| if i < 7 { 0.1 } else { 0.0 };
        let q_d = std::array::from_fn(|i| self.start[i] + swing(i) * (1.0 - (rate(i) * t).cos()));
        let dq_d = std::array::from_fn(|i| swing(i) * rate(i) * (rate(i) * t).sin());
        let mut state = ArmState { session: self.session, cycle: self.cycle, ..ArmState::default() };
        self.cell.read(&mut state);
        state.stamp_ns = 1_000_000_000 + self.cell.time_ns();
        (state.q_d, state.dq_d) = (q_d, dq_d);
        let pose = self.tracker.observe(&self.cell.snapshot());
        let pose = pose.map(|pose| ObjectPose { stamp_ns: state.stamp_ns, ..pose });
        self.cell.step(&Drive::JointImpedance { q_d, dq_d });
        self.cycle += 1;
        (state, pose)
    }
}

impl Robot {
    /// Lets cycles pass that nobody sees.
    fn skip(&mut self, cycles: u64) {
        for _ in 0..cycles {
            self.cycle();
        }
    }
}

fn mirror_cycles(shadow: &mut Shadow, robot: &mut Robot, cycles: u64) {
    for _ in 0..cycles {
        mirror(shadow, &robot.cycle().0);
    }
}

fn mirror(shadow: &mut Shadow, state: &ArmState) -> Mirrored {
    shadow.on_state(state, 20_000).expect("the same arm").expect("a new state")
}

fn worst(joints: &Joints) -> f64 {
    joints.iter().fold(0.0, |worst: f64, v| worst.max(v.abs()))
}

#[test]
fn a_twin_with_the_same_parameters_has_no_gap() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    for k in 0..2000 {
        let mirrored = mirror(&mut shadow, &robot.cycle().0);
        assert_eq!(mirrored.event, (k == 0).then_some(Event::Attached));
        assert!(worst(&mirrored.gap.joint_error) < 1e-9, "cycle {k}: {:?}", mirrored.gap.joint_error);
    }
    assert_eq!(shadow.summary().cycles, 2000);
}

#[test]
fn attaching_in_the_middle_of_a_motion_gives_no_gap_either() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    robot.skip(700);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    for _ in 0..1000 {
        let mirrored = mirror(&mut shadow, &robot.cycle().0);
        assert!(worst(&mirrored.gap.joint_error) < 1e-5, "{:?}", mirrored.gap.joint_error);
    }
}

#[test]
fn hidden_gains_open_a_gap_and_the_right_parameters_close_it() {
    let cell = shipped_exact();
    let gains = cell.controller.clone().expect("gains");
    let hidden = Theta {
        arm: Some(ArmTheta { stiffness: gains.stiffness.iter().map(|k| 0.8 * k).collect(), damping: gains.damping }),
        ..Theta::default()
    };
    let gap = |theta: Option<&Theta>| {
        let mut robot = Robot::new(&cell, Some(&hidden));
        let mut shadow = Shadow::new(&cell, theta).expect("a shadow");
        mirror_cycles(&mut shadow, &mut robot, 1500);
        shadow.summary().joint_rms.expect("states").into_iter().fold(0.0, f64::max)
    };
    assert!(gap(None) > 1e-4, "{}", gap(None));
    assert!(gap(Some(&hidden)) < 1e-9);
}

#[test]
fn a_restarted_bridge_and_a_long_hole_align_the_twin_and_a_short_hole_does_not() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    let lose = |robot: &mut Robot, shadow: &mut Shadow, cycles: u64| {
        robot.skip(cycles);
        let mirrored = mirror(shadow, &robot.cycle().0);
        (mirrored.event, worst(&mirrored.gap.joint_error))
    };
    assert_eq!(lose(&mut robot, &mut shadow, 0), (Some(Event::Attached), 0.0));
    let (event, error) = lose(&mut robot, &mut shadow, 5);
    assert!(event.is_none() && error < 1e-5, "5 lost cycles are simulated: {error}");
    let (event, error) = lose(&mut robot, &mut shadow, 20);
    assert!(event.is_none() && error < 1e-4, "20 lost cycles too: {error}");
    assert_eq!(lose(&mut robot, &mut shadow, 21), (Some(Event::Hole(21)), 0.0));
    robot = Robot { session: 2, ..Robot::new(&cell, None) };
    assert_eq!(lose(&mut robot, &mut shadow, 0), (Some(Event::BridgeRestarted), 0.0));
    assert_eq!(shadow.summary().alignments, 3);
}

#[test]
fn a_twin_that_fell_behind_skips_ahead_and_says_how_much_it_dropped() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    mirror(&mut shadow, &robot.cycle().0);
    robot.skip(3);
    shadow.fell_behind(3);
    assert_eq!(mirror(&mut shadow, &robot.cycle().0).event, Some(Event::FellBehind));
    assert_eq!(shadow.summary().dropped, 3);
}

#[test]
fn repeated_and_broken_states_are_no_cycles() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    let (state, _) = robot.cycle();
    mirror(&mut shadow, &state);
    assert_eq!(shadow.on_state(&state, 0), Ok(None));
    let mut broken = robot.cycle().0;
    broken.q[3] = f64::NAN;
    assert_eq!(shadow.on_state(&broken, 0), Ok(None));
    assert_eq!((shadow.summary().cycles, shadow.summary().dropped), (1, 1));
    let other = ArmState { dof: 6, ..robot.cycle().0 };
    assert_eq!(shadow.on_state(&other, 0), Err(MirrorError::OtherArm { reported: 6, expected: 7 }));
}

#[test]
fn the_object_is_found_and_found_again_when_it_rests_elsewhere() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    let mut events = Vec::new();
    let mut run = |robot: &mut Robot, shadow: &mut Shadow, cycles: usize| {
        let mut last = None;
        for _ in 0..cycles {
            let (state, pose) = robot.cycle();
            last = Some(mirror(shadow, &state));
            events.extend(pose.and_then(|pose| shadow.on_object(&pose)));
        }
        (events.clone(), last.expect("cycles"))
    };
    let (events_so_far, mirrored) = run(&mut robot, &mut shadow, 1000);
    assert_eq!(events_so_far, [ObjectEvent::Found]);
    assert!(mirrored.gap.object_add_m < 0.004, "only the tracker's noise: {}", mirrored.gap.object_add_m);
    // Somebody moves the real object by hand.
    let elsewhere = Pose::from_isometry(Isometry3::translation(0.6, 0.15, 0.05));
    robot.cell.set_object(&elsewhere, Vector3::zeros(), Vector3::zeros());
    let (events, mirrored) = run(&mut robot, &mut shadow, 1500);
    assert_eq!(events, [ObjectEvent::Found, ObjectEvent::Rests]);
    assert!(mirrored.gap.object_add_m < 0.004, "{}", mirrored.gap.object_add_m);
    let twin = Vector3::from(mirrored.state.object_position);
    assert!((twin - Vector3::new(0.6, 0.15, 0.05)).norm() < 0.001, "averaged, not one noisy pose: {twin}");
}

#[test]
fn the_json_has_the_keys_that_others_read() {
    let cell = shipped_exact();
    let mut robot = Robot::new(&cell, None);
    let mut shadow = Shadow::new(&cell, None).expect("a shadow");
    // What was not measured is no zero.
    let nothing = shadow.summary();
    let json = nothing.json(0.01);
    assert!(json["real_time_factor"].is_null() && json["gap"]["joint_rms_rad"].is_null(), "{json}");
    assert!(["p50", "p99", "p999", "max"].iter().all(|key| json["age_us"][key].is_null()), "{json}");
    assert_eq!(nothing.text(0.01), None);
    mirror_cycles(&mut shadow, &mut robot, 100);
    let json = shadow.summary().json(0.01);
    assert_eq!(json["cycles"], 100);
    assert!((json["real_time_factor"].as_f64().expect("a number") - 10.0).abs() < 1e-9);
    assert_eq!(json["gap"]["joint_rms_rad"].as_array().map(Vec::len), Some(7));
    assert!(json["gap"]["object_add_m"].is_null() && json["gap"]["object_add_s_m"].is_null());
    for key in ["p50", "p99", "p999", "max"] {
        assert!((json["age_us"][key].as_f64().expect("a number") - 20.0).abs() < 0.1, "{key}");
    }
}
