//! The whole story in one command, as the README's first line promises it.

use std::time::Duration;
use tests::Cell;

#[test]
fn the_demo_records_diagnoses_and_replays_a_session() {
    let cell = Cell::shipped();
    let demo = cell.start("calibration", &["demo", "--out", &cell.text("demo"), "--json"]);
    let finished = demo.wait(Duration::from_secs(480)).succeeded();
    let answer = finished.json();
    let report = std::fs::read_to_string(cell.path("demo/report.html")).expect("a report");
    assert!(report.contains("<svg"), "the report holds no picture");
    assert!(!report.contains("http://") || report.contains("http://www.w3.org"), "the report reaches for the network");
    let hidden = std::fs::read_to_string(cell.path("demo/hidden_effect.toml")).expect("the hidden effect");
    let named = answer["verdict"]["effects"].as_array().expect("effects");
    assert!(named.iter().any(|name| hidden.contains(name.as_str().expect("a name"))), "{hidden} {answer}");
    assert!(std::fs::read_to_string(cell.path("demo/diagnosis.html")).expect("a page").contains("<svg"));
    let clips: Vec<_> = std::fs::read_dir(cell.path("demo/session"))
        .expect("a session")
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "mcap"))
        .collect();
    assert!(!clips.is_empty(), "no clip was recorded");
    let replay = cell.start("twin", &["replay", &cell.text("demo/session"), "--json"]);
    let replayed = replay.wait(Duration::from_secs(60)).succeeded().json();
    assert_eq!(replayed["clips"].as_array().map(Vec::len), Some(clips.len()), "{replayed}");
}
