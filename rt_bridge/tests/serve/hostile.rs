//! Programs that are no good clients, and settings that no arm can bear: the robot goes on, and serves the next one.

use crate::client::{Client, at, motion, numbers};
use crate::{Served, cell, free_ports};
use rt_bridge::serve::{Pace, Server};
use std::io::{Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

const IDLE: u8 = 1;
const MOVE: u8 = 2;
const SET_LOAD: u32 = 9;

/// Payload of a SetLoad.
fn load(mass: f64, at: f64) -> Vec<u8> {
    [[mass, at].as_slice(), &[0.0; 11]].concat().iter().flat_map(|x| x.to_le_bytes()).collect()
}

#[test]
fn a_second_client_is_refused_at_once_and_finds_the_place_free_when_the_first_has_left() {
    let served = Served::start(Pace::Fast);
    let mut first = Client::connected(served.address);
    let mut second = Client::silent(served.address);
    assert_eq!(second.shake_hands(10).payload, [2, 10, 0]);
    assert!(second.is_cut_off() && !second.gets_states());
    assert_eq!(first.ask(2, &[]), 0, "the first one is served");
    drop(first);
    Client::connected(served.address).state_in_mode(IDLE);
    let report = served.finish();
    assert_eq!((report.clients, report.refused), (2, 1));
}

#[test]
fn silence_half_headers_and_garbage_keep_nobody_out() {
    let served = Served::start(Pace::Fast);
    let connect = || TcpStream::connect(served.address).expect("it listens");
    let silent: Vec<TcpStream> = (0..40).map(|_| connect()).collect();
    let mut halves: Vec<TcpStream> = (0..40).map(|_| connect()).collect();
    halves.iter_mut().for_each(|half| half.write_all(&[0; 5]).expect("a socket"));
    for k in 0..500_u32 {
        // It may be cut off before all of it is sent.
        let _cut_off = connect().write_all(&k.to_le_bytes().repeat(100));
    }
    let mut client = Client::connected(served.address);
    client.state_in_mode(IDLE);
    drop((silent, halves));
    assert_eq!(client.ask(2, &[]), 0, "it is still served");
    let report = served.finish();
    assert!(report.clients == 1 && report.refused > 0, "{report:?}");
}

#[test]
fn the_hand_too_refuses_a_second_client_and_passes_over_silent_ones() {
    let served = Served::start(Pace::Fast);
    let _silent = TcpStream::connect(served.hand).expect("it listens");
    let shake_hands = || {
        let mut tcp = TcpStream::connect(served.hand).expect("it listens");
        tcp.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout above zero");
        let request = [&[0, 0][..], &7_u32.to_le_bytes(), &14_u32.to_le_bytes(), &[3, 0, 9, 0]].concat();
        tcp.write_all(&request).expect("the hand reads");
        let mut reply = [0; 14];
        tcp.read_exact(&mut reply).expect("a reply");
        (tcp, reply)
    };
    let (_first, welcome) = shake_hands();
    assert_eq!(welcome[10..], [0, 0, 3, 0]);
    let (_second, refusal) = shake_hands();
    assert_eq!((&refusal[2..6], &refusal[10..]), (&7_u32.to_le_bytes()[..], &[2, 0, 3, 0][..]));
}

#[test]
fn set_points_of_somebody_else_are_not_the_clients() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::connected(served.address);
    client.state();
    client.send(1, &motion(0, 0));
    assert_eq!(client.reply().payload, [1]);
    let mut state = client.state_in_mode(MOVE);
    let robot = client.from.expect("a state came");
    let others = ["127.0.0.1:0", "127.0.0.16:0"].map(|at| UdpSocket::bind(at).expect("a free port"));
    for k in 0..200 {
        // Each would be the first answer to the state, and end the motion or tear the arm away.
        for (number, other) in others.iter().enumerate() {
            let mut command = [0; 371];
            command[..8].copy_from_slice(&state[..8]);
            command[at::MOTION_FINISHED] = u8::from((k + number) % 2 == 0);
            command[at::Q_C] = 0x40;
            let _refused = other.send_to(&command, robot);
            let _refused = other.send_to(&[0xff; 371], robot);
        }
        client.answer(&state, |_| {});
        state = client.state();
        assert_eq!(state[at::ROBOT_MODE], MOVE);
    }
    let report = served.finish();
    assert_eq!((report.robot.reflexes, report.robot.motions), (0, 1));
    // The one that was owed when the server stopped.
    assert!(report.robot.lost_commands <= 1, "{report:?}");
}

#[test]
fn a_load_that_no_arm_bears_is_refused_and_one_that_was_set_ends_with_its_client() {
    let served = Served::start(Pace::Fast);
    let mut client = Client::connected(served.address);
    assert_eq!([client.ask(SET_LOAD, &load(20.0, 900.0)), client.ask(SET_LOAD, &load(1.0, 0.1))], [2, 0]);
    let state = (0..2000).map(|_| client.state()).find(|state| numbers(state, at::M_LOAD, 1) == [1.0]);
    let state = state.expect("a state that shows the load");
    assert!(numbers(&state, at::DQ, 7).iter().all(|dq| dq.abs() < 0.5));
    drop(client);
    assert_eq!(numbers(&Client::connected(served.address).state(), at::M_LOAD, 1), [0.0]);
}

#[test]
fn the_time_is_up_also_while_a_client_in_lock_step_lets_the_robot_wait() {
    for pace in [Pace::Fast, Pace::LockStep] {
        let server = Server::open(&cell(), None, free_ports(), pace).expect("an FR3 and free ports");
        let address = server.address().expect("it listens");
        let (done, ended) = std::sync::mpsc::channel();
        let serving = std::thread::spawn(move || {
            let report = server.run(&AtomicBool::new(false), Some(Duration::from_secs(2)));
            let _nobody_waits = done.send(());
            report
        });
        let mut client = Client::connected(address);
        client.state();
        client.send(1, &motion(2, 4));
        assert_eq!(client.reply().payload, [1]);
        let state = client.state_in_mode(MOVE);
        client.answer(&state, |_| {});
        // From here on it says nothing more.
        ended.recv_timeout(Duration::from_secs(60)).expect("it stops by itself");
        let report = serving.join().expect("it does not panic");
        assert_eq!((report.robot.motions, report.robot.reflexes), (1, 0), "{report:?}");
        assert!(report.robot.cycles < 60_000, "the clock stood still: {report:?}");
    }
}
