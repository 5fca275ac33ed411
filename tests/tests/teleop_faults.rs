//! The page of `twin teleop` among pages that mean no good or are broken: connections that are reset, pages of other sites, floods
//! of every kind of message, pages that fall silent; and a stop that holds through all of it.
#![allow(missing_docs)]

use rustix::process::Signal;
use serde_json::{Value, json};
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tests::teleop::{LONG, Page, Teleop, numbers, task};
use tungstenite::Message;
use tungstenite::stream::MaybeTlsStream;

/// A request for a WebSocket or a page, with the lines of a header.
fn request(path: &str, lines: &str) -> String {
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let upgrade = if path == "/ws" { upgrade } else { "" };
    format!("GET {path} HTTP/1.1\r\n{upgrade}{lines}\r\n")
}

/// The head of what is answered, in small letters.
fn head(port: u16, request: &str) -> String {
    let mut tcp = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    tcp.set_read_timeout(Some(LONG)).expect("a timeout above zero");
    tcp.write_all(request.as_bytes()).expect("it listens");
    let (mut head, mut byte) = (Vec::new(), [0]);
    while !head.ends_with(b"\r\n\r\n") && tcp.read(&mut byte).expect("an answer") == 1 {
        head.push(byte[0]);
    }
    String::from_utf8_lossy(&head).to_lowercase()
}

/// A page that steers, as soon as one can.
fn steering(teleop: &Teleop) -> Page {
    let begin = Instant::now();
    loop {
        if let Some(mut page) = teleop.try_page()
            && page.said("role") == "steers"
        {
            return page;
        }
        assert!(begin.elapsed() < LONG, "nobody can steer");
    }
}

#[test]
fn connections_that_are_reset_before_they_are_pages_take_no_seat() {
    let teleop = Teleop::start(&["--task", &task("push_milk.toml")]);
    let host = format!("Host: 127.0.0.1:{}\r\n", teleop.port);
    for _ in 0..40 {
        let mut tcp = TcpStream::connect(("127.0.0.1", teleop.port)).expect("it listens");
        tcp.write_all(request("/", &host).as_bytes()).expect("it listens");
        // With an answer in it that nobody has read, a socket is reset when it is closed.
        assert_eq!(tcp.peek(&mut [0]).expect("an answer"), 1);
        tcp.write_all(request("/ws", &host).as_bytes()).expect("it listens");
    }
    let mut page = steering(&teleop);
    page.send(json!({ "episode": "start" }));
    page.wait("it steers", |state| state["open"] == true);
    teleop.end(Signal::INT);
}

#[test]
fn every_answer_says_that_no_other_page_may_frame_it() {
    let teleop = Teleop::start(&["--task", &task("push_milk.toml")]);
    let own = format!("Host: 127.0.0.1:{}\r\n", teleop.port);
    for (path, lines, status) in [
        ("/", own.as_str(), "200"),
        ("/ws", own.as_str(), "101"),
        ("/nowhere", own.as_str(), "404"),
        ("/", "Host: example.org\r\n", "403"),
        ("/ws", "Host: example.org\r\n", "403"),
        ("/nowhere", "Host: example.org\r\n", "403"),
    ] {
        let head = head(teleop.port, &request(path, lines));
        assert!(head.starts_with(&format!("http/1.1 {status} ")), "{path} {lines}: {head}");
        let is_kept_apart = head.contains("\r\ncontent-security-policy: frame-ancestors 'none'\r\n")
            && head.contains("\r\nx-frame-options: deny\r\n");
        assert!(is_kept_apart, "{path} {lines}: {head}");
    }
    teleop.end(Signal::INT);
}

#[test]
fn a_page_that_other_machines_reach_is_opened_by_its_own_names_alone() {
    let arguments = ["--task", &task("push_milk.toml"), "--bind", "0.0.0.0", "--name", "bench.lab.example"];
    let teleop = Teleop::start(&arguments);
    let port = teleop.port;
    for (host, is_admitted) in [
        (format!("127.0.0.1:{port}"), true),
        (format!("localhost:{port}"), true),
        (format!("192.0.2.7:{port}"), true),
        (format!("bench.lab.example:{port}"), true),
        (format!("evil.example:{port}"), false),
        (format!("bench.lab.example.evil.example:{port}"), false),
    ] {
        for path in ["/", "/ws"] {
            let lines = format!("Host: {host}\r\nOrigin: http://{host}\r\n");
            let head = head(port, &request(path, &lines));
            assert_eq!(!head.starts_with("http/1.1 403 "), is_admitted, "{path} of {host}: {head}");
        }
    }
    let two = format!("Host: 127.0.0.1:{port}\r\nHost: evil.example\r\n");
    assert!(head(port, &request("/", &two)).starts_with("http/1.1 4"), "two hosts");
    teleop.end(Signal::INT);
}

/// Sends these over and over, as fast as they are taken, until `enough` or it ends; what comes is read and thrown away.
fn flood(page: Page, messages: &[Message], enough: &AtomicBool) {
    let mut socket = page.socket;
    let MaybeTlsStream::Plain(tcp) = socket.get_ref() else { panic!("a plain connection") };
    let mut read = tcp.try_clone().expect("a socket");
    std::thread::scope(|scope| {
        scope.spawn(move || std::io::copy(&mut read, &mut std::io::sink()));
        let mut listens = true;
        while listens && !enough.load(Ordering::Relaxed) {
            listens = messages.iter().all(|message| socket.write(message.clone()).is_ok()) && socket.flush().is_ok();
        }
        let MaybeTlsStream::Plain(tcp) = socket.get_ref() else { return };
        drop(tcp.shutdown(std::net::Shutdown::Both));
    });
}

fn texts(messages: &[Value]) -> Vec<Message> {
    messages.iter().map(|message| Message::text(message.to_string())).collect()
}

#[test]
fn whatever_a_page_floods_it_with_others_see_and_stop_it_and_nothing_of_it_is_left_over() {
    let (start, keep) = (json!({ "episode": "start" }), json!({ "episode": "keep" }));
    for (what, messages) in [
        ("start and keep", texts(&[start.clone(), keep])),
        ("start and discard", texts(&[start.clone(), json!({ "episode": "discard" })])),
        ("jog", texts(&[start.clone(), json!({ "jog": { "along": [0.1, 0, 0] } })])),
        ("fingers", texts(&[start.clone(), json!({ "fingers": "open" }), json!({ "fingers": "close" })])),
        ("stop", texts(&[start, json!({ "stop": true })])),
        ("what is no message", texts(&[json!({ "fly": 1 })])),
        ("binary", vec![Message::binary(vec![0; 64])]),
        ("pings", vec![Message::Ping(vec![0; 64].into())]),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let clips = folder.path().to_str().expect("a path");
        let teleop = Teleop::start(&["--task", &task("push_milk.toml"), "--record", clips]);
        let mut flooding = teleop.page();
        assert_eq!(flooding.said("role"), "steers");
        let mut other = teleop.page();
        assert_eq!(other.said("role"), "watches");
        let enough = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| flood(flooding, &messages, &enough));
            for _ in 0..10 {
                other.state();
            }
            other.send(json!({ "stop": true }));
            other.wait(what, |state| state["stopped"] == true);
            enough.store(true, Ordering::Relaxed);
        });
        // The page that flooded is gone, and so is what it asked for.
        other.texts.clear();
        assert_eq!(other.said("role"), "steers", "{what}");
        let id = other.send(json!({}));
        other.wait(what, |state| state["id"].as_u64() >= Some(id));
        let counts = |state: Value| [state["kept"].clone(), state["discarded"].clone()];
        let now = counts(other.state());
        let later = counts((0..25).map(|_| other.state()).last().expect("pictures"));
        assert_eq!(now, later, "{what} goes on");
        let (ended, answer) = teleop.end(Signal::INT);
        assert!(ended, "{what}: {answer}");
    }
}

#[test]
fn it_ends_when_it_is_asked_to_while_a_page_floods_it() {
    let messages = texts(&[json!({ "episode": "start" }), json!({ "episode": "keep" })]);
    let teleop = Teleop::start(&["--task", &task("push_milk.toml")]);
    let (flooding, mut other) = (teleop.page(), teleop.page());
    let enough = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| flood(flooding, &messages, &enough));
        other.wait("it floods", |state| state["kept"].as_u64() > Some(3));
        let (ended, answer) = teleop.end(Signal::TERM);
        assert!(ended, "{answer}");
        enough.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_page_that_falls_silent_gives_its_seat_to_the_next() {
    let teleop = Teleop::start(&["--task", &task("push_milk.toml")]);
    // It is open, and neither reads nor answers from here on.
    let silent = teleop.page();
    let mut next = teleop.page();
    assert_eq!(next.said("role"), "watches");
    next.texts.clear();
    assert_eq!(next.said("role"), "steers");
    next.send(json!({ "episode": "start" }));
    next.wait("it steers", |state| state["open"] == true);
    drop(silent);
    teleop.end(Signal::INT);
}

#[test]
fn a_stop_of_any_page_holds_the_arm_until_somebody_starts_again() {
    let teleop = Teleop::start(&["--task", &task("pick_carrot.toml")]);
    let (mut steers, mut watches) = (teleop.page(), teleop.page());
    assert_eq!((steers.said("role"), watches.said("role")), (json!("steers"), json!("watches")));
    let jog = || json!({ "jog": { "along": [0.0, 0.4, 0.0] } });
    steers.send(json!({ "episode": "start" }));
    let begun = steers.wait("it begins", |state| state["open"] == true);
    let away = |state: &Value, from: &Value| {
        let of = |state: &Value| numbers(&state["flange"]);
        of(state).iter().zip(of(from)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let mut going = begun.clone();
    while away(&going, &begun) < 0.01 {
        steers.send(jog());
        going = steers.state();
    }
    watches.send(json!({ "stop": true }));
    let mut before = steers.wait("it is stopped", |state| state["stopped"] == true);
    assert!(before["held_by"].as_str().is_some_and(|why| why.contains("stop")), "{before}");
    let begin = Instant::now();
    loop {
        steers.send(jog());
        // Who watches has to read, else it counts as gone.
        watches.state();
        let now = steers.state();
        if away(&now, &before) < 1e-9 {
            break;
        }
        assert!(begin.elapsed() < LONG, "it does not come to rest: {now}");
        before = now;
    }
    // Keys that are held and fingers move nothing, and the time of the episode goes on.
    let wide = before["width"].clone();
    for _ in 0..40 {
        steers.send(jog());
        let id = steers.send(json!({ "fingers": "close" }));
        watches.state();
        let now = steers.wait("it is heard", |state| state["id"].as_u64() >= Some(id));
        assert!(away(&now, &before) < 1e-6 && now["stopped"] == true, "{now}");
        let closed = wide.as_f64().zip(now["width"].as_f64()).map(|(wide, now)| wide - now);
        assert!(closed.is_some_and(|closed| closed.abs() < 1e-3), "{now}");
    }
    assert!(steers.state()["time_s"].as_f64() > before["time_s"].as_f64());
    // A start that was on its way when somebody stopped does not count, a later one does.
    steers.send(json!({ "stop": true }));
    let id = steers.send(json!({ "episode": "start" }));
    let now = steers.wait("it is heard", |state| state["id"].as_u64() >= Some(id));
    assert_eq!((&now["stopped"], &now["open"]), (&json!(true), &json!(true)), "{now}");
    watches.send(json!({ "episode": "start" }));
    assert!(watches.said("error").as_str().is_some_and(|line| line.contains("another one steers")));
    let begin = Instant::now();
    while steers.state()["stopped"] == true {
        steers.send(json!({ "episode": "start" }));
        assert!(begin.elapsed() < LONG, "it does not go on");
    }
    let begin = Instant::now();
    while away(&steers.state(), &before) < 0.01 {
        steers.send(jog());
        watches.state();
        assert!(begin.elapsed() < LONG, "it does not move again");
    }
    // The numbers of the next page are its own.
    drop(steers);
    watches.wait("its numbers begin anew", |state| state["id"] == 0);
    teleop.end(Signal::INT);
}
