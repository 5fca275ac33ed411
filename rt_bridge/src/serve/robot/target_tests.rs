//! Targets that the robot plans to, where nobody commands each millisecond.

use super::tests::{assert_reflex, idle, motion, numbers, recover, replies, robot};
use super::*;
use crate::serve::wire::Request;

#[test]
fn sparse_targets_are_planned_to_whatever_comes_late_and_braked_where_the_client_ends_them() {
    let mut robot = robot();
    let request =
        MotionRequest { targets: Some([0.5; 7]), ..motion(GeneratorKind::JointPosition, Controller::JointImpedance) };
    robot.request(MOVE, 7, &Request::Move(request));
    robot.tick(None);
    assert_eq!(replies(&mut robot, MOVE), [1], "motion started");
    idle(&mut robot, 50);
    let begin = robot.now();
    let q = robot.hold.trace().q;
    let target = |shift: f64, answers| {
        let q_c = std::array::from_fn(|i| q[i] + if i == 0 { shift } else { 0.0 });
        SetPoint { answers, q_c, ..SetPoint::default() }
    };
    // Answers to old states count as well, and nobody misses the others.
    robot.tick(Some(&target(0.3, begin - 20)));
    idle(&mut robot, 1500);
    assert_eq!(robot.state().robot_mode, RobotMode::Move.to_u8());
    assert!((numbers(robot.state().q_d)[0] - q[0] - 0.3).abs() < 1e-6, "{:?}", numbers(robot.state().q_d));
    assert!(numbers(robot.state().dq)[0].abs() < 0.01);
    robot.tick(Some(&target(-0.3, robot.now() - 5)));
    idle(&mut robot, 300);
    let fast = numbers(robot.state().dq_d)[0];
    assert!((fast + 0.5).abs() < 0.01, "{fast}");
    robot.tick(Some(&SetPoint { motion_finished: true, ..target(-0.3, robot.now() - 5) }));
    assert_eq!(replies(&mut robot, MOVE), [0], "done");
    assert_eq!(robot.state().robot_mode, RobotMode::Idle.to_u8());
    idle(&mut robot, 500);
    assert!(robot.hold.rests() && robot.tally().reflexes == 0 && robot.tally().lost_commands == 0);
    robot.request(MOVE, 7, &Request::Move(request));
    idle(&mut robot, 3);
    robot.tick(Some(&target(9.0, robot.now())));
    assert_reflex(&mut robot, Fault::PlanningJointLimits);
}

#[test]
fn an_arm_that_folds_onto_itself_is_stopped_and_can_be_unfolded() {
    let mut robot = robot();
    let folds =
        MotionRequest { targets: Some([1.0; 7]), ..motion(GeneratorKind::JointPosition, Controller::JointImpedance) };
    let go = |robot: &mut Robot, q_c: [f64; 7]| {
        robot.request(MOVE, 7, &Request::Move(folds));
        idle(robot, 3);
        robot.tick(Some(&SetPoint { answers: robot.now(), q_c, ..SetPoint::default() }));
        idle(robot, 4000);
    };
    go(&mut robot, [0.0, -0.3, 0.0, -3.0, 0.0, 0.5, 0.0]);
    assert_reflex(&mut robot, Fault::SelfCollision);
    recover(&mut robot);
    go(&mut robot, [0.0, -0.8, 0.0, -2.3, 0.0, 1.6, 0.8]);
    assert!(robot.running().is_some(), "{:?}", robot.errors);
    assert!((numbers(robot.state().q)[3] + 2.3).abs() < 0.02);
}
