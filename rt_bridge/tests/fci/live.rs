//! The driver against a robot in a process of its own. Start `rt_bridge serve --cell config/fr3_cell.toml --lock-step`, or
//! `FR3_MJCF=fr3.xml run-franka-sim-server` (from the Python package franka-sim), then:
//! `cargo test --release -p rt_bridge --test fci -- --ignored --test-threads 1 --nocapture`.
//! `FCI_HOST` names another address than 127.0.0.1.

use crate::counting::allocations;
use rt_bridge::arm::{Arm, ArmFault, Read};
use rt_bridge::fr3;
use rt_bridge::rt::Realtime;
use rt_bridge::safety::{Limits, TorqueGuard};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use std::f64::consts::TAU;
use std::time::{Duration, Instant};

/// Gains of the law the bridge uses [N m/rad, N m s/rad].
const STIFFNESS: [f64; 7] = [600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0];
const DAMPING: [f64; 7] = [50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0];

/// Connects as soon as the server's only place is free: it needs a moment after the client before.
fn connected() -> Box<dyn Arm> {
    let host = std::env::var("FCI_HOST").unwrap_or_else(|_| "127.0.0.1".into());
    let begin = Instant::now();
    loop {
        match fr3::connect(&host, Realtime::Ignore, &Cell::default()) {
            Ok(arm) => return arm,
            Err(error) if begin.elapsed() > Duration::from_secs(15) => panic!("{error}"),
            Err(_) => std::thread::sleep(Duration::from_millis(300)),
        }
    }
}

/// What a sweep saw.
#[derive(Debug, Default)]
struct Seen {
    cycles: u64,
    skipped: u64,
    allocations: u64,
    worst_error: f64,
    success: f64,
}

/// Sweeps all joints by `amplitude` [rad] and back with continuous acceleration, `seconds` long.
fn sweep(arm: &mut dyn Arm, interface: CommandInterface, amplitude: f64, seconds: f64) -> Result<Seen, ArmFault> {
    let mut state = ArmState::default();
    arm.read(&mut state)?;
    let from = if interface == CommandInterface::Torque { state.q } else { state.q_d };
    let begin = state.device_ns;
    let limits = Limits::fr3();
    let mut guard = TorqueGuard::after(&state.tau_J_d, &limits);
    let (mut seen, mut last_ns, before) = (Seen::default(), begin, allocations());
    while last_ns < begin + (seconds * 1e9) as u64 {
        if arm.read(&mut state)? != Read::Fresh {
            continue;
        }
        let t = (state.device_ns - begin) as f64 * 1e-9;
        // A raised cosine, faded in and out by another: at rest with zero acceleration at both ends.
        let (slow, fast) = (TAU / seconds, TAU / 2.0);
        let fade = 0.5 * (1.0 - (slow * t).cos());
        let wave = amplitude * fade * fade * (fast * t).sin();
        let slope =
            amplitude * (fade * slow * (slow * t).sin() * (fast * t).sin() + fade * fade * fast * (fast * t).cos());
        let mut command = ArmCommand { interface, ..ArmCommand::default() };
        for j in 0..7 {
            command.q_d[j] = from[j] + wave;
            command.dq_d[j] = slope;
            command.tau_J_d[j] = STIFFNESS[j] * (command.q_d[j] - state.q[j]) + DAMPING[j] * (slope - state.dq[j]);
            seen.worst_error = seen.worst_error.max((command.q_d[j] - state.q[j]).abs());
        }
        command.tau_J_d = guard.clamp(&command.tau_J_d, &limits, 1e-3).tau;
        arm.command(&command)?;
        seen.cycles += 1;
        seen.skipped += (state.device_ns - last_ns) / 1_000_000 - 1;
        last_ns = state.device_ns;
    }
    seen.allocations = allocations() - before;
    seen.success = state.success_rate;
    Ok(seen)
}

fn swept(interface: CommandInterface) {
    let mut arm = connected();
    if matches!(arm.start(interface), Err(ArmFault::Reflex { .. })) {
        arm.recover().expect("nothing holds the arm");
        arm.start(interface).expect("it is recovered");
    }
    let seen = sweep(arm.as_mut(), interface, 0.1, 6.0).unwrap_or_else(|fault| panic!("{fault}"));
    eprintln!("{interface:?}: {seen:?}");
    arm.stop();
    let mut state = ArmState::default();
    arm.read(&mut state).expect("states go on after the motion");
    assert_eq!(state.mode, ArmMode::Idle);
    assert_eq!(seen.allocations, 0);
    assert!(seen.worst_error < 0.1, "{seen:?}");
}

#[test]
#[ignore = "needs an FCI server at 127.0.0.1: cargo test --release -p rt_bridge --test fci -- --ignored --test-threads 1 --nocapture"]
fn torques_sweep_a_live_robot_and_leave_it_idle() {
    swept(CommandInterface::Torque);
}

#[test]
#[ignore = "needs an FCI server at 127.0.0.1: cargo test --release -p rt_bridge --test fci -- --ignored --test-threads 1 --nocapture"]
fn positions_sweep_a_live_robot_and_leave_it_idle() {
    swept(CommandInterface::JointPosition);
}
