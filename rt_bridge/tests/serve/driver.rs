//! The bridge's own driver on the served robot: what it plays there moves the arm as it moves the simulated cell directly.

#![allow(non_snake_case)] // the field's own symbols

use crate::{Served, cell};
use rt_bridge::arm::{Arm, ArmFault, Read};
use rt_bridge::fr3;
use rt_bridge::rt::Realtime;
use rt_bridge::serve::Pace;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use twin::arm::{ArmModel, ControlLaw, JointState, Joints};
use twin::control::Drive;
use twin::sim::SimCell;

/// Cycles of a motion.
const CYCLES: usize = 800;

fn connected(served: &Served) -> Box<dyn Arm> {
    fr3::connect(&served.address.to_string(), Realtime::Ignore, &cell()).expect("the served robot accepts us")
}

/// From 0 to 1 and its rate, at rest with no acceleration at both ends.
fn smooth(k: usize) -> (f64, f64) {
    let t = k as f64 / CYCLES as f64;
    let rate = 30.0 * t * t * (1.0 - t) * (1.0 - t) / (CYCLES as f64 * 1e-3);
    (t * t * t * (10.0 + t * (6.0 * t - 15.0)), rate)
}

/// Where the joints should be at cycle `k`, and how fast.
fn wanted(from: &Joints, k: usize) -> JointState {
    let (share, rate) = smooth(k);
    let joint = |i: usize, x: f64| if i < 7 { x } else { 0.0 };
    JointState {
        q: std::array::from_fn(|i| from[i] + joint(i, 0.15 * share)),
        dq: std::array::from_fn(|i| joint(i, 0.15 * rate)),
    }
}

/// The law of the bridge on a state: torque without gravity.
fn law(state: &JointState, wanted: &JointState) -> Joints {
    let cell = cell();
    let model = ArmModel::from_cell(&cell).expect("an FR3");
    let law = ControlLaw::new(cell.controller.as_ref(), None, &model).expect("gains");
    let (tau, gravity) = (law.torque(&model, state, &wanted.q, &wanted.dq), model.gravity(&state.q));
    std::array::from_fn(|i| tau[i] - gravity[i])
}

/// What the served robot's arm does under a motion, from the state that the first command answers on.
fn served(interface: CommandInterface) -> Vec<Joints> {
    let served = Served::start(Pace::Fast);
    let mut arm = connected(&served);
    arm.start(interface).expect("it is idle");
    let (mut state, mut seen) = (ArmState::default(), Vec::new());
    let mut from = None;
    for k in 0..CYCLES {
        assert_eq!(arm.read(&mut state), Ok(Read::Fresh));
        let wanted = wanted(from.get_or_insert(state.q_d), k);
        seen.push(state.q);
        let tau_J_d = law(&JointState { q: state.q, dq: state.dq }, &wanted);
        let command = ArmCommand { interface, q_d: wanted.q, dq_d: wanted.dq, tau_J_d, ..ArmCommand::default() };
        arm.command(&command).expect("the motion runs");
    }
    arm.stop();
    arm.read(&mut state).expect("states go on");
    assert_eq!(state.mode, ArmMode::Idle);
    let report = {
        drop(arm);
        served.finish()
    };
    assert_eq!((report.robot.reflexes, report.robot.lost_commands), (0, 0), "{report:?}");
    seen
}

fn worst(served: &[Joints], direct: &[Joints]) -> f64 {
    let apart = |(a, b): (&Joints, &Joints)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    served.iter().zip(direct).map(apart).fold(0.0, f64::max)
}

#[test]
fn torques_move_the_served_arm_as_they_move_the_simulated_cell() {
    let mut direct = SimCell::new(&cell(), None).expect("a cell");
    let (from, mut seen) = (direct.q(), Vec::new());
    for k in 0..CYCLES {
        seen.push(direct.q());
        let state = JointState { q: direct.q(), dq: direct.dq() };
        direct.step(&Drive::Torque { tau_J_d: law(&state, &wanted(&from, k)) });
    }
    let worst = worst(&served(CommandInterface::Torque), &seen);
    // The served arm is measured with encoder noise and sent in single precision; it goes 0.15 rad.
    assert!(worst < 5e-5, "{worst} rad");
}

#[test]
fn positions_move_the_served_arm_as_they_move_the_simulated_cell() {
    let mut direct = SimCell::new(&cell(), None).expect("a cell");
    let (from, mut seen) = (direct.q(), Vec::new());
    for k in 0..CYCLES {
        seen.push(direct.q());
        let JointState { q: q_d, dq: dq_d } = wanted(&from, k);
        direct.step(&Drive::JointImpedance { q_d, dq_d });
    }
    let worst = worst(&served(CommandInterface::JointPosition), &seen);
    assert!(worst < 5e-5, "{worst} rad");
}

#[test]
fn a_torque_that_jumps_is_a_reflex_with_its_name_and_the_arm_can_be_recovered() {
    let served = Served::start(Pace::Fast);
    let mut arm = connected(&served);
    arm.start(CommandInterface::Torque).expect("it is idle");
    let mut state = ArmState::default();
    let fault = (0..100).find_map(|k| {
        let read = arm.read(&mut state);
        let mut command = ArmCommand::default();
        command.tau_J_d[0] = if k < 10 { 0.0 } else { 3.0 };
        let _refused = arm.command(&command);
        read.err()
    });
    let Some(ArmFault::Reflex { errors }) = fault else { panic!("{fault:?}") };
    assert_eq!(errors.to_string(), "controller_torque_discontinuity");
    assert_eq!(state.mode, ArmMode::Reflex);
    assert!(matches!(arm.start(CommandInterface::Torque), Err(ArmFault::Reflex { .. })));
    arm.recover().expect("nothing holds the arm");
    arm.start(CommandInterface::Torque).expect("it is recovered");
    assert_eq!(arm.read(&mut state), Ok(Read::Fresh));
    assert_eq!(state.mode, ArmMode::Move);
}
