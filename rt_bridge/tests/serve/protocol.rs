//! The protocol, byte by byte.

use crate::client::{Client, at, motion, numbers};
use crate::{Served, cell, free_ports};
use rt_bridge::serve::{Pace, Ports, ServeError, Server};
use std::io::Write;
use std::net::TcpListener;
use std::time::Duration;

const IDLE: u8 = 1;
const MOVE: u8 = 2;
const REFLEX: u8 = 4;
const COMMUNICATION: usize = 25;

#[test]
fn a_client_of_another_version_is_told_ours_and_sent_nothing() {
    let served = Served::start(Pace::Fast);
    for version in [5, 9, 11] {
        let mut client = Client::silent(served.address);
        assert_eq!(client.shake_hands(version).payload, [1, 10, 0]);
        assert!(!client.gets_states(), "version {version}");
    }
    let mut client = Client::connected(served.address);
    assert_eq!(client.state_in_mode(IDLE)[at::GENERATOR], 0);
}

#[test]
fn a_request_in_pieces_is_understood_and_garbage_costs_the_connection_alone() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::silent(served.address);
    for byte in client.handshake(10) {
        client.tcp.write_all(&[byte]).expect("the server reads");
        std::thread::sleep(Duration::from_micros(300));
    }
    assert_eq!(client.reply().payload, [0, 10, 0]);
    // Two requests in one piece.
    let (first, second) = (client.send(2, &[]), client.send(11, &[]));
    assert_eq!(client.reply().id, first);
    let model = client.reply();
    assert_eq!((model.id, model.payload[0]), (second, 0));
    let text = String::from_utf8(model.payload[1..].to_vec()).expect("a URDF");
    assert!(text.contains("<link name=\"link8\"/>") && text.ends_with("</robot>\n"), "{text}");
    // What is no request of this protocol is refused: unknown, too short, and as a set point.
    assert_eq!([client.ask(99, &[]), client.ask(4, &[1, 2]), client.ask(1, &[0; 113])], [1, 2, 7]);
    client.state();
    client.send_datagram(&[0xff; 371]);
    client.send_datagram(&[1; 3]);
    client.tcp.write_all(&[0xff; 64]).expect("the server reads");
    assert!(client.is_cut_off());
    drop(client);
    // Nor does somebody who asks before the handshake, or leaves without a word, stop the next one.
    drop(Client::silent(served.address));
    let mut rude = Client::silent(served.address);
    rude.send(2, &[]);
    assert!(rude.is_cut_off());
    let mut client = Client::connected(served.address);
    client.state_in_mode(IDLE);
}

#[test]
fn a_motion_is_announced_shown_commanded_finished_shown_and_announced() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::connected(served.address);
    let before = client.state();
    assert_eq!((before[at::ROBOT_MODE], before[at::CONTROLLER]), (IDLE, 3));
    let id = client.send(1, &motion(0, 0));
    let started = client.reply();
    assert_eq!((started.number, started.id, &started.payload[..]), (1, id, &[1][..]));
    let mut state = client.state_in_mode(MOVE);
    assert_eq!((state[at::GENERATOR], state[at::CONTROLLER]), (1, 0));
    assert_eq!(success_rate(&state), 0.0);
    state = client.state();
    for _ in 0..50 {
        client.answer(&state, |_| {});
        let next = client.state();
        assert_eq!(counter(&next), counter(&state) + 1, "in lock-step the robot's clock waits");
        state = next;
    }
    assert_eq!(success_rate(&state), 1.0);
    assert_eq!(client.ask(4, &[0; 56]), 1, "no setter while it moves");
    client.answer(&state, |command| command[at::MOTION_FINISHED] = 1);
    client.state_in_mode(IDLE);
    let over = client.reply();
    assert_eq!((over.number, over.id, &over.payload[..]), (1, id, &[0][..]));
    assert_eq!(client.ask(4, &[0; 56]), 0);
}

#[test]
fn a_client_that_falls_silent_is_stopped_and_can_recover() {
    // Free-running: this is the one thing a robot that waits for its client cannot show.
    let served = Served::start(Pace::RealTime);
    let mut client = Client::connected(served.address);
    client.state();
    let id = client.send(1, &motion(2, 4));
    assert_eq!(client.reply().payload, [1]);
    let mut state = client.state_in_mode(MOVE);
    // Answers until one was in time, then no more.
    while success_rate(&state) == 0.0 && state[at::ROBOT_MODE] == MOVE {
        client.answer(&state, |_| {});
        state = client.state();
    }
    let state = client.state_in_mode(REFLEX);
    assert_eq!(state[at::ERRORS + COMMUNICATION], 1);
    let over = client.reply();
    assert_eq!((over.id, &over.payload[..]), (id, &[8][..]));
    assert_eq!(client.ask(1, &motion(2, 4)), 5, "no motion in a reflex");
    assert_eq!(client.ask(2, &[]), 0);
    assert_eq!(client.ask(10, &[]), 0);
    let state = client.state_in_mode(IDLE);
    assert_eq!(state[at::ERRORS + COMMUNICATION], 0);
    assert_eq!(client.ask(1, &motion(2, 4)), 1);
    drop(client);
    let report = served.finish();
    assert_eq!((report.robot.motions, report.clients), (2, 1));
    // The second motion may be seen to be left behind before all ends.
    assert!((1..=2).contains(&report.robot.reflexes), "{report:?}");
    assert!(report.robot.lost_commands >= 20);
}

#[test]
fn at_rest_after_a_reflex_no_error_is_left_but_its_reason_until_it_is_recovered() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::connected(served.address);
    client.state();
    client.send(1, &motion(0, 0));
    assert_eq!(client.reply().payload, [1]);
    let mut state = client.state_in_mode(MOVE);
    for _ in 0..20 {
        client.answer(&state, |_| {});
        state = client.state();
    }
    // A step of the position, which no joint can follow.
    client.answer(&state, |command| {
        let place = at::Q_C..at::Q_C + 8;
        let q = f64::from_le_bytes(command[place.clone()].try_into().expect("eight bytes"));
        command[place].copy_from_slice(&(q + 0.1).to_le_bytes());
    });
    let first = client.state_in_mode(REFLEX);
    let raised = flags(&first, at::ERRORS);
    assert!(!raised.is_empty() && raised == flags(&first, at::REASON), "{raised:?}");
    let resting = loop {
        let state = client.state();
        assert_eq!((state[at::ROBOT_MODE], flags(&state, at::REASON)), (REFLEX, raised.clone()));
        if flags(&state, at::ERRORS).is_empty() {
            break state;
        }
    };
    let fastest = numbers(&resting, at::DQ, 7).into_iter().map(f64::abs).fold(0.0, f64::max);
    assert!(fastest < 0.05, "still {fastest} rad/s");
    assert_eq!(client.reply().payload, [8]);
    assert_eq!(client.ask(1, &motion(2, 4)), 5, "no motion in a reflex");
    assert_eq!(client.ask(10, &[]), 0);
    let idle = client.state_in_mode(IDLE);
    assert_eq!((flags(&idle, at::ERRORS), flags(&idle, at::REASON)), (vec![], raised));
}

#[test]
fn a_client_that_is_gone_in_a_motion_leaves_a_reflex_to_the_next_one() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::connected(served.address);
    client.state();
    client.send(1, &motion(0, 0));
    assert_eq!(client.reply().payload, [1]);
    let mut state = client.state_in_mode(MOVE);
    for _ in 0..20 {
        client.answer(&state, |_| {});
        state = client.state();
    }
    // Its system closes the connection of a program that is killed, as here.
    drop(client);
    let mut next = Client::connected(served.address);
    let state = next.state();
    assert_eq!(state[at::ROBOT_MODE], REFLEX);
    assert_eq!(flags(&state, at::REASON), [COMMUNICATION]);
    assert_eq!(next.ask(1, &motion(0, 0)), 5, "no motion in a reflex");
    assert_eq!(next.ask(10, &[]), 0);
    next.state_in_mode(IDLE);
    assert_eq!(next.ask(1, &motion(0, 0)), 1);
    // One that leaves an arm at rest leaves it idle.
    next.send(2, &[]);
    next.state_in_mode(IDLE);
    drop(next);
    let mut last = Client::connected(served.address);
    assert_eq!(last.state()[at::ROBOT_MODE], IDLE);
}

#[test]
fn torques_end_by_their_own_flag() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::connected(served.address);
    client.state();
    client.send(1, &motion(2, 4));
    assert_eq!(client.reply().payload, [1]);
    client.state_in_mode(MOVE);
    let mut state = client.state();
    assert_eq!((state[at::GENERATOR], state[at::CONTROLLER]), (5, 2));
    for _ in 0..20 {
        client.answer(&state, |_| {});
        state = client.state();
    }
    client.answer(&state, |command| command[at::TORQUE_FINISHED] = 1);
    client.state_in_mode(IDLE);
    assert_eq!(client.reply().payload, [0]);
}

#[test]
fn a_port_that_is_taken_is_named_with_the_way_to_choose_another() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = taken.local_addr().expect("it is bound").port();
    for (ports, flag) in [
        (Ports { arm: port, ..free_ports() }, "`--port`"),
        (Ports { hand: Some(port), ..free_ports() }, "`--hand-port`"),
    ] {
        let Err(error) = Server::open(&cell(), None, ports, Pace::Fast) else { panic!("the port is taken") };
        let text = error.to_string();
        assert!(matches!(error, ServeError::PortTaken { .. }));
        assert!(text.contains(&format!("port {port} of 127.0.0.1 is taken")) && text.contains(flag), "{text}");
    }
}

/// Places of the errors that are set among the 41 from `offset` on.
fn flags(state: &crate::client::State, offset: usize) -> Vec<usize> {
    (0..41).filter(|i| state[offset + i] != 0).collect()
}

fn counter(state: &crate::client::State) -> u64 {
    u64::from_le_bytes(state[..8].try_into().expect("eight bytes"))
}

fn success_rate(state: &crate::client::State) -> f64 {
    numbers(state, at::SUCCESS_RATE, 1)[0]
}
