//! What a client can send, without its sockets and its clock: for the fuzz targets, and for the tests of what they found.
//! Compiled for these two alone; no built program has it.

use super::framing::{Inbox, InvalidLength, Message};
use super::hand::wire as hand_wire;
use super::robot::Robot;
use super::wire::{request, set_point};
use crate::gripper::FRANKA_HAND;
use crate::gripper::fingers::Fingers;
use shared_mem::cell::Cell;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::OnceLock;

/// Length of a set point [bytes].
const SET_POINT: usize = 371;

/// Bytes of a set point that count the state it answers.
const ANSWERS: std::ops::Range<usize> = 0..8;

/// Milliseconds that one input may let pass.
const LONGEST: u32 = 300;

fn robot() -> Robot {
    static CELL: OnceLock<Cell> = OnceLock::new();
    let cell = CELL.get_or_init(|| {
        let text = include_str!("../../../config/fr3_cell.toml");
        Cell::parse(text, Path::new("cell.toml")).expect("the shipped cell")
    });
    Robot::new(cell, None).expect("an FR3")
}

/// Plays an input to the served arm. It is a row of steps, each begun by a byte `b`: `b % 4` of 0 sends the `b / 4` bytes that
/// follow over TCP, 1 sends a datagram of as many as a set point has, 2 the same with the counter of the newest state in it,
/// 3 lets `b / 4` milliseconds pass. Whatever is sent, the arm's state stays numbers. Gives the motions that were started.
pub fn arm(input: &[u8]) -> u64 {
    let (mut robot, mut inbox, mut passed) = (robot(), Inbox::of_the_arm(), 0);
    let mut rest = input;
    while let Some((&step, after)) = rest.split_first() {
        rest = after;
        let count = usize::from(step / 4);
        match step % 4 {
            0 => {
                let Ok(messages) = arrived(&mut inbox, &take(&mut rest, count)) else { break };
                for message in messages {
                    if let Ok(asked) = request(message.number, &message.payload) {
                        robot.request(message.number, message.id, &asked);
                    }
                }
            }
            3 => {
                for _ in 0..count.min((LONGEST - passed) as usize) {
                    robot.tick(None);
                    passed += 1;
                }
            }
            kind => {
                let mut datagram = take(&mut rest, SET_POINT);
                if kind == 2 && datagram.len() == SET_POINT {
                    datagram[ANSWERS].copy_from_slice(&robot.now().to_le_bytes());
                }
                if passed < LONGEST {
                    let answers = robot.answers();
                    robot.tick(set_point(&datagram).filter(|point| answers.contains(&point.answers)).as_ref());
                    passed += 1;
                }
            }
        }
        let _sent = robot.outbox();
        let state = robot.state();
        let numbers = state.q.iter().chain(&state.dq).chain(&state.q_d).chain(&state.O_T_EE).chain(&state.tau_J);
        assert!(numbers.map(|number| number.get()).all(f32::is_finite), "the state is no numbers any more");
    }
    robot.tally().motions
}

/// The messages that are whole with these bytes.
fn arrived(inbox: &mut Inbox, bytes: &[u8]) -> Result<Vec<Message>, InvalidLength> {
    inbox.put(bytes);
    let mut messages = Vec::new();
    while let Some(message) = inbox.next()? {
        messages.push(message);
    }
    Ok(messages)
}

fn take(rest: &mut &[u8], count: usize) -> Vec<u8> {
    let (taken, after) = rest.split_at(count.min(rest.len()));
    *rest = after;
    taken.to_vec()
}

/// Well-formed inputs for [`arm`]: every request alone, and a motion in each of its modes.
pub fn arm_seeds() -> Vec<Vec<u8>> {
    let over_tcp = |message: &[u8]| -> Vec<u8> {
        message.chunks(63).flat_map(|part| [&[4 * part.len() as u8][..], part].concat()).collect()
    };
    let asked = |number: u32, length: usize| {
        let payload: Vec<u8> =
            (0..length / 8).flat_map(|_| 10.0_f64.to_le_bytes()).chain([0; 8]).take(length).collect();
        over_tcp(&super::wire::reply(number, 7, &payload))
    };
    // Lengths of the requests' payloads, by number.
    let mut seeds: Vec<Vec<u8>> =
        (0..13_u32).flat_map(|n| [0, 4, 7, 48, 56, 104, 128, 416].map(|length| asked(n, length))).collect();
    for (controller, generator) in [(0_u32, 0_u32), (0, 1), (1, 2), (1, 3), (2, 4)] {
        let mut motion = [controller.to_le_bytes(), generator.to_le_bytes()].concat();
        motion.extend([10.0, 3.12, TAU, 10.0, 3.12, TAU].iter().flat_map(|v| v.to_le_bytes()));
        motion.extend([0; 57]); // no planned targets, and their speeds
        let begin = over_tcp(&super::wire::reply(1, 7, &motion));
        let set_point = [&[2][..], &[0; SET_POINT]].concat();
        seeds.push([begin, vec![4 * 3 + 3], set_point.repeat(3), vec![4 * 40 + 3]].concat());
    }
    seeds
}

/// Plays bytes to the served hand, a piece a cycle of 20 ms: each begins with its length.
pub fn hand(input: &[u8]) {
    let (mut fingers, mut inbox) = (Fingers::new(FRANKA_HAND), Inbox::of_the_hand());
    let mut rest = input;
    while let Some((&length, after)) = rest.split_first() {
        rest = after;
        let Ok(messages) = arrived(&mut inbox, &take(&mut rest, length.into())) else { return };
        for message in messages {
            match hand_wire::request(message.number, &message.payload) {
                Some(hand_wire::Request::Act(action)) => {
                    let _impossible = fingers.begin(action);
                }
                Some(hand_wire::Request::Stop) => {
                    let _moved = fingers.stop();
                }
                Some(hand_wire::Request::Connect { .. }) | None => {}
            }
        }
        let _ended = fingers.step(0.02);
        assert!((0.0..=fingers.widest()).contains(&fingers.width()), "fingers at {} m", fingers.width());
    }
}

/// Well-formed inputs for [`hand`]: every request.
pub fn hand_seeds() -> Vec<Vec<u8>> {
    let layout = franka::wire::HeaderLayout::Gripper;
    let asked = |number: u32, length: usize| {
        let payload: Vec<u8> =
            (0..length / 8).flat_map(|_| 0.03_f64.to_le_bytes()).chain([3; 8]).take(length).collect();
        let message = [layout.encode_header(number, 7, length), payload].concat();
        [&[message.len() as u8][..], &message, &[0; 9]].concat()
    };
    (0..6).flat_map(|number| [0, 4, 16, 32].map(|length| asked(number, length))).collect()
}

#[cfg(test)]
mod tests {
    /// Seeds, and each of them cut and with a changed byte: a look at what the fuzz targets go through for hours.
    #[test]
    fn damaged_conversations_leave_the_arm_and_the_hand_in_order() {
        let mut motions = 0;
        for (i, seed) in super::arm_seeds().into_iter().enumerate() {
            motions += super::arm(&seed);
            let (cut, changed) = damaged(&seed, i);
            super::arm(&cut);
            super::arm(&changed);
        }
        assert_eq!(motions, 5, "each of the motions among the seeds starts");
        for (i, seed) in super::hand_seeds().into_iter().enumerate() {
            super::hand(&seed);
            let (cut, changed) = damaged(&seed, i);
            super::hand(&cut);
            super::hand(&changed);
        }
    }

    fn damaged(seed: &[u8], i: usize) -> (Vec<u8>, Vec<u8>) {
        let mut changed = seed.to_vec();
        changed[i * 131 % seed.len()] ^= 0xFF;
        (seed[..seed.len() * 2 / 3].to_vec(), changed)
    }
}
