//! What a person reads when there is no robot, or not the right one.

use crate::robot::Robot;
use rt_bridge::fr3;
use rt_bridge::rt::Realtime;
use shared_mem::cell::Cell;
use std::net::TcpListener;
use std::time::{Duration, Instant};

/// The one line in which connecting to `host` fails, and how long that took.
fn refused(host: &str) -> (String, Duration) {
    let begin = Instant::now();
    match fr3::connect(host, Realtime::Ignore, &Cell::default()) {
        Ok(_) => panic!("connected to {host} although no robot is there"),
        Err(error) => (error.to_string(), begin.elapsed()),
    }
}

#[test]
fn nobody_at_the_address_is_one_line_that_names_it_and_the_remedy() {
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port();
    let (text, took) = refused(&format!("127.0.0.1:{port}"));
    assert!(text.contains(&format!("no robot answers at 127.0.0.1:{port} (connection refused)")), "{text}");
    assert!(text.contains("check the address") && !text.contains('\n'), "{text}");
    assert!(took < Duration::from_secs(3), "{took:?}");
}

#[test]
fn a_server_that_accepts_and_says_nothing_is_given_up_within_seconds() {
    let silent = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let (text, took) = refused(&silent.local_addr().expect("it is bound").to_string());
    assert!(text.contains("another program may be connected to it already") && !text.contains('\n'), "{text}");
    assert!(took < Duration::from_secs(4), "{took:?}");
}

#[test]
fn a_server_that_hangs_up_is_told_from_a_robot() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let host = listener.local_addr().expect("it is bound").to_string();
    std::thread::spawn(move || drop(listener.accept()));
    let (text, _) = refused(&host);
    assert!(text.contains("no robot answers") && !text.contains('\n'), "{text}");
}

#[test]
fn another_version_is_named_beside_ours_with_what_to_do() {
    let robot = Robot::answering(1, 9);
    let (text, _) = refused(&robot.host);
    assert!(text.contains("speaks FCI version 9") && text.contains("this bridge speaks 10"), "{text}");
    assert!(text.contains("5.7.2") && text.contains("update the robot to system image 5.9.0"), "{text}");
    assert!(!text.contains('\n'), "{text}");
}

#[test]
fn another_version_is_noticed_even_where_the_robot_claims_success() {
    let robot = Robot::answering(0, 5);
    let (text, _) = refused(&robot.host);
    assert!(text.contains("speaks FCI version 5") && text.contains("Panda"), "{text}");
}

#[test]
fn a_robot_whose_states_do_not_arrive_points_at_the_firewall() {
    let robot = Robot::new();
    robot.script().silent = true;
    let (text, took) = refused(&robot.host);
    assert!(text.contains("states do not arrive at UDP port") && text.contains("firewall"), "{text}");
    assert!(took < Duration::from_secs(3), "{took:?}");
}
