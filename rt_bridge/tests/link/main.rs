//! `rt_bridge link` between two hosts: two network namespaces with a cable between them, and two domains of shared memory.
//!
//! Needs root and `ip`, and takes four minutes:
//! `cargo test --release -p rt_bridge --features link --test link -- --ignored --nocapture --test-threads 1`.
#![allow(clippy::print_stdout)] // the figures

mod bare;
mod hosts;
mod traffic;

use hosts::{Hosts, PORT};
use serde_json::Value;
use shared_mem::topics;
use shared_mem::transport::Node;
use std::time::{Duration, Instant};
use traffic::{Reader, Traffic, percentile};

/// How long states and pictures are sent.
const SECONDS: f64 = 60.0;
/// How long a cable is out.
const OUT: Duration = Duration::from_secs(5);
/// Until fresh states must come again.
const MENDED: Duration = Duration::from_secs(2);

#[test]
#[ignore = "the other tests start it as their peer"]
fn peer() {
    if let Some(role) = std::env::var(bare::ROLE).ok().filter(|role| !role.is_empty()) {
        bare::play(&role);
    }
}

fn p99(answer: &Value) -> f64 {
    answer["age_us"]["p99"].as_f64().unwrap_or_else(|| panic!("no ages: {answer}"))
}

fn topic<'a>(answer: &'a Value, way: &str, topic: &str) -> &'a Value {
    let all = answer[way].as_array().expect("topics");
    all.iter().find(|of| of["topic"] == topic).unwrap_or_else(|| panic!("no {topic} in {answer}"))
}

/// zenoh alone, over the same cable: `[states, depth]`.
fn bare(hosts: &Hosts, seconds: f64) -> Value {
    let endpoint = hosts.robot_endpoint(PORT + 1);
    let sender = hosts.peer_on_robot(&format!("send {} {endpoint}", seconds + 4.0));
    let receiver = hosts.peer_on_far(&format!("receive {seconds} {endpoint}"));
    let answer = receiver.answer(Duration::from_secs_f64(seconds + 30.0));
    drop(sender);
    answer
}

#[test]
#[ignore = "root and four minutes: cargo test --release -p rt_bridge --features link --test link -- --ignored --test-threads 1"]
fn a_minute_of_states_and_depth_crosses_whole_and_nearly_as_fast_as_zenoh_alone() {
    let hosts = Hosts::new("a");
    let before = bare(&hosts, SECONDS / 2.0);
    let listen = hosts.link_on_robot(&["--listen", &hosts.robot_endpoint(PORT)]);
    let connect =
        hosts.link_on_far(&["--connect", &hosts.robot_endpoint(PORT), "--topics", "/arm/state,/camera/depth"]);
    let traffic = Traffic::start(&hosts.robot_domain, true);
    let mut reader = Reader::open(&hosts.far_domain);
    reader.wait_for_first(Duration::from_secs(20));
    let beside = Reader::open(&hosts.robot_domain).read_for(Duration::from_secs_f64(SECONDS));
    let far = reader.read_for(Duration::from_secs_f64(SECONDS));
    let [far, beside] = [far.join().expect("a reader"), beside.join().expect("a reader")];
    let sent = traffic.stop();
    let (there, here) = (listen.interrupted(), connect.interrupted());
    let after = bare(&hosts, SECONDS / 2.0);

    let states = topic(&here, "taken", "/arm/state");
    let depth = topic(&here, "taken", "/camera/depth");
    println!("bare zenoh: {before}\n            {after}\nsent {sent:?}\nthe robot's link: {there}\nthe other: {here}");
    for (name, seen) in [("robot's host", &beside), ("other host", &far)] {
        println!(
            "{name}: {} states, age p50 {:.0} us, p99 {:.0} us; {} pictures",
            seen.states,
            percentile(&seen.ages_us, 0.5),
            percentile(&seen.ages_us, 0.99),
            seen.pictures
        );
    }
    assert_eq!((far.gaps, far.repeats), (0, 0), "states lost or repeated");
    assert_eq!((&states["lost"], &states["refused"]), (&0.into(), &0.into()), "{here}");
    assert!(far.states as f64 > 0.9 * SECONDS * 1000.0, "only {} states came", far.states);
    // One clock: the offset is nought.
    let clock = &here["clock"];
    let (offset, bound) = (clock["offset"].as_f64().expect("s"), clock["uncertainty"].as_f64().expect("s"));
    assert!(offset.abs() <= bound && bound < 5e-3, "{clock}");
    let bare = |of: &str| f64::min(p99(&before[of]), p99(&after[of]));
    println!(
        "states p99: link {:.0} us, bare {:.0} us; depth p99: link {:.0} us, bare {:.0} us",
        p99(states),
        bare("states"),
        p99(depth),
        bare("depth")
    );
    assert!(p99(states) <= 2.0 * bare("states"), "states take {:.0} us, bare {:.0}", p99(states), bare("states"));
}

#[test]
#[ignore = "root: cargo test --release -p rt_bridge --features link --test link -- --ignored --test-threads 1"]
fn five_seconds_of_pulled_cable_are_mended_within_two_and_no_state_is_lost() {
    let hosts = Hosts::new("b");
    let listen = hosts.link_on_robot(&["--listen", &hosts.robot_endpoint(PORT)]);
    let connect =
        hosts.link_on_far(&["--connect", &hosts.robot_endpoint(PORT), "--topics", "/arm/state,/camera/depth"]);
    let traffic = Traffic::start(&hosts.robot_domain, true);
    let mut reader = Reader::open(&hosts.far_domain);
    reader.wait_for_first(Duration::from_secs(20));
    let far = reader.read_for(Duration::from_secs(52));
    let mut mended = Vec::new();
    for is_robots_end in [true, false, true, false] {
        std::thread::sleep(Duration::from_secs(4));
        hosts.cable(is_robots_end, false);
        std::thread::sleep(OUT);
        hosts.cable(is_robots_end, true);
        let up = shared_mem::time::now_ns();
        let fresh = || far.newest_ns() > up;
        let begin = Instant::now();
        while !fresh() && begin.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(2));
        }
        mended.push(begin.elapsed());
    }
    println!("fresh states after {mended:?}");
    let seen = far.join().expect("a reader");
    let _sent = traffic.stop();
    let (there, here) = (listen.interrupted(), connect.interrupted());
    println!("{} states, {} gaps\nthe robot's link: {there}\nthe other: {here}", seen.states, seen.gaps);
    assert!(mended.iter().all(|took| *took <= MENDED), "{mended:?}");
    assert_eq!((seen.gaps, seen.repeats), (0, 0), "states lost or repeated");
    assert_eq!(topic(&here, "taken", "/arm/state")["lost"], 0, "{here}");
    assert_eq!(here["outages"], 4, "{here}");
}

#[test]
#[ignore = "root: cargo test --release -p rt_bridge --features link --test link -- --ignored --test-threads 1"]
fn a_strangers_command_is_refused_unless_commands_are_let_in_by_name() {
    for (name, commands) in [("c", None), ("d", Some("/arm/target"))] {
        let hosts = Hosts::new(name);
        let endpoint = hosts.robot_endpoint(PORT);
        let mut arguments = vec!["--listen", &endpoint];
        arguments.extend(commands.map(|list| ["--take-commands", list]).into_iter().flatten());
        let listen = hosts.link_on_robot(&arguments);
        let connect = hosts.link_on_far(&["--connect", &endpoint, "--topics", "/arm/state"]);
        let traffic = Traffic::start(&hosts.robot_domain, false);
        let mut reader = Reader::open(&hosts.far_domain);
        reader.wait_for_first(Duration::from_secs(20));
        let node = Node::open_in(&hosts.robot_domain, "bridge").expect("shared memory");
        let targets = node.subscriber(topics::ARM_TARGET).expect("a reader");
        let far = reader.read_for(Duration::from_secs(5));
        let intruder = hosts.peer_on_far(&format!("intrude 4 {endpoint}"));
        intruder.ended(Duration::from_secs(20));
        let mut came = 0;
        while let Some(target) = targets.receive().expect("shared memory") {
            assert_eq!(target.stream, 666);
            came += 1;
        }
        let far = far.join().expect("a reader");
        let _sent = traffic.stop();
        let (there, here) = (listen.interrupted(), connect.interrupted());
        println!("{came} targets of the stranger came\nthe robot's link: {there}\nthe other: {here}");
        assert_eq!(came, 0, "a stranger moved the arm");
        if let Some(command) = commands {
            // Where commands are let in they reach the link, and so the stranger spoke its language. One that answers no questions
            // about its clock is refused all the same.
            assert!(topic(&there, "taken", command)["refused"].as_u64() > Some(100), "{there}");
        }
        assert!(far.strangers == 0 && far.states > 3000, "{} states of a stranger of {}", far.strangers, far.states);
    }
}
