//! The robot without its sockets: its client answers every state at once, or not at all.

use super::*;
use crate::serve::settings::matrix;
use crate::serve::wire::{Load, Request};
use shared_mem::cell::Robot as Described;
use shared_mem::theta::EffectTheta;
use twin::arm::ArmModel;
use twin::sim::SimCell;
use zerocopy::little_endian::F32;

const SET_LOAD: u32 = 9;
const SET_IMPEDANCE: u32 = 4;
const STOP: u32 = 2;

fn cell() -> Cell {
    Cell::parse(include_str!("../../../../config/fr3_cell.toml"), std::path::Path::new("cell.toml"))
        .expect("the shipped cell")
}

pub(super) fn robot() -> Robot {
    Robot::new(&cell(), None).expect("an FR3")
}

pub(super) fn motion(generator: GeneratorKind, controller: Controller) -> MotionRequest {
    let wide = [10.0, 3.12, std::f64::consts::TAU];
    MotionRequest { controller, generator, path_deviation: wide, goal_deviation: wide, targets: None }
}

/// Payloads of the replies to request `number` that went out since the last look.
pub(super) fn replies(robot: &mut Robot, number: u32) -> Vec<u8> {
    let Outbox { before_state, after_state } = robot.outbox();
    before_state.into_iter().chain(after_state).filter(|r| r.number == number).map(|r| r.payload[0]).collect()
}

/// Starts a motion and lets the client see it.
fn start(robot: &mut Robot, generator: GeneratorKind, controller: Controller) {
    robot.request(MOVE, 7, &Request::Move(motion(generator, controller)));
    robot.tick(None);
    assert_eq!(replies(robot, MOVE), [1], "motion started");
    assert_eq!(robot.state().robot_mode, RobotMode::Move.to_u8());
    robot.tick(None);
}

/// Answers states with what `command` says for the cycle, until the robot has had enough of it or `cycles` are over.
fn command(robot: &mut Robot, cycles: usize, mut command: impl FnMut(usize, &mut SetPoint)) {
    for k in 0..cycles {
        if robot.running().is_none() {
            return;
        }
        let mut set_point = SetPoint { answers: robot.now(), ..SetPoint::default() };
        command(k, &mut set_point);
        robot.tick(Some(&set_point));
    }
}

pub(super) fn idle(robot: &mut Robot, cycles: usize) {
    (0..cycles).for_each(|_| robot.tick(None));
}

pub(super) fn numbers<const N: usize>(wire: [F32; N]) -> [f64; N] {
    wire.map(|x| f64::from(x.get()))
}

/// From 0 to 1 within `t` = 0 to 1, at rest with no acceleration at both ends.
fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

pub(super) fn recover(robot: &mut Robot) {
    robot.request(RECOVER, 9, &Request::AutomaticErrorRecovery);
    for _ in 0..2000 {
        robot.tick(None);
        if let [status] = replies(robot, RECOVER)[..] {
            assert_eq!((status, robot.state().robot_mode), (0, RobotMode::Idle.to_u8()));
            assert_eq!(robot.state().errors, [0; 41]);
            return;
        }
    }
    panic!("no recovery within two seconds");
}

/// The robot has stopped itself for `fault`, and has said so in this order: state, then reply.
pub(super) fn assert_reflex(robot: &mut Robot, fault: Fault) {
    assert_eq!(robot.state().robot_mode, RobotMode::Reflex.to_u8(), "still running");
    let raised = ReflexErrors::from_flags(&robot.state().reflex_reason.map(|flag| flag != 0));
    assert!(raised.bits() & fault.alone().bits() != 0, "{raised} instead of {}", fault.alone());
    // Of an arm that rests nothing is wrong any more.
    assert!([robot.state().reflex_reason, [0; 41]].contains(&robot.state().errors));
    let outbox = robot.outbox();
    let last = outbox.after_state.last().expect("a last word on the motion");
    assert_eq!((last.number, last.id, &last.payload[..]), (MOVE, 7, &[8][..]));
}

#[test]
fn a_joint_motion_moves_the_arm_as_the_simulated_cell_does() {
    let (mut robot, mut direct) = (robot(), SimCell::new(&cell(), None).expect("a cell"));
    start(&mut robot, GeneratorKind::JointPosition, Controller::JointImpedance);
    (0..2).for_each(|_| direct.step(&direct.command()));
    let from = direct.q();
    let at = |k: usize| 0.2 * smooth((k + 1) as f64 / 1000.0);
    let mut worst: f64 = 0.0;
    for k in 0..1000 {
        command(&mut robot, 1, |_, s| s.q_c = std::array::from_fn(|i| from[i] + at(k)));
        let rate = (at(k + 1) - at(k.wrapping_sub(1).min(k))) / if k == 0 { 1e-3 } else { 2e-3 };
        let joints = |offset: f64, base: &Joints| std::array::from_fn(|i| if i < 7 { base[i] + offset } else { 0.0 });
        direct.step(&Drive::JointImpedance { q_d: joints(at(k), &from), dq_d: joints(rate, &[0.0; 8]) });
        let q = numbers(robot.state().q);
        worst = q.iter().zip(&direct.q()).fold(worst, |worst, (a, b)| worst.max((a - b).abs()));
    }
    // Encoder noise of 2e-6 and single precision; the arm went 0.2 rad.
    assert!(worst < 2e-5, "{worst} rad");
    command(&mut robot, 1, |_, s| s.motion_finished = true);
    assert_eq!((replies(&mut robot, MOVE), robot.state().robot_mode), (vec![0], RobotMode::Idle.to_u8()));
}

#[test]
fn nineteen_lost_commands_are_bridged_by_the_last_acceleration_and_the_twentieth_stops_the_arm() {
    let mut robot = robot();
    start(&mut robot, GeneratorKind::JointVelocity, Controller::JointImpedance);
    // 0.5 rad/s² in joint 1.
    command(&mut robot, 200, |k, s| s.dq_c[0] = 0.5e-3 * (k + 1) as f64);
    let before = numbers(robot.state().q_d)[0];
    idle(&mut robot, 19);
    let (bridged, speed) = (numbers(robot.state().q_d)[0], numbers(robot.state().dq_d)[0]);
    assert!((speed - 0.1095).abs() < 1e-4, "{speed} rad/s");
    assert!((bridged - before - 19.0 * 1e-3 * 0.1048).abs() < 1e-5, "{} rad", bridged - before);
    assert!((f64::from(robot.state().control_command_success_rate.get()) - 0.81).abs() < 1e-6);
    command(&mut robot, 1, |_, s| s.dq_c[0] = 0.11);
    assert_eq!(robot.state().robot_mode, RobotMode::Move.to_u8(), "a command in time begins anew");
    idle(&mut robot, 19);
    assert_eq!(robot.state().robot_mode, RobotMode::Move.to_u8());
    idle(&mut robot, 1);
    assert_reflex(&mut robot, Fault::CommunicationConstraints);
    idle(&mut robot, 300);
    assert!(robot.hold.rests() && numbers(robot.state().dq)[0].abs() < 1e-2);
    assert_eq!(robot.tally().lost_commands, 39);
}

#[test]
fn a_set_point_that_answers_an_older_state_is_lost() {
    let mut robot = robot();
    start(&mut robot, GeneratorKind::JointVelocity, Controller::JointImpedance);
    command(&mut robot, 10, |_, _| {});
    command(&mut robot, 19, |_, s| s.answers -= 1);
    assert!(robot.running().is_some());
    command(&mut robot, 1, |_, s| s.answers -= 1);
    assert_reflex(&mut robot, Fault::CommunicationConstraints);
}

#[test]
fn running_into_the_table_ends_the_motion_and_recovery_lets_go_of_it() {
    let mut robot = robot();
    start(&mut robot, GeneratorKind::CartesianVelocity, Controller::CartesianImpedance);
    command(&mut robot, 6000, |k, s| s.O_dP_EE_c[2] = -0.1 * smooth(k as f64 / 1000.0));
    assert_reflex(&mut robot, Fault::CartesianReflex);
    let state = *robot.state();
    assert_eq!((state.cartesian_collision[2].get(), state.cartesian_collision[0].get()), (1.0, 0.0));
    // The arm pushes down on the table, so the force on its surroundings points down.
    assert!(numbers(state.O_F_ext_hat_K)[2] < -10.0, "{:?}", numbers(state.O_F_ext_hat_K));
    let tip = numbers(state.O_T_EE)[14] - 0.16;
    assert!(tip.abs() < 0.005, "the tip is at {tip} m");
    recover(&mut robot);
    idle(&mut robot, 200);
    assert!(numbers(robot.state().O_F_ext_hat_K)[2].abs() < 5.0, "{:?}", numbers(robot.state().O_F_ext_hat_K));
    assert_eq!(robot.state().cartesian_collision[2].get(), 0.0);
    start(&mut robot, GeneratorKind::CartesianVelocity, Controller::CartesianImpedance);
    command(&mut robot, 500, |k, s| s.O_dP_EE_c[2] = 0.1 * smooth(k as f64 / 500.0));
    assert!(robot.running().is_some(), "it can leave the table");
}

#[test]
fn a_load_that_is_not_there_shows_as_external_torque_and_one_that_is_does_not() {
    let (mass, centre) = (1.0, [0.0, 0.0, 0.05]);
    let load = Load { mass, centre, inertia: [1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3] };
    let block: EffectTheta = toml_block("name = \"payload\"\nmass = 1.0\ncentre = [0.0, 0.0, 0.05]");
    let theta = Theta { effects: vec![block], ..Theta::default() };
    let torque_2 = |hidden: Option<&Theta>, declared: bool| {
        let mut robot = Robot::new(&cell(), hidden).expect("an FR3");
        if declared {
            robot.request(SET_LOAD, 1, &Request::SetLoad(load));
            assert_eq!(replies(&mut robot, SET_LOAD), [0]);
        }
        idle(&mut robot, 2000);
        assert_eq!(f64::from(robot.state().m_load.get()), if declared { mass } else { 0.0 });
        numbers(robot.state().tau_ext_hat_filtered)[1]
    };
    // The load lies 0.307 m + 0.088 m before the shoulder's axis, roughly: see the ready pose.
    let alone = torque_2(None, true);
    assert!(alone > 2.0 && alone < 4.0, "{alone} N m");
    assert!(torque_2(None, false).abs() < 0.2);
    assert!((torque_2(Some(&theta), false) + alone).abs() < 0.2, "an unknown load shows the other way round");
    assert!(torque_2(Some(&theta), true).abs() < 0.2);
}

fn toml_block(text: &str) -> EffectTheta {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("theta.toml");
    std::fs::write(&path, format!("[[effect]]\n{text}\n")).expect("a file");
    Theta::read(&path).expect("an effect").effects.remove(0)
}

#[test]
fn a_softer_joint_gives_way_further() {
    let sag = |stiffness: f64| {
        let mut robot = robot();
        robot.request(SET_IMPEDANCE, 1, &Request::SetJointImpedance([stiffness; 7]));
        // A load that is not there pushes the arm up with what the robot thinks it has to carry.
        let load = Load { mass: 1.0, centre: [0.0; 3], inertia: [0.0; 9] };
        robot.request(SET_LOAD, 2, &Request::SetLoad(load));
        idle(&mut robot, 4000);
        (numbers(robot.state().q)[1] - numbers(robot.state().q_d)[1]).abs()
    };
    let (soft, stiff) = (sag(300.0), sag(3000.0));
    assert!(soft > 5e-3, "{soft} rad");
    assert!((soft / stiff - 10.0).abs() < 1.0, "{soft} and {stiff} rad");
}

#[test]
fn cartesian_stiffness_decides_how_far_the_hand_gives_way() {
    let sag = |stiffness: f64| {
        let mut robot = robot();
        let k = [stiffness, stiffness, stiffness, 300.0, 300.0, 300.0];
        robot.request(5, 1, &Request::SetCartesianImpedance(k));
        robot.request(SET_LOAD, 2, &Request::SetLoad(Load { mass: 0.5, centre: [0.0; 3], inertia: [0.0; 9] }));
        start(&mut robot, GeneratorKind::CartesianVelocity, Controller::CartesianImpedance);
        command(&mut robot, 2000, |_, _| {});
        assert!(robot.running().is_some());
        numbers(robot.state().O_T_EE)[14] - numbers(robot.state().O_T_EE_d)[14]
    };
    // Half a kilogram of weight that is not there, over the stiffness.
    let (soft, stiff) = (sag(500.0), sag(2000.0));
    assert!((soft - 4.905 / 500.0).abs() < 1e-3 && (stiff - 4.905 / 2000.0).abs() < 5e-4, "{soft} and {stiff} m");
}

#[test]
fn what_a_mode_does_not_allow_is_refused() {
    let mut robot = robot();
    let ask = |robot: &mut Robot, request| {
        robot.request(MOVE, 7, &Request::Move(request));
        robot.tick(None);
        replies(robot, MOVE)
    };
    assert_eq!(ask(&mut robot, motion(GeneratorKind::None, Controller::JointImpedance)), [7]);
    let nowhere = MotionRequest { path_deviation: [0.0; 3], ..motion(GeneratorKind::None, Controller::External) };
    assert_eq!(ask(&mut robot, nowhere), [7]);
    let sparse = |generator, controller| MotionRequest { targets: Some([1.0; 7]), ..motion(generator, controller) };
    assert_eq!(ask(&mut robot, sparse(GeneratorKind::JointVelocity, Controller::JointImpedance)), [7]);
    assert_eq!(ask(&mut robot, sparse(GeneratorKind::JointPosition, Controller::External)), [7]);
    let at_no_speed = MotionRequest {
        targets: Some([1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0]),
        ..motion(GeneratorKind::JointPosition, Controller::JointImpedance)
    };
    assert_eq!(ask(&mut robot, at_no_speed), [7]);
    start(&mut robot, GeneratorKind::None, Controller::External);
    assert_eq!(ask(&mut robot, motion(GeneratorKind::None, Controller::External)), [5], "one motion at a time");
    robot.request(SET_IMPEDANCE, 1, &Request::SetJointImpedance([100.0; 7]));
    assert_eq!(replies(&mut robot, SET_IMPEDANCE), [1], "no setter during a motion");
    robot.request(RECOVER, 1, &Request::AutomaticErrorRecovery);
    assert_eq!(replies(&mut robot, RECOVER), [1]);
    command(&mut robot, 2, |k, s| s.tau_J_d[0] = 5.0 * k as f64);
    assert_reflex(&mut robot, Fault::TorqueDiscontinuity);
    assert_eq!(ask(&mut robot, motion(GeneratorKind::None, Controller::External)), [5], "no motion in a reflex");
    robot.request(SET_IMPEDANCE, 1, &Request::SetJointImpedance([100.0; 7]));
    assert_eq!(replies(&mut robot, SET_IMPEDANCE), [1]);
    robot.request(STOP, 1, &Request::StopMove);
    assert_eq!(replies(&mut robot, STOP), [0], "clients send this after every reflex");
    recover(&mut robot);
    start(&mut robot, GeneratorKind::None, Controller::External);
}

#[test]
fn a_stop_from_outside_preempts_the_motion_and_brakes_inside_the_limits() {
    let mut robot = robot();
    start(&mut robot, GeneratorKind::JointVelocity, Controller::JointImpedance);
    command(&mut robot, 500, |k, s| s.dq_c[0] = smooth(k as f64 / 400.0));
    robot.request(STOP, 3, &Request::StopMove);
    let outbox = robot.outbox();
    let sent: Vec<_> = outbox.before_state.iter().map(|r| (r.number, r.payload[0])).collect();
    assert_eq!(sent, [(MOVE, 2), (STOP, 0)]);
    // A new motion waits until the arm has come to rest.
    robot.request(MOVE, 8, &Request::Move(motion(GeneratorKind::JointVelocity, Controller::JointImpedance)));
    let mut last = *robot.hold.trace();
    for k in 0.. {
        robot.tick(None);
        if replies(&mut robot, MOVE) == [1] {
            assert!(k > 90, "1 rad/s takes more than {k} ms at 10 rad/s²");
            break;
        }
        let trace = *robot.hold.trace();
        assert!(trace.a[0].abs() <= 10.01 && (trace.a[0] - last.a[0]).abs() <= 5.01, "{trace:?}");
        last = trace;
        assert!(k < 1000, "it never comes to rest");
    }
    assert!(robot.running().is_some());
}

#[test]
fn set_points_that_no_arm_can_follow_are_named() {
    use Controller::{CartesianImpedance as Cartesian, External, JointImpedance as Joint};
    use GeneratorKind::{CartesianPose, CartesianVelocity, JointPosition, JointVelocity, None as Torques};
    type Command = fn(usize, &Robot, &mut SetPoint);
    let cases: [(GeneratorKind, Controller, Fault, Command); 11] = [
        (JointPosition, Joint, Fault::JointStartPose, |_, _, s| s.q_c = [0.0; 7]),
        (JointPosition, Joint, Fault::JointVelocityDiscontinuity, |_, r, s| {
            s.q_c = std::array::from_fn(|i| r.hold.trace().q[i] + 1e-3);
        }),
        (JointVelocity, Joint, Fault::JointAccelerationDiscontinuity, |_, _, s| s.dq_c[3] = 8e-3),
        (JointVelocity, Joint, Fault::JointVelocityDiscontinuity, |_, _, s| s.dq_c[3] = f64::NAN),
        (JointVelocity, Joint, Fault::JointVelocityLimits, |k, _, s| s.dq_c[0] = 4e-3 * k as f64),
        // Towards the end of its range a joint may go ever slower, so that it is always too fast before it is too far.
        (JointVelocity, Joint, Fault::JointVelocityLimits, |k, _, s| s.dq_c[5] = -0.5 * smooth(k as f64 / 1000.0)),
        (CartesianPose, Joint, Fault::InvalidFrame, |_, _, s| s.O_T_EE_c = [0.5; 16]),
        (CartesianPose, Joint, Fault::CartesianStartPose, |_, _, s| {
            s.O_T_EE_c = matrix(&nalgebra::Isometry3::identity())
        }),
        (CartesianVelocity, Cartesian, Fault::CartesianVelocityDiscontinuity, |_, _, s| s.O_dP_EE_c[0] = 0.02),
        (Torques, External, Fault::TorqueDiscontinuity, |_, _, s| s.tau_J_d[6] = 1.5),
        (Torques, External, Fault::TorqueRange, |k, _, s| s.tau_J_d[6] = 0.99 * k as f64),
    ];
    for (generator, controller, fault, commanded) in cases {
        let mut robot = robot();
        robot.settings.nominal.collision_torque = [1e3; 7];
        robot.settings.nominal.collision_force = [1e4; 6];
        robot.settings.accelerating = robot.settings.nominal;
        start(&mut robot, generator, controller);
        for k in 0..6000 {
            if robot.running().is_none() {
                break;
            }
            let mut set_point = SetPoint { answers: robot.now(), ..SetPoint::default() };
            commanded(k, &robot, &mut set_point);
            robot.tick(Some(&set_point));
        }
        assert_reflex(&mut robot, fault);
    }
}

#[test]
fn a_pose_with_an_elbow_moves_the_elbow_and_nothing_else() {
    let mut robot = robot();
    start(&mut robot, GeneratorKind::CartesianPose, Controller::JointImpedance);
    let begin = *robot.state();
    let pose = {
        let around = Surroundings::new(robot.body.model(), &robot.rules, &robot.settings);
        matrix(&around.ee.pose(&robot.hold.trace().q))
    };
    let (elbow, side) = (robot.hold.trace().q[2], numbers(begin.elbow_c)[1]);
    command(&mut robot, 2000, |k, s| {
        s.O_T_EE_c = pose;
        s.elbow_c = Some([elbow + 0.3 * smooth(k as f64 / 1900.0), side]);
    });
    assert!(robot.running().is_some(), "{:?}", robot.errors);
    let end = robot.state();
    assert!((numbers(end.elbow)[0] - elbow - 0.3).abs() < 1e-3, "{:?}", numbers(end.elbow));
    let moved = numbers(end.O_T_EE).iter().zip(numbers(begin.O_T_EE)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved < 1e-3, "the hand moved by {moved}");
    command(&mut robot, 1, |_, s| (s.O_T_EE_c, s.elbow_c) = (pose, Some([elbow + 0.3, -side])));
    assert_reflex(&mut robot, Fault::ElbowSignInconsistent);
}

#[test]
fn the_same_commands_give_the_same_states() {
    let run = || {
        let mut robot = robot();
        start(&mut robot, GeneratorKind::CartesianVelocity, Controller::JointImpedance);
        command(&mut robot, 300, |k, s| s.O_dP_EE_c[1] = 0.05 * smooth(k as f64 / 300.0));
        numbers(robot.state().q)
    };
    assert_eq!(run(), run());
}

#[test]
fn the_description_it_hands_out_is_the_arm_that_moves() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("fr3.urdf"), requests::URDF).expect("a file");
    let robot = Described { urdf: Some("fr3.urdf".into()), ..Described::default() };
    let described = Cell { robot: Some(robot), folder: folder.path().to_owned(), ..Cell::default() };
    let (urdf, built_in) = (ArmModel::from_cell(&described).expect("a serial arm"), ArmModel::fr3());
    let q: Joints = std::array::from_fn(|i| 0.2 * i as f64 - 0.6);
    let apart = |a: &Joints, b: &Joints| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(&urdf.gravity(&q), &built_in.gravity(&q)) < 1e-9);
    // A client that computes with the vendor's model finds the same torques in the description.
    let model = franka::model::Model::from_urdf(requests::URDF).expect("the vendor's model");
    let theirs = model.gravity_q(&std::array::from_fn(|i| q[i]), 0.0, &[0.0; 3], &[0.0, 0.0, -9.81]);
    assert!(theirs.iter().zip(&built_in.gravity(&q)).all(|(a, b)| (a - b).abs() < 1e-9), "{theirs:?}");
    let (mut with, mut without) = (urdf.mass_matrix(&q), built_in.mass_matrix(&q));
    for i in 0..7 {
        without[i][i] -= built_in.rotor_inertia()[i];
        with[i][i] -= urdf.rotor_inertia()[i];
        assert!(apart(&with[i], &without[i]) < 1e-9, "row {i}");
    }
    let (a, b) = (urdf.flange(&q).isometry(), built_in.flange(&q).isometry());
    assert!((a.to_homogeneous() - b.to_homogeneous()).norm() < 1e-12);
    let limits = Limits::fr3();
    for (i, joint) in limits.counted().enumerate() {
        assert_eq!([urdf.q_min()[i], urdf.q_max()[i]], [joint.q_min, joint.q_max]);
        let named =
            format!("deceleration_limit=\"{:?}\" velocity_offset=\"{:?}\"", joint.deceleration, joint.velocity_offset);
        assert!(requests::URDF.contains(&named), "{named}");
    }
}
