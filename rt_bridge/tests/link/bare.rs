//! The peers of `rt_bridge link`: zenoh alone, with the same bytes and the same settings of the network, nothing before and nothing
//! behind; and a stranger who speaks the link's language.
//!
//! They run in processes of their own: this test's program, started again with [`ROLE`] set.

use link::ages::Ages;
use link::envelope::Envelope;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::{ImageHeader, PixelEncoding};
use shared_mem::msg::target::ArmTarget;
use shared_mem::recording::{Encoded, append_picture, schema_checksum};
use shared_mem::time::now_ns;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Sample;
use zenoh::{Config, Session, Wait};

/// Environment variable that makes this program a peer.
pub(crate) const ROLE: &str = "TWINALIGN_TEST_PEER";

const STATES: &str = "bare/states";
const DEPTH: &str = "bare/depth";

fn open(mode: &str, side: &str, endpoint: &str) -> Session {
    let text = format!(
        "{{ mode: \"{mode}\", {side}: {{ endpoints: [\"{endpoint}\"] }}, \
         scouting: {{ multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }} }}"
    );
    let begin = Instant::now();
    loop {
        match zenoh::open(Config::from_json5(&text).expect("settings")).wait() {
            Ok(session) => return session,
            Err(e) => assert!(begin.elapsed() < Duration::from_secs(20), "{endpoint}: {e}"),
        }
        std::thread::sleep(Duration::from_millis(200));
    }
}

fn publisher(session: &Session, key: &'static str, priority: Priority) -> Publisher<'static> {
    let publisher = session.declare_publisher(key).congestion_control(CongestionControl::Block);
    publisher.priority(priority).express(true).wait().expect("a publisher")
}

/// Puts `make()` every `period` for so long, its time beside it.
fn put(publisher: &Publisher<'_>, seconds: f64, period: Duration, make: impl Fn() -> Vec<u8>) {
    let begin = Instant::now();
    let mut due = Duration::ZERO;
    while begin.elapsed().as_secs_f64() < seconds {
        let stamp = now_ns();
        publisher.put(make()).attachment(stamp.to_le_bytes().to_vec()).wait().expect("put");
        due += period;
        std::thread::sleep(due.saturating_sub(begin.elapsed()));
    }
}

fn state() -> Vec<u8> {
    let mut bytes = Vec::with_capacity(1024);
    let state = ArmState { stamp_ns: now_ns(), dof: 7, q: [0.5; 8], tau_J: [1.5; 8], ..ArmState::default() };
    state.append_to(&mut bytes);
    bytes
}

fn depth(pixels: &[u8]) -> Vec<u8> {
    let header = ImageHeader {
        stamp_ns: now_ns(),
        width: 640,
        height: 480,
        stride: 1280,
        encoding: PixelEncoding::Depth16,
        depth_scale: 1e-3,
        ..ImageHeader::default()
    };
    let mut bytes = Vec::with_capacity(pixels.len() + 256);
    append_picture(&header, pixels, &mut bytes);
    bytes
}

/// Listens, puts an arm state each millisecond and a depth picture thirty times a second.
fn send(seconds: f64, endpoint: &str) {
    let session = open("peer", "listen", endpoint);
    let states = publisher(&session, STATES, Priority::InteractiveHigh);
    let pictures = publisher(&session, DEPTH, Priority::DataLow);
    let pixels = vec![7; 640 * 480 * 2];
    std::thread::scope(|scope| {
        scope.spawn(|| put(&pictures, seconds, Duration::from_micros(33_333), || depth(&pixels)));
        scope.spawn(|| put(&states, seconds, Duration::from_millis(1), state));
    });
}

/// Connects, and answers with the ages from before the put to the subscriber.
fn receive(seconds: f64, endpoint: &str) {
    let session = open("client", "connect", endpoint);
    let ages = [STATES, DEPTH].map(|key| {
        let ages = Arc::new(Mutex::new((Ages::new(), 0_u64)));
        let filled = Arc::clone(&ages);
        let hear = move |sample: Sample| {
            let stamp = sample.attachment().and_then(|a| <[u8; 8]>::try_from(a.to_bytes().as_ref()).ok());
            let age = now_ns().saturating_sub(stamp.map_or(0, u64::from_le_bytes));
            let mut filled = filled.lock().expect("ages");
            filled.0.record(age);
            filled.1 += 1;
        };
        (session.declare_subscriber(key).callback(hear).wait().expect("a subscriber"), ages)
    });
    std::thread::sleep(Duration::from_secs_f64(seconds));
    let [states, depth] = ages.map(|(_, ages)| {
        let ages = ages.lock().expect("ages");
        serde_json::json!({ "count": ages.1, "age_us": ages.0.percentiles() })
    });
    println!("{}{}", super::hosts::ANSWER, serde_json::json!({ "states": states, "depth": depth }));
}

/// Connects to a link and puts, under its keys and in its form, targets for the arm and states of an arm that nobody has.
fn intrude(seconds: f64, endpoint: &str) {
    let session = open("client", "connect", endpoint);
    let line =
        |topic: &str| session.declare_publisher(format!("twinalign/link/messages{topic}")).wait().expect("a publisher");
    let [target, state] = ["/arm/target", "/arm/state"].map(line);
    let begin = Instant::now();
    for number in 0.. {
        if begin.elapsed().as_secs_f64() >= seconds {
            break;
        }
        let envelope = |schema| {
            let beside =
                Envelope { session: 666, number, oldest: 0, taken_ns: now_ns(), schema: schema_checksum(schema) };
            ZBytes::from(beside.to_bytes())
        };
        let (mut order, mut lie) = (Vec::new(), Vec::new());
        ArmTarget { stamp_ns: now_ns(), stream: 666, dof: 7, ..ArmTarget::default() }.append_to(&mut order);
        ArmState { stamp_ns: now_ns(), session: 666, cycle: number, dof: 7, ..ArmState::default() }.append_to(&mut lie);
        target.put(order).attachment(envelope(ArmTarget::schema())).wait().expect("put");
        state.put(lie).attachment(envelope(ArmState::schema())).wait().expect("put");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Plays the part that [`ROLE`] names: `send`, `receive` or `intrude`, with seconds and address behind it.
pub(crate) fn play(role: &str) {
    let words: Vec<&str> = role.split(' ').collect();
    let [verb, seconds, endpoint] = words[..] else { panic!("{role}") };
    let seconds = seconds.parse().expect("seconds");
    match verb {
        "send" => send(seconds, endpoint),
        "receive" => receive(seconds, endpoint),
        "intrude" => intrude(seconds, endpoint),
        _ => panic!("{role}"),
    }
}
