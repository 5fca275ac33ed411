//! An arm that nobody commands: what is set never lets it run away, brakes stop it, and it can always be recovered.

use super::tests::{idle, numbers, recover, replies, robot};
use super::*;
use crate::serve::wire::{Load, Request};

const SET_IMPEDANCE: u32 = 4;
const SET_LOAD: u32 = 9;
const INVALID: u8 = 2;

fn load(mass: f64, at: f64) -> Request {
    Request::SetLoad(Load { mass, centre: [at, 0.0, 0.0], inertia: [0.0; 9] })
}

/// The highest speed of any joint within so many milliseconds [rad/s].
fn fastest(robot: &mut Robot, cycles: usize) -> f64 {
    let mut fastest: f64 = 0.0;
    for _ in 0..cycles {
        robot.tick(None);
        fastest = robot.body.measured.dq.iter().fold(fastest, |fastest, dq| fastest.max(dq.abs()));
    }
    fastest
}

/// Recovers the robot, however long that takes; how long it took [ms].
fn recovered(robot: &mut Robot) -> usize {
    robot.request(RECOVER, 9, &Request::AutomaticErrorRecovery);
    for k in 0..70_000 {
        robot.tick(None);
        if let [status] = replies(robot, RECOVER)[..] {
            assert_eq!((status, robot.state().robot_mode), (0, RobotMode::Idle.to_u8()), "{:?}", robot.errors);
            return k;
        }
    }
    panic!("no recovery");
}

fn assert_idle(robot: &mut Robot) {
    assert_eq!(robot.state().robot_mode, RobotMode::Idle.to_u8(), "{:?}", robot.errors);
    assert!(robot.state().errors == [0; 41] && fastest(robot, 300) < 0.02);
    assert_eq!(robot.state().robot_mode, RobotMode::Idle.to_u8(), "{:?}", robot.errors);
}

#[test]
fn a_load_of_twenty_kilograms_at_nine_hundred_metres_is_refused_and_the_arm_stays() {
    let mut robot = robot();
    robot.request(SET_LOAD, 1, &load(20.0, 900.0));
    assert_eq!(replies(&mut robot, SET_LOAD), [INVALID]);
    assert!(fastest(&mut robot, 2000) < 1e-2);
    assert_idle(&mut robot);
}

#[test]
fn whatever_a_client_may_set_the_arm_never_runs_away_and_recovery_brings_it_back() {
    // Loads that are not there, at the limit of what may be declared, on joints as soft as may be asked for.
    let (mut stopped, limits) = (0, Limits::fr3());
    let highest = limits.counted().map(|joint| joint.velocity).fold(0.0, f64::max);
    for stiffness in [0.0, 10.0, 14_250.0] {
        for request in [load(3.0, 0.4), load(3.0, -0.4), load(0.5, 0.0), load(0.0, 0.0)] {
            let mut robot = robot();
            robot.request(SET_IMPEDANCE, 1, &Request::SetJointImpedance([stiffness; 7]));
            robot.request(SET_LOAD, 2, &request);
            assert_eq!(replies(&mut robot, SET_LOAD), [0], "{request:?}");
            let fastest = fastest(&mut robot, 4000);
            assert!(fastest < 1.1 * highest, "{fastest} rad/s under {stiffness} N m/rad and {request:?}");
            if robot.braked {
                stopped += 1;
                assert_eq!(robot.state().robot_mode, RobotMode::Reflex.to_u8());
                assert!(robot.body.stands());
                recovered(&mut robot);
                assert_eq!((robot.state().m_load.get(), robot.settings.joint_stiffness), (0.0, None));
                assert_idle(&mut robot);
            }
        }
    }
    assert!((1..12).contains(&stopped), "{stopped} of twelve had to be stopped");
}

#[test]
fn brakes_stop_any_speed_and_recovery_leads_the_arm_back_into_its_range() {
    for (joint, dq) in [(0, 37.0), (5, -12.0), (3, 3.0)] {
        let mut robot = robot();
        robot.body.push_at(joint, dq);
        robot.tick(None);
        assert_eq!(robot.state().robot_mode, RobotMode::Reflex.to_u8(), "{dq} rad/s");
        assert_ne!(robot.errors.bits() & Fault::JointVelocity.alone().bits(), 0, "{}", robot.errors);
        idle(&mut robot, 500);
        assert!(robot.body.stands(), "{:?}", robot.body.measured.dq);
        let where_it_stands = numbers(robot.state().q);
        idle(&mut robot, 500);
        let now = numbers(robot.state().q);
        let moved = now.iter().zip(where_it_stands).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-4, "a braked arm stays");
        recovered(&mut robot);
        let limits = robot.rules.limits.counted();
        assert!(limits.zip(numbers(robot.state().q)).all(|(l, q)| (l.q_min..=l.q_max).contains(&q)));
        // Its controller follows the way back with some delay.
        idle(&mut robot, 1000);
        assert_idle(&mut robot);
    }
}

#[test]
fn a_robot_that_is_braked_while_it_recovers_says_so_and_can_be_recovered_again() {
    let mut robot = robot();
    robot.body.push_at(0, 10.0);
    idle(&mut robot, 300);
    robot.request(RECOVER, 9, &Request::AutomaticErrorRecovery);
    idle(&mut robot, 20);
    robot.body.push_at(0, 10.0);
    robot.tick(None);
    assert_eq!(replies(&mut robot, RECOVER), [4], "reflex");
    assert_eq!(robot.state().robot_mode, RobotMode::Reflex.to_u8());
    recovered(&mut robot);
    assert_idle(&mut robot);
}

#[test]
fn what_a_client_has_set_or_asked_for_ends_with_it() {
    let mut robot = robot();
    let mut frame = [0.0; 16];
    [0, 5, 10, 15].into_iter().for_each(|i| frame[i] = 1.0);
    frame[14] = 0.2;
    robot.request(SET_LOAD, 1, &load(1.0, 0.1));
    robot.request(SET_IMPEDANCE, 2, &Request::SetJointImpedance([300.0; 7]));
    robot.request(8, 3, &Request::SetNEToEE(frame));
    idle(&mut robot, 2000);
    let shown = *robot.state();
    assert_eq!((shown.m_load.get(), f64::from(shown.NE_T_EE[14].get())), (1.0, f64::from(0.2_f32)));
    assert!((numbers(shown.q)[1] - numbers(shown.q_d)[1]).abs() > 5e-3, "the load that is not there lifts a soft arm");
    robot.client_left();
    idle(&mut robot, 2000);
    let shown = *robot.state();
    assert_eq!((shown.m_load.get(), shown.NE_T_EE[14].get()), (0.0, 0.0));
    assert!((numbers(shown.q)[1] - numbers(shown.q_d)[1]).abs() < 1e-4, "as stiff as at first, with nothing to lift");
    // Nor does the next client see a recovery that it did not ask for.
    robot.body.push_at(0, 10.0);
    idle(&mut robot, 300);
    robot.request(RECOVER, 9, &Request::AutomaticErrorRecovery);
    robot.client_left();
    for _ in 0..2000 {
        robot.tick(None);
        assert!(replies(&mut robot, RECOVER).is_empty());
    }
    assert_idle(&mut robot);
    recover(&mut robot);
}
