//! The Robotiq's driver over a pseudo-terminal, with a gripper played at its other end: obedient, silent, noisy, unplugged.

use rt_bridge::device::{Device as _, DeviceFault};
use rt_bridge::gripper::robotiq::Robotiq;
use rt_bridge::gripper::robotiq::modbus::crc;
use serialport::{SerialPort as _, TTYPort};
use shared_mem::cell::{Gripper, GripperModel};
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use std::io::{Read as _, Write as _};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Long enough for a busy machine; nothing is asserted about it.
const PATIENCE: Duration = Duration::from_secs(20);

/// How the played gripper answers its `n`-th question.
type Manner = fn(u32, Vec<u8>) -> Vec<u8>;

/// Plays a gripper until its line is closed: registers that are written are obeyed at once. Returns how often it was asked.
fn play(mut line: TTYPort, manner: Manner) -> JoinHandle<u32> {
    line.set_timeout(PATIENCE).expect("a line");
    thread::spawn(move || {
        let (mut told, mut questions) = ([0_u8; 6], 0);
        loop {
            let mut head = [0; 6];
            if line.read_exact(&mut head).is_err() {
                return questions;
            }
            let rest = if head[1] == 0x10 { 9 } else { 2 };
            let mut tail = vec![0; rest];
            if line.read_exact(&mut tail).is_err() {
                return questions;
            }
            let mut answer = match head {
                [9, 0x03, 0x07, 0xD0, 0, 3] => {
                    // Active as soon as it is told to be, and there as soon as it is told to go.
                    let active = u8::from(told[0] & 1 == 1);
                    let status = told[0] & 0b1001 | (0x30 * active) | 0xC0;
                    vec![9, 3, 6, status, 0, 0, told[3], told[3], 12]
                }
                [9, 0x10, 0x03, 0xE8, 0, 3] => {
                    told.copy_from_slice(&tail[1..7]);
                    head.to_vec()
                }
                other => panic!("no question of this bridge: {other:?}"),
            };
            answer.extend(crc(&answer).to_le_bytes());
            if line.write_all(&manner(questions, answer)).is_err() {
                return questions;
            }
            questions += 1;
        }
    })
}

fn driver(port: TTYPort, patience: Duration) -> Robotiq {
    Robotiq::on(Box::new(port), "serial://pty".into(), &Gripper::new(GripperModel::Robotiq2F85), patience)
}

/// Rounds until the gripper is where it was told to be.
fn arrive(gripper: &mut Robotiq, order: &GripperCommand) -> GripperState {
    let mut order = Some(order);
    loop {
        let state = gripper.round(order.take()).expect("a gripper that answers").expect("a state each round");
        if state.width_d == 0.04 && (state.width - 0.04).abs() < 1e-3 {
            return state;
        }
    }
}

fn go() -> GripperCommand {
    GripperCommand { action: GripperAction::Move, width: 0.04, ..GripperCommand::default() }
}

#[test]
fn a_gripper_is_activated_sent_and_read() {
    let (line, port) = TTYPort::pair().expect("a pseudo-terminal");
    let played = play(line, |_, answer| answer);
    let mut gripper = driver(port, PATIENCE);
    let state = arrive(&mut gripper, &go());
    assert_eq!((state.fault, state.grasped), (0, 0));
    assert_eq!(gripper.complaint(), None);
    drop(gripper);
    assert!(played.join().expect("it played to the end") > 4);
}

#[test]
fn answers_that_are_damaged_now_and_then_are_asked_for_again() {
    let (line, port) = TTYPort::pair().expect("a pseudo-terminal");
    let played = play(line, |question, mut answer| {
        if question.is_multiple_of(3) {
            answer[4] ^= 0x10;
        }
        answer
    });
    let mut gripper = driver(port, PATIENCE);
    arrive(&mut gripper, &go());
    drop(gripper);
    played.join().expect("it played to the end");
}

#[test]
fn a_line_that_damages_every_answer_is_told_apart_from_silence() {
    let (line, port) = TTYPort::pair().expect("a pseudo-terminal");
    let played = play(line, |_, mut answer| {
        answer[3] ^= 1;
        answer
    });
    let mut gripper = driver(port, PATIENCE);
    let fault = gripper.round(None).expect_err("no answer is good");
    assert!(matches!(&fault, DeviceFault::Garbled { why, .. } if why.contains("check sum")), "{fault}");
    drop(gripper);
    assert_eq!(played.join().expect("it played to the end"), 3);
}

#[test]
fn a_silent_line_is_told_in_one_line_with_what_to_check() {
    let (line, port) = TTYPort::pair().expect("a pseudo-terminal");
    let mut gripper = driver(port, Duration::from_millis(5));
    let fault = gripper.round(Some(&go())).expect_err("nobody is there").to_string();
    assert_eq!(
        fault,
        "serial://pty does not answer; check its 24 V supply and the cable; it is taken up by itself when it does"
    );
    drop(line);
}

#[test]
fn an_adapter_that_is_pulled_out_is_gone() {
    let (line, port) = TTYPort::pair().expect("a pseudo-terminal");
    let mut gripper = driver(port, PATIENCE);
    drop(line);
    let fault = gripper.round(None).expect_err("the line is closed");
    assert!(matches!(fault, DeviceFault::Gone { .. }), "{fault}");
    assert!(fault.to_string().contains("plug it in again"), "{fault}");
}

#[test]
fn a_port_that_is_not_there_is_refused_with_what_to_do() {
    let path = std::path::Path::new("/dev/no-such-port");
    let error = Robotiq::open(path, &Gripper::new(GripperModel::Robotiq2F85)).err().expect("no such port");
    assert!(error.to_string().contains("ls /dev/serial/by-id"), "{error}");
}
