//! Timing against named peers, in turn within one run: the control loop's wake-up against cyclictest, the age of a state
//! against a bare ping over the same transport. Prints figures; the only thing it asserts is that there are any.

use serde_json::Value;
use std::process::Command;
use std::time::Duration;
use tests::{Cell, Program};

const ROUNDS: u32 = 3;
const SECONDS: u32 = 20;

/// 99.9th percentile of cyclictest's latency [us]: 1 ms interval, FIFO priority like the control thread's.
fn cyclictest_p999() -> f64 {
    let output = Command::new("cyclictest")
        .args(["-m", "-q", "-t1", "-p80", "-i1000", "-h5000", "-D"])
        .arg(format!("{SECONDS}s"))
        .output()
        .expect("cyclictest; install Debian's rt-tests");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let histogram: Vec<(u64, u64)> = text
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
        .filter_map(|l| {
            let mut columns = l.split_whitespace();
            Some((columns.next()?.parse().ok()?, columns.next()?.parse().ok()?))
        })
        .collect();
    let total: u64 = histogram.iter().map(|(_, n)| n).sum();
    assert!(
        total > 0,
        "cyclictest measured nothing (it needs root):\n{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let mut below = 0;
    for (latency, count) in histogram {
        below += count;
        if below as f64 >= 0.999 * total as f64 {
            return latency as f64;
        }
    }
    f64::NAN
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn bridge_and_twin() -> (Value, Value) {
    let cell = Cell::shipped();
    let bridge = cell.start_bridge(&["--duration", &(SECONDS + 2).to_string()]);
    let twin = cell.start("twin", &["shadow", "--cell", "{cell}", "--duration", &SECONDS.to_string(), "--json"]);
    let twin = twin.wait(Duration::from_secs(60)).succeeded().json();
    (bridge.wait(Duration::from_secs(60)).succeeded().json(), twin)
}

fn bare_ping() -> Value {
    let cell = Cell::shipped();
    let receiver = Program::start("ping", cell.domain(), &["receive", &SECONDS.to_string()]);
    let _sender = Program::start("ping", cell.domain(), &["send", &(SECONDS + 1).to_string()]);
    receiver.wait(Duration::from_secs(u64::from(SECONDS) + 10)).succeeded().json()
}

#[test]
#[ignore = "two minutes on an idle machine, as root, with rt-tests installed: cargo test --release --workspace --test real_time -- --ignored --nocapture"]
fn the_control_loop_wakes_like_cyclictest_and_states_are_as_fresh_as_a_ping() {
    let (mut wakes, mut peers, mut ages, mut pings) = (vec![], vec![], vec![], vec![]);
    for round in 0..ROUNDS {
        let peer = cyclictest_p999();
        let (bridge, twin) = bridge_and_twin();
        let ping = bare_ping();
        let wake = bridge["wake_us"]["p999"].as_f64().expect("wake_us.p999");
        let (age, pinged) = (twin["age_us"]["p99"].as_f64().expect("age_us.p99"), ping["p99"].as_f64().expect("p99"));
        eprintln!(
            "round {round}: wake-up p99.9 {wake:.1} us, cyclictest {peer:.1} us; age p99 {age:.1} us, bare ping {pinged:.1} us"
        );
        eprintln!("  bridge {bridge}\n  twin {twin}\n  ping {ping}");
        wakes.push(wake);
        peers.push(peer);
        ages.push(age);
        pings.push(pinged);
    }
    let (wake, peer, age, ping) = (median(wakes), median(peers), median(ages), median(pings));
    eprintln!(
        "medians: wake-up {wake:.1} / {peer:.1} us = {:.2}; age {age:.1} / {ping:.1} us = {:.2}",
        wake / peer,
        age / ping
    );
    assert!(wake > 0.0 && age > 0.0);
}
