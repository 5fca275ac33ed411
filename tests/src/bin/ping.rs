//! The bare peer of the bridge's state stream: one process sends an arm state each millisecond, the other measures its age.
//!
//! `ping send SECONDS` or `ping receive SECONDS`; the receiver prints one JSON object with percentiles in microseconds.
#![allow(clippy::print_stdout)] // its answer

use shared_mem::msg::arm::ArmState;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::Node;
use std::time::{Duration, Instant};

fn send(seconds: f64) {
    let node = Node::open("ping").expect("shared memory");
    let publisher = node.publisher(topics::ARM_STATE).expect("a publisher");
    let start = Instant::now();
    let mut cycle = 0;
    while start.elapsed().as_secs_f64() < seconds {
        publisher.send(&ArmState { stamp_ns: now_ns(), cycle, ..ArmState::default() }).expect("a state sent");
        cycle += 1;
        std::thread::sleep(Duration::from_millis(cycle).saturating_sub(start.elapsed()));
    }
}

fn receive(seconds: f64) {
    let node = Node::open("pong").expect("shared memory");
    let states = node.subscriber(topics::ARM_STATE).expect("a place to read");
    let wake = node.wake_on(topics::ARM_STATE.name).expect("a bell");
    let mut ages_us = Vec::with_capacity(200_000);
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds {
        let _rung = wake.wait(Duration::from_millis(100)).expect("a bell");
        while let Some(state) = states.receive().expect("a state") {
            ages_us.push(now_ns().saturating_sub(state.stamp_ns) as f64 * 1e-3);
        }
    }
    ages_us.sort_by(f64::total_cmp);
    let at = |share: f64| ages_us[((ages_us.len() - 1) as f64 * share) as usize];
    println!(r#"{{"count": {}, "p50": {}, "p99": {}, "p999": {}}}"#, ages_us.len(), at(0.5), at(0.99), at(0.999));
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let seconds = arguments.get(2).and_then(|s| s.parse().ok()).expect("ping send|receive SECONDS");
    match arguments[1].as_str() {
        "send" => send(seconds),
        "receive" => receive(seconds),
        other => panic!("ping send|receive SECONDS, not {other}"),
    }
}
