//! The live flow: a twin in its own process mirrors the bridge, attaches at any time and outlives the other's restart.

use std::time::Duration;
use tests::Cell;

fn joint_rms(answer: &serde_json::Value) -> Vec<f64> {
    answer["gap"]["joint_rms_rad"]
        .as_array()
        .expect("joint_rms_rad")
        .iter()
        .map(|v| v.as_f64().expect("a number"))
        .collect()
}

#[test]
fn a_twin_of_the_same_cell_mirrors_it_closely() {
    let cell = Cell::shipped();
    let bridge = cell.start_bridge(&["--duration", "6"]);
    let twin = cell.start("twin", &["shadow", "--cell", "{cell}", "--duration", "3", "--json"]);
    let answer = twin.wait(Duration::from_secs(20)).succeeded().json();
    let rms = joint_rms(&answer);
    assert_eq!(rms.len(), 7, "{answer}");
    assert!(rms.iter().all(|r| *r < 1e-3), "a twin with the same parameters strays: {answer}");
    assert!(answer["cycles"].as_u64() > Some(500), "{answer}");
    assert!(answer["gap"]["object_add_m"].as_f64() < Some(0.005), "{answer}");
    let answer = bridge.wait(Duration::from_secs(20)).succeeded().json();
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{answer}");
}

#[test]
fn a_twin_waits_for_its_bridge_and_outlives_it() {
    let cell = Cell::shipped();
    let twin = cell.start("twin", &["shadow", "--cell", "{cell}", "--json"]);
    std::thread::sleep(Duration::from_millis(500));
    let first = cell.start_bridge(&["--duration", "2"]).wait(Duration::from_secs(20)).succeeded().json();
    let mut second = cell.start_bridge(&[]);
    std::thread::sleep(Duration::from_secs(2));
    second.kill_without_warning();
    let third = cell.start_bridge(&[]);
    std::thread::sleep(Duration::from_secs(2));
    let twin = twin.interrupt().succeeded();
    let third = third.interrupt().succeeded().json();
    // However slow this machine is just now: more than either of them had.
    let [mirrored, first, third] =
        [&twin.json(), &first, &third].map(|answer| answer["cycles"].as_u64().expect("a count"));
    assert!(mirrored > 3 * (first + third) / 4, "{mirrored} of {first}, some, {third}:\n{}", twin.stderr);
}

#[test]
fn two_bridges_at_once_are_refused_and_the_first_goes_on() {
    let cell = Cell::shipped();
    let first = cell.start_bridge(&["--duration", "4"]);
    let second = cell.start("rt_bridge", &["run", "--cell", "{cell}", "--arm", "sim", "--realtime", "ignore"]);
    let second = second.wait(Duration::from_secs(10));
    assert!(second.complaint().contains("another rt_bridge is running"), "{}", second.complaint());
    let answer = first.wait(Duration::from_secs(20)).succeeded().json();
    assert!(answer["cycles"].as_u64() > Some(1000), "{answer}");
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{answer}");
}
