//! Timing against a named peer, in turn within one run: the age of a state against a bare ping over the same transport. Prints
//! figures; the only thing it asserts is that there are any.

use serde_json::Value;
use std::time::Duration;
use tests::{Cell, Program};

const ROUNDS: u32 = 3;
const SECONDS: u32 = 20;

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
#[ignore = "two minutes on an idle machine: cargo test --release --workspace --test real_time -- --ignored --nocapture"]
fn states_are_as_fresh_as_a_ping() {
    let (mut ages, mut pings) = (vec![], vec![]);
    for round in 0..ROUNDS {
        let (bridge, twin) = bridge_and_twin();
        let ping = bare_ping();
        let (age, pinged) = (twin["age_us"]["p99"].as_f64().expect("age_us.p99"), ping["p99"].as_f64().expect("p99"));
        eprintln!("round {round}: age p99 {age:.1} us, bare ping {pinged:.1} us");
        eprintln!("  bridge {bridge}\n  twin {twin}\n  ping {ping}");
        ages.push(age);
        pings.push(pinged);
    }
    let (age, ping) = (median(ages), median(pings));
    eprintln!("medians: age {age:.1} / {ping:.1} us = {:.2}", age / ping);
    assert!(age > 0.0);
}

/// The long run is `soak --minutes 60`; here only that it watches everything that it says it does.
#[test]
fn a_cell_that_runs_beside_other_work_is_watched() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = folder.path().join("memory.csv");
    let arguments = ["--minutes", "0.1", "--load", "none", "--table", table.to_str().expect("a UTF-8 path")];
    // Whether a busy machine keeps time is no matter of this test, so it may fail by its own measure.
    let answer = Program::start("soak", "soak", &arguments).wait(Duration::from_secs(120)).json();
    for cell in ["simulated", "served"] {
        let watched = &answer["cells"][cell];
        assert!(watched["states"].as_u64() > Some(1000) && watched["clip"]["states"].as_u64() > Some(1000), "{answer}");
        assert!(watched["worst_ratio"]["command: workspace"].as_f64() > Some(0.0), "{answer}");
        assert!(watched["programs"]["bridge"]["cycles"].as_u64() > Some(1000), "{answer}");
        assert!(answer["memory"][format!("{cell}: recorder")]["last_mib"].as_f64() > Some(1.0), "{answer}");
    }
    let rows = std::fs::read_to_string(&table).expect("the table");
    assert!(rows.lines().any(|row| row.contains("simulated: twin")), "{rows}");
}
