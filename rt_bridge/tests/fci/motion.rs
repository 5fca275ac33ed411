//! The life of a motion: what goes over the wire, and what comes of it when the robot or the line gives up.

use crate::robot::{IDLE, Robot, at};
use rt_bridge::arm::{Arm, ArmFault, Desired, Read};
use rt_bridge::fr3;
use rt_bridge::rt::Realtime;
use shared_mem::cell::{Cell, Controller, Tool};
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::joints_from;
use std::time::{Duration, Instant};

const SEVEN: [f64; 7] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// A cell with gains and a tool.
fn cell() -> Cell {
    Cell {
        controller: Some(Controller { stiffness: SEVEN.map(|k| 100.0 * k).to_vec(), ..Controller::default() }),
        tool: Some(Tool { mass: 0.25, length: 0.16, radius: 0.012 }),
        ..Cell::default()
    }
}

pub(crate) fn connected(robot: &Robot) -> Box<dyn Arm> {
    fr3::connect(&robot.host, Realtime::Ignore, &cell()).expect("the scripted robot accepts us")
}

pub(crate) fn command(interface: CommandInterface) -> ArmCommand {
    ArmCommand { interface, q_d: joints_from(&SEVEN), tau_J_d: joints_from(&SEVEN), ..ArmCommand::default() }
}

/// Reads and answers `cycles` states.
fn cycles(arm: &mut dyn Arm, interface: CommandInterface, cycles: usize) -> ArmState {
    let mut state = ArmState::default();
    for _ in 0..cycles {
        assert_eq!(arm.read(&mut state), Ok(Read::Fresh));
        assert_eq!(arm.command(&command(interface)), Ok(()));
    }
    state
}

/// Reads until a fault ends it.
fn fault(arm: &mut dyn Arm) -> (ArmFault, ArmState) {
    let mut state = ArmState::default();
    loop {
        match arm.read(&mut state) {
            Ok(_) => {
                let _ = arm.command(&command(CommandInterface::Torque));
            }
            Err(fault) => return (fault, state),
        }
    }
}

fn numbers(bytes: &[u8], offset: usize, count: usize) -> Vec<f64> {
    bytes[offset..offset + 8 * count]
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes")))
        .collect()
}

#[test]
fn every_field_of_a_state_arrives_where_it_belongs() {
    let robot = Robot::new();
    let fields = [at::Q, at::DQ, at::Q_D, at::DQ_D, at::TAU_J, at::TAU_J_D, at::TAU_EXT];
    for (k, offset) in fields.into_iter().enumerate() {
        robot.script().write(offset, &[0, 1, 2, 3, 4, 5, 6].map(|j| (10 * (k + 1) + j) as f32));
    }
    robot.script().write(at::O_T_EE, &std::array::from_fn::<f32, 16, _>(|i| i as f32));
    robot.script().write(at::SUCCESS_RATE, &[0.75]);
    let mut arm = connected(&robot);
    let mut idle = ArmState::default();
    assert_eq!(arm.read(&mut idle), Ok(Read::Fresh));
    assert_eq!(arm.start(CommandInterface::JointPosition), Ok(Desired::Commanded));
    let state = cycles(arm.as_mut(), CommandInterface::JointPosition, 3);
    let expected = |k: usize| joints_from(&[0, 1, 2, 3, 4, 5, 6].map(|j| (10 * (k + 1) + j) as f64));
    // What the robot exerts on its surroundings is the opposite of what they exert on the arm.
    let tau_ext = state.tau_ext.map(|tau| -tau);
    let taken = [state.q, state.dq, state.q_d, state.dq_d, state.tau_J, state.tau_J_d, tau_ext];
    for (k, joints) in taken.into_iter().enumerate() {
        assert_eq!(joints, expected(k), "field {k}");
    }
    assert_eq!(state.O_T_EE, std::array::from_fn(|i| i as f64));
    assert_eq!((state.success_rate, state.mode), (0.75, ArmMode::Move));
    assert_eq!((idle.q_d, idle.mode), (state.q_d, ArmMode::Idle));
    assert_eq!(state.device_ns % 1_000_000, 0);
    assert!(state.device_ns >= 1_000_000_000 && state.stamp_ns > 0);
}

#[test]
fn a_torque_answers_the_state_it_was_made_for_and_fills_no_other_block() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    assert_eq!(arm.start(CommandInterface::Torque), Ok(Desired::Commanded));
    let state = cycles(arm.as_mut(), CommandInterface::Torque, 5);
    std::thread::sleep(Duration::from_millis(20));
    let script = robot.script();
    let last = script.commands.last().expect("five set points were sent");
    assert_eq!(u64::from_le_bytes(last[..8].try_into().expect("eight bytes")) * 1_000_000, state.device_ns);
    assert_eq!(numbers(last, 314, 7), SEVEN);
    assert!(last[8..314].iter().all(|byte| *byte == 0), "the motion generator's block is empty");
}

#[test]
fn tool_gains_and_collision_thresholds_are_told_before_the_motion() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    arm.start(CommandInterface::JointPosition).expect("it is idle");
    let script = robot.script();
    let order: Vec<u32> = script.requests.iter().map(|(number, _)| *number).collect();
    assert_eq!(order, [0, 3, 4, 9, 1]);
    assert_eq!(numbers(&script.requests[2].1, 0, 7), SEVEN.map(|k| 100.0 * k));
    let load = numbers(&script.requests[3].1, 0, 13);
    assert_eq!(load[..4], [0.25, 0.0, 0.0, 0.074]);
    let collision = numbers(&script.requests[1].1, 0, 14);
    assert!(collision[7] > collision[0], "the robot stops beyond the contact threshold");
}

#[test]
fn a_tool_declared_in_the_robots_web_page_is_not_compensated_twice() {
    let robot = Robot::new();
    robot.script().write(at::M_EE, &[0.25]);
    let mut arm = connected(&robot);
    arm.start(CommandInterface::Torque).expect("it is idle");
    assert!(robot.script().requests.iter().all(|(number, _)| *number != 9));
}

#[test]
fn a_motion_ends_in_order_and_leaves_the_robot_idle() {
    for (interface, flag) in [(CommandInterface::Torque, 370), (CommandInterface::JointPosition, 313)] {
        let robot = Robot::new();
        let mut arm = connected(&robot);
        arm.start(interface).expect("it is idle");
        cycles(arm.as_mut(), interface, 5);
        let begin = Instant::now();
        arm.stop();
        assert!(begin.elapsed() < Duration::from_secs(1));
        let script = robot.script();
        assert_eq!(script.state[at::ROBOT_MODE], IDLE);
        assert!(script.commands.iter().any(|bytes| bytes[flag] == 1));
        assert!(script.requests.iter().all(|(number, _)| *number != 2), "no StopMove was needed");
    }
}

#[test]
fn a_reflex_is_told_once_with_its_reason_and_a_recovery_makes_the_next_motion_possible() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    arm.start(CommandInterface::Torque).expect("it is idle");
    cycles(arm.as_mut(), CommandInterface::Torque, 3);
    robot.script().reflex(32);
    let (fault, state) = fault(arm.as_mut());
    assert!(matches!(fault, ArmFault::Reflex { .. }) && !fault.is_final(), "{fault:?}");
    assert!(fault.to_string().contains("controller_torque_discontinuity"), "{fault}");
    assert_eq!(state.mode, ArmMode::Reflex);
    let mut later = ArmState::default();
    assert_eq!(arm.read(&mut later), Ok(Read::Fresh));
    assert!(later.device_ns > state.device_ns);
    assert!(matches!(arm.start(CommandInterface::Torque), Err(ArmFault::Reflex { .. })));
    assert_eq!(arm.recover(), Ok(()));
    assert_eq!(arm.start(CommandInterface::Torque), Ok(Desired::Commanded));
}

#[test]
fn a_robot_that_closes_the_connection_mid_motion_is_noticed_within_a_second() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    arm.start(CommandInterface::Torque).expect("it is idle");
    cycles(arm.as_mut(), CommandInterface::Torque, 3);
    robot.script().gone = true;
    let begin = Instant::now();
    assert_eq!(fault(arm.as_mut()).0, ArmFault::Disconnected);
    arm.stop();
    assert!(begin.elapsed() < Duration::from_secs(1), "{:?}", begin.elapsed());
}

#[test]
fn a_robot_that_falls_silent_mid_motion_is_given_up_after_a_second() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    arm.start(CommandInterface::Torque).expect("it is idle");
    cycles(arm.as_mut(), CommandInterface::Torque, 3);
    robot.script().silent = true;
    let begin = Instant::now();
    let (fault, _) = fault(arm.as_mut());
    assert!(matches!(fault, ArmFault::Silent { ms: 1000.. }) && fault.is_final(), "{fault:?}");
    assert!(begin.elapsed() < Duration::from_millis(1500), "{:?}", begin.elapsed());
}

#[test]
fn a_late_reader_gets_the_newest_state_and_skips_those_that_piled_up() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    arm.start(CommandInterface::Torque).expect("it is idle");
    let before = cycles(arm.as_mut(), CommandInterface::Torque, 1);
    std::thread::sleep(Duration::from_millis(100));
    let after = cycles(arm.as_mut(), CommandInterface::Torque, 1);
    assert!(after.device_ns >= before.device_ns + 5_000_000, "{} {}", before.device_ns, after.device_ns);
}
