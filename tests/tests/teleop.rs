//! `twin teleop` as a person at a page meets it, through a WebSocket: steered, recorded, exported, and what goes wrong.
#![allow(missing_docs)]

use rustix::process::Signal;
use serde_json::{Value, json};
use shared_mem::recording::read_episode;
use std::net::TcpStream;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tests::Program;
use tests::teleop::{Page, Teleop, numbers, task};
use tungstenite::Message;

/// Steers the tool to a place [m], and no faster than `share` of the fastest; `false` where the episode ended on the way.
fn steer(page: &mut Page, tool: usize, place: [f64; 3], share: f64) -> bool {
    for _ in 0..1500 {
        let state = page.state();
        if state["open"] == false {
            return false;
        }
        let at = numbers(&state["bodies"][tool]);
        let off: Vec<f64> = place.iter().zip(&at).map(|(a, b)| a - b).collect();
        if off.iter().all(|off| off.abs() < 3e-3) {
            page.send(json!({ "jog": {} }));
            return true;
        }
        let along: Vec<f64> = off.iter().map(|off| (8.0 * off).clamp(-share, share)).collect();
        page.send(json!({ "jog": { "along": along } }));
    }
    panic!("it does not get to {place:?}");
}

/// Pushes the milk box into the groove: behind it, then along, then into the end.
fn push_milk(page: &mut Page) -> Value {
    page.send(json!({ "episode": "start" }));
    let state = page.wait("it begins", |state| state["open"] == true);
    let milk = numbers(&state["bodies"][2]);
    let seed = state["seed"].clone();
    let z = numbers(&state["bodies"][3])[2];
    let _on_the_way = steer(page, 3, [milk[0] - 0.06, milk[1], z], 0.6)
        && steer(page, 3, [0.5, 0.0, z], 0.5)
        && steer(page, 3, [0.655, 0.0, z], 0.4);
    page.wait("it ends", |state| state["open"] == false && state["seed"] != seed)
}

#[test]
fn an_episode_is_steered_to_success_recorded_and_exported() {
    let folder = tempfile::tempdir().expect("a folder");
    let clips = folder.path().join("milk");
    let file = task("push_milk.toml");
    let teleop = Teleop::start(&["--task", &file, "--record", clips.to_str().expect("a path"), "--duration", "30"]);
    let mut page = teleop.page();
    assert_eq!(page.said("role"), "steers");
    let hello = page.said("hello");
    assert_eq!(hello["bodies"], json!(["table", "groove", "milk", "tool"]));
    let state = push_milk(&mut page);
    assert_eq!((&state["kept"], &state["successes"]), (&json!(1), &json!(1)), "{state}");
    let clip = clips.join("episode_000000.mcap");
    let episode = read_episode(&clip).expect("a clip");
    assert!(episode.info.success && episode.moments.len() > 200, "{:?}", episode.info);
    // A second one is discarded, a third kept though it is no success.
    page.send(json!({ "episode": "start" }));
    page.wait("it begins", |state| state["open"] == true && state["time_s"].as_f64() > Some(0.1));
    page.send(json!({ "episode": "discard" }));
    page.wait("it is discarded", |state| state["discarded"] == 1);
    page.send(json!({ "episode": "start" }));
    page.wait("it begins", |state| state["open"] == true && state["time_s"].as_f64() > Some(0.1));
    page.send(json!({ "episode": "keep" }));
    page.wait("it is kept", |state| state["kept"] == 2);
    let (ended, answer) = teleop.end(Signal::INT);
    assert!(ended, "{answer}");
    assert_eq!(
        (&answer["kept"], &answer["successes"], &answer["discarded"]),
        (&json!(2), &json!(1), &json!(1)),
        "{answer}"
    );
    let out = folder.path().join("data");
    let arguments = ["export-episodes", &file, clips.to_str().expect("a path"), "--to", "lerobot", "--out"];
    let arguments: Vec<&str> = arguments.into_iter().chain([out.to_str().expect("a path"), "--json"]).collect();
    let exported = Program::start("calibration", "teleop-export", &arguments).wait(Duration::from_secs(120));
    assert!(exported.status.success(), "{}", exported.stderr);
    assert!(out.join("meta/info.json").is_file());
}

#[test]
fn an_input_is_in_the_picture_soon_and_a_jog_that_is_not_repeated_ends() {
    let teleop = Teleop::start(&["--task", &task("pick_carrot.toml")]);
    let mut page = teleop.page();
    page.send(json!({ "episode": "start" }));
    page.wait("it begins", |state| state["open"] == true);
    let mut delays = Vec::new();
    for k in 0..200 {
        let sent = Instant::now();
        let way = if k % 20 < 10 { 0.4 } else { -0.4 };
        let id = page.send(json!({ "jog": { "along": [0.0, way, 0.0] } }));
        page.wait("it is shown", |state| state["id"].as_u64() >= Some(id));
        delays.push(1e3 * sent.elapsed().as_secs_f64());
        std::thread::sleep(Duration::from_millis(7 * (k % 5)));
    }
    delays.sort_by(f64::total_cmp);
    let (median, most) = (delays[100], delays[190]);
    eprintln!("input to picture: {median:.1} ms, 95 % within {most:.1} ms, at most {:.1} ms", delays[199]);
    assert!(most < 250.0, "95 % of inputs are shown within {most} ms");
    // Nothing is sent any more, as by a page that hangs.
    std::thread::sleep(Duration::from_millis(900));
    let then = page.wait("a picture of now", |state| state["time_s"].as_f64() > Some(0.0));
    let from = (0..20).map(|_| page.state()).last().expect("pictures");
    let after = (0..20).map(|_| page.state()).last().expect("pictures");
    assert!(then["open"] == true, "{then}");
    let moved = numbers(&from["flange"]).iter().zip(numbers(&after["flange"])).map(|(a, b)| (a - b).abs()).sum::<f64>();
    assert!(moved < 1e-6, "it moves on by {moved} m");
    teleop.end(Signal::INT);
}

#[test]
fn a_second_page_watches_until_the_first_goes_and_nonsense_is_answered_in_a_line() {
    let teleop = Teleop::start(&["--task", &task("push_milk.toml")]);
    let mut first = teleop.page();
    assert_eq!(first.said("role"), "steers");
    let mut second = teleop.page();
    assert_eq!(second.said("role"), "watches");
    second.send(json!({ "episode": "start" }));
    assert!(second.said("error").as_str().is_some_and(|line| line.contains("another one steers")));
    assert_eq!(first.state()["open"], false);
    for nonsense in ["jog", "{\"fly\": 1}", "\u{0}", "{\"jog\": {\"along\": [1e999, 0, 0]}}"] {
        first.texts.clear();
        first.socket.send(Message::text(nonsense)).expect("it listens");
        let line = first.said("error");
        assert!(
            line.as_str().is_some_and(|line| line.starts_with("not a message") && line.lines().count() == 1),
            "{line}"
        );
    }
    first.texts.clear();
    first.socket.send(Message::binary(vec![1, 2, 3])).expect("it listens");
    assert!(first.said("error").as_str().is_some_and(|line| line.contains("binary")));
    first.send(json!({ "episode": "start" }));
    first.wait("it goes on", |state| state["open"] == true);
    drop(first);
    second.texts.clear();
    assert_eq!(second.said("role"), "steers");
    second.send(json!({ "episode": "discard" }));
    second.wait("it steers now", |state| state["discarded"] == 1);
    teleop.end(Signal::INT);
}

#[test]
fn killed_at_once_it_keeps_every_episode_that_was_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let clips = folder.path().to_str().expect("a path").to_owned();
    let teleop = Teleop::start(&["--task", &task("push_milk.toml"), "--record", &clips]);
    let mut page = teleop.page();
    for kept in 1..=2 {
        page.send(json!({ "episode": "start" }));
        page.wait("it begins", |state| state["open"] == true && state["time_s"].as_f64() > Some(0.2));
        page.send(json!({ "episode": "keep" }));
        page.wait("it is kept", |state| state["kept"] == kept);
    }
    page.send(json!({ "episode": "start" }));
    page.wait("it begins", |state| state["open"] == true && state["time_s"].as_f64() > Some(0.2));
    let (ended, _) = teleop.end(Signal::KILL);
    assert!(!ended);
    let there = |name: &str| -> PathBuf { folder.path().join(name) };
    for name in ["episode_000000.mcap", "episode_000001.mcap"] {
        read_episode(&there(name)).expect("a whole clip");
    }
    assert!(!there("episode_000002.mcap").exists());
    // Begun again, it goes on with the next.
    let again = Teleop::start(&["--task", &task("push_milk.toml"), "--record", &clips]);
    let mut page = again.page();
    assert_eq!(page.state()["seed"], 2);
    page.send(json!({ "episode": "start" }));
    page.wait("it begins", |state| state["open"] == true && state["time_s"].as_f64() > Some(0.1));
    let (ended, answer) = again.end(Signal::INT);
    let told = ["kept", "discarded", "cut_short"].map(|key| answer[key].as_u64());
    assert_eq!((ended, told), (true, [Some(0), Some(1), Some(2)]), "{answer}");
}

#[test]
fn what_cannot_begin_is_said_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(task("push_milk.toml")).expect("a task");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("room");
        path.display().to_string()
    };
    let (begin, end) = (text.find("[arm]").expect("an arm"), text.find("[[camera]]").expect("a camera"));
    let no_arm = write("no_arm.toml", &format!("{}{}", &text[..begin], &text[end..]));
    let broken = write("broken.toml", &text.replace("horizon = 8.0", "horizont = 8.0"));
    let taken = Teleop::start(&["--task", &task("push_milk.toml")]);
    let port = taken.port.to_string();
    let milk = task("push_milk.toml");
    for (arguments, what) in [
        (vec!["--task", no_arm.as_str()], "[arm]"),
        (vec!["--task", broken.as_str()], "horizont"),
        (vec!["--task", "nowhere.toml"], "nowhere.toml"),
        (vec!["--task", milk.as_str(), "--port", port.as_str()], "--port"),
        (vec!["--task", milk.as_str(), "--camera", "rear"], "front"),
    ] {
        let all: Vec<&str> = ["teleop"].into_iter().chain(arguments).collect();
        let finished = Program::start("twin", "teleop-wrong", &all).wait(Duration::from_secs(20));
        assert_eq!(finished.status.code(), Some(1), "{}", finished.stderr);
        assert!(
            finished.stderr.contains(what) && finished.stderr.trim_end().lines().count() == 1,
            "{}",
            finished.stderr
        );
    }
    let refused = tungstenite::client(
        tungstenite::http::Request::builder()
            .uri(format!("ws://127.0.0.1:{port}/ws"))
            .header("Host", format!("127.0.0.1:{port}"))
            .header("Origin", "http://example.org")
            .header("Connection", "Upgrade")
            .header("Upgrade", "websocket")
            .header("Sec-WebSocket-Version", "13")
            .header("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==")
            .body(())
            .expect("a request"),
        TcpStream::connect(("127.0.0.1", taken.port)).expect("it listens"),
    );
    assert!(refused.is_err(), "another site's page may not steer");
    taken.end(Signal::INT);
}
