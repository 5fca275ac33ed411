//! The capture flow with an object: strokes planned from tracked poses, played by the bridge, recorded, and read back.

use std::time::Duration;
use tests::Cell;

#[test]
fn strokes_are_captured_kept_and_replayed_by_the_twin() {
    let cell = Cell::shipped();
    let preview = [
        "capture",
        "control-hit-slide",
        "--cell",
        "{cell}",
        "--clips",
        "1",
        "--out",
        &cell.text("session"),
        "--realtime",
        "ignore",
        "--preview",
        &cell.text("next.svg"),
    ];
    let _planned = cell.start("calibration", &preview).wait(Duration::from_secs(60)).succeeded();
    let picture = std::fs::read_to_string(cell.path("next.svg")).expect("a picture");
    assert!(picture.contains("m/s"), "{picture}");
    let mut strokes = preview[..10].to_vec();
    strokes[5] = "2";
    strokes.push("--json");
    let answer = cell.start("calibration", &strokes).wait(Duration::from_secs(240)).succeeded().json();
    let clips = answer["clips"].as_array().expect("clips");
    let kept: Vec<_> = clips.iter().filter(|clip| clip["kept"] == true).collect();
    assert_eq!(kept.len(), 2, "{answer}");
    assert!(kept.iter().all(|clip| clip["moved"].as_f64() > Some(0.02)), "an object was hardly touched: {answer}");
    let replayed = cell.start("twin", &["replay", &cell.text("session"), "--json"]);
    let replayed = replayed.wait(Duration::from_secs(120)).succeeded().json();
    let add: Vec<f64> =
        replayed["clips"].as_array().expect("clips").iter().filter_map(|clip| clip["object_add_m"].as_f64()).collect();
    assert_eq!(add.len(), 2, "{replayed}");
    assert!(add.iter().all(|add| *add < 0.01), "the twin of the same cell strays: {replayed}");
    // The same stroke again, in the same place: the simulated cell is started anew with the object there.
    let mut again = strokes[..4].to_vec();
    again.extend(strokes[6..10].iter().chain(&["--arm", "sim", "--repeat", "0", "--speed", "0.8", "--json"]));
    let answer = cell.start("calibration", &again).wait(Duration::from_secs(120)).succeeded().json();
    let clip = &answer["clips"][0];
    assert_eq!(
        (clip["kept"].as_bool(), clip["motion"].as_str()),
        (Some(true), Some("clip 0 again at 0.8 times the speed"))
    );
    let before = kept.iter().find(|clip| clip["file"] == "clip_00.mcap").expect("the first stroke");
    let share = clip["speed"].as_f64().expect("a speed") / before["speed"].as_f64().expect("a speed");
    assert!((share - 0.8).abs() < 0.01 && clip["moved"].as_f64() > Some(0.01), "{answer}");
}
