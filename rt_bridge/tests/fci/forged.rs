//! States that are not the robot's: from another address, or forged down to the robot's own. None of them is taken for a
//! state, ends a run or changes what is answered.

use crate::motion::{command, connected};
use crate::robot::{MOVE, Robot, STATE_LENGTH, at};
use rt_bridge::arm::{Arm, Read};
use shared_mem::msg::arm::{ArmState, CommandInterface};
use std::net::UdpSocket;

type State = [u8; STATE_LENGTH];

fn counted(mut state: State, counter: u64) -> State {
    state[..8].copy_from_slice(&counter.to_le_bytes());
    state
}

/// Datagrams of a state's length that no robot sends at the counter `now`.
fn forged(real: &State, now: u64) -> Vec<State> {
    let mut noise = now | 1;
    let mut random = [0; STATE_LENGTH];
    random.fill_with(|| {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        noise as u8
    });
    let mut nowhere = counted(*real, now + 1);
    nowhere[at::Q..at::Q + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut elsewhere = counted(*real, now + 1);
    elsewhere[at::Q..at::Q + 4].copy_from_slice(&2.0_f32.to_le_bytes());
    let mut flags = counted(*real, now + 1);
    flags[at::ERRORS] = 7;
    let replayed = counted(*real, now.saturating_sub(500));
    vec![
        random,
        counted([0xff; STATE_LENGTH], u64::MAX),
        counted(*real, u64::MAX),
        counted(*real, u64::MAX / 1_000_000),
        counted(*real, now + 1_000_000),
        nowhere,
        elsewhere,
        flags,
        replayed,
        counted(*real, 0),
    ]
}

/// Plays a motion with `meanwhile` before each cycle and checks that the robot's states alone were read and answered.
fn plays_undisturbed(robot: &Robot, arm: &mut dyn Arm, mut meanwhile: impl FnMut(&ArmState)) {
    const CYCLES: usize = 300;
    arm.start(CommandInterface::Torque).expect("it is idle");
    let (mut state, mut last_ns) = (ArmState::default(), 0);
    for _ in 0..CYCLES {
        meanwhile(&state);
        assert_eq!(arm.read(&mut state), Ok(Read::Fresh));
        assert_eq!(arm.command(&command(CommandInterface::Torque)), Ok(()));
        assert!(state.device_ns > last_ns && state.q[0] == 0.0, "{state:?}");
        last_ns = state.device_ns;
    }
    let script = robot.script();
    assert!(last_ns <= script.counter * 1_000_000, "{last_ns} ns is no state of the robot");
    assert!(!script.commands.is_empty());
    let answered = |bytes: &[u8]| u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes"));
    assert!(script.commands.iter().all(|bytes| (1000..=script.counter).contains(&answered(bytes))));
    assert_eq!(script.state[at::ROBOT_MODE], MOVE);
}

#[test]
fn states_that_are_forged_down_to_the_robots_address_change_nothing() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    robot.script().before_each = forged;
    plays_undisturbed(&robot, arm.as_mut(), |_| {});
    arm.stop();
}

#[test]
fn states_from_another_address_change_nothing() {
    let robot = Robot::new();
    let mut arm = connected(&robot);
    let (to, real) = {
        let script = robot.script();
        (script.client.expect("it is connected"), script.state)
    };
    let sockets = ["127.0.0.1:0", "127.0.0.16:0"].map(|at| UdpSocket::bind(at).expect("a free port"));
    plays_undisturbed(&robot, arm.as_mut(), |state| {
        let about = state.device_ns / 1_000_000;
        for socket in &sockets {
            // Among them such that the robot might have sent.
            let right = (1..5).map(|ahead| counted(real, about + ahead));
            for datagram in forged(&real, about).into_iter().chain(right) {
                let _refused = socket.send_to(&datagram, to);
            }
            let _refused = socket.send_to(&[0; 7], to);
        }
    });
    arm.stop();
}
