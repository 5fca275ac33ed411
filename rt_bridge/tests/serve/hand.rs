//! The hand: its protocol byte by byte, and driven by the bridge's own driver.

use crate::Served;
use rt_bridge::device::Device as _;
use rt_bridge::serve::Pace;
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::time::Duration;

struct Hand {
    tcp: TcpStream,
    udp: UdpSocket,
}

impl Hand {
    fn ask(&mut self, number: u16, id: u32, payload: &[u8]) {
        let size = 10 + u32::try_from(payload.len()).expect("a short payload");
        let message = [&number.to_le_bytes()[..], &id.to_le_bytes(), &size.to_le_bytes(), payload].concat();
        self.tcp.write_all(&message).expect("the hand reads");
    }

    /// Counter and payload of the next reply.
    fn reply(&mut self, payload: usize) -> (u32, Vec<u8>) {
        let mut message = vec![0; 10 + payload];
        self.tcp.read_exact(&mut message).expect("a reply");
        (u32::from_le_bytes([message[2], message[3], message[4], message[5]]), message[10..].to_vec())
    }

    /// Width and widest of the next state [m].
    fn widths(&self) -> [f64; 2] {
        let mut state = [0; 64];
        assert_eq!(self.udp.recv(&mut state).expect("a state"), 23);
        [4, 12].map(|at| f64::from_le_bytes(state[at..at + 8].try_into().expect("eight bytes")))
    }

    /// A state in which the fingers are so far apart [m].
    fn wait_for(&self, width: f64) {
        while (self.widths()[0] - width).abs() > 1e-9 {}
    }
}

fn connected(served: &Served, version: u16) -> (Hand, Vec<u8>) {
    let tcp = TcpStream::connect(served.hand).expect("the hand listens");
    let udp = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    tcp.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout above zero");
    udp.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout above zero");
    let port = udp.local_addr().expect("it is bound").port();
    let mut hand = Hand { tcp, udp };
    hand.ask(0, 0, &[version.to_le_bytes(), port.to_le_bytes()].concat());
    let (_, payload) = hand.reply(4);
    (hand, payload)
}

fn numbers(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

#[test]
fn the_hand_homes_moves_and_grasps_nothing() {
    let served = Served::start(Pace::Fast);
    let (refused, payload) = connected(&served, 2);
    assert_eq!(payload, [1, 0, 3, 0]);
    drop(refused);
    let (mut hand, payload) = connected(&served, 3);
    assert_eq!(payload, [0, 0, 3, 0]);
    assert_eq!(hand.widths()[1], 0.08);
    hand.ask(1, 1, &[]);
    assert_eq!(hand.reply(2), (1, vec![0, 0]));
    hand.wait_for(0.08);
    hand.ask(3, 2, &numbers(&[0.05, 0.1]));
    assert_eq!(hand.reply(2), (2, vec![0, 0]));
    hand.wait_for(0.05);
    // Wider than the fingers go.
    hand.ask(3, 3, &numbers(&[0.5, 0.1]));
    assert_eq!(hand.reply(2), (3, vec![1, 0]));
    hand.ask(2, 4, &numbers(&[0.03, 0.005, 0.005, 0.1, 20.0]));
    assert_eq!(hand.reply(2), (4, vec![2, 0]), "there is nothing to grasp");
    // A stop cuts off what runs: first the end of that, then its own.
    hand.ask(3, 5, &numbers(&[0.08, 0.001]));
    hand.ask(4, 6, &[]);
    assert_eq!([hand.reply(2), hand.reply(2)], [(5, vec![3, 0]), (6, vec![0, 0])]);
}

/// Rounds until the hand reports what is wanted.
fn until(hand: &mut rt_bridge::fr3::Hand, order: Option<&GripperCommand>, wanted: impl Fn(&GripperState) -> bool) {
    let mut order = order;
    loop {
        if let Some(state) = hand.round(order.take()).expect("the hand is there")
            && wanted(&state)
        {
            return;
        }
    }
}

#[test]
fn the_bridges_own_driver_moves_the_hand_and_misses_it_when_it_is_gone() {
    let served = Served::start(Pace::Fast);
    let mut hand = rt_bridge::fr3::Hand::connect(&served.hand.to_string()).expect("a hand");
    let order = |action, width| GripperCommand { action, width, ..GripperCommand::default() };
    until(&mut hand, Some(&order(GripperAction::Home, 0.0)), |state| state.width == 0.08);
    until(&mut hand, Some(&order(GripperAction::Move, 0.03)), |state| state.width == 0.03 && state.width_d == 0.03);
    // A newer order takes the place of one that is under way.
    let slow = GripperCommand { speed: 1e-4, ..order(GripperAction::Move, 0.08) };
    until(&mut hand, Some(&slow), |state| state.width_d == 0.08);
    until(&mut hand, Some(&order(GripperAction::Move, 0.05)), |state| state.width == 0.05);
    assert_eq!(hand.complaint(), None);
    hand.round(Some(&order(GripperAction::Move, 0.5))).expect("the hand is there");
    while hand.complaint().is_none() {
        hand.round(None).expect("the hand is there");
    }
    drop(served);
    let fault = loop {
        if let Err(fault) = hand.round(None) {
            break fault.to_string();
        }
    };
    assert!(fault.contains("is gone") || fault.contains("does not answer"), "{fault}");
    let refused = rt_bridge::fr3::Hand::connect("127.0.0.1:9").err().expect("nobody listens there").to_string();
    assert!(refused.contains("cannot be opened (connection refused)"), "{refused}");
}

#[test]
fn a_hand_that_pauses_is_not_lost() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("it is bound");
    let theirs = std::thread::spawn(move || {
        let (mut tcp, _) = listener.accept().expect("the driver connects");
        let mut request = [0; 14];
        tcp.read_exact(&mut request).expect("a handshake");
        let port = u16::from_le_bytes([request[12], request[13]]);
        let reply = [&[0, 0][..], &request[2..6], &14_u32.to_le_bytes(), &[0, 0, 3, 0]].concat();
        tcp.write_all(&reply).expect("the driver listens");
        let udp = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        for id in 1_u32..=2 {
            let width = 0.01 * f64::from(id);
            let state = [&id.to_le_bytes()[..], &numbers(&[width, 0.08]), &[0, 0, 0]].concat();
            udp.send_to(&state, ("127.0.0.1", port)).expect("the driver listens");
            std::thread::sleep(Duration::from_millis(300));
        }
        tcp
    });
    let mut hand = rt_bridge::fr3::Hand::connect(&address.to_string()).expect("a hand");
    until(&mut hand, None, |state| state.width == 0.01);
    until(&mut hand, None, |state| state.width == 0.02);
    drop(theirs.join().expect("a hand that paused"));
}
