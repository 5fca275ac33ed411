//! Shared memory between threads and processes: what is sent arrives, late readers are served, the dead are cleared away.
//!
//! Each test takes a domain of its own, so that they neither meet each other nor a bridge that runs on this machine.

mod any_bits;

use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::topics;
use shared_mem::transport::{Node, TransportError};
use std::time::{Duration, Instant};

/// A seat in the domain of one test.
fn node(test: &str, name: &str) -> Node {
    Node::open_in(&format!("{test}-{}", std::process::id()), name).expect("shared memory")
}

#[test]
fn messages_arrive_in_order_and_a_sleeper_wakes() {
    let sender = node("order", "sender");
    let publisher = sender.publisher(topics::ARM_STATE).expect("publisher");
    let reader = std::thread::spawn(|| {
        let seat = node("order", "reader");
        let subscriber = seat.subscriber(topics::ARM_STATE).expect("subscriber");
        let wake = seat.wake_on(topics::ARM_STATE.name).expect("wake");
        let mut cycles = Vec::new();
        while cycles.len() < 100 {
            assert!(wake.wait(Duration::from_secs(5)).expect("wait"), "nothing was sent for 5 s");
            while let Some(state) = subscriber.receive().expect("receive") {
                cycles.push(state.cycle);
            }
        }
        cycles
    });
    let mut cycle = 0;
    while !reader.is_finished() {
        publisher.send(&ArmState { cycle, ..ArmState::default() }).expect("send");
        cycle += 1;
        std::thread::sleep(Duration::from_millis(1));
    }
    let cycles = reader.join().expect("reader");
    assert!(cycles.windows(2).all(|w| w[1] == w[0] + 1), "out of order or lost: {cycles:?}");
}

/// Rings as fast as they can be sent meet those that are just being answered.
#[test]
fn a_sleeper_sleeps_until_something_is_sent() {
    const LAST: u64 = 100_000;
    let sender = node("rush", "sender");
    let publisher = sender.publisher(topics::ARM_STATE).expect("publisher");
    let reader = std::thread::spawn(|| {
        let seat = node("rush", "reader");
        let subscriber = seat.subscriber(topics::ARM_STATE).expect("subscriber");
        let wake = seat.wake_on(topics::ARM_STATE.name).expect("wake");
        let mut newest = 0;
        while newest < LAST {
            let lain_down = Instant::now();
            let told = wake.wait(Duration::from_secs(20)).expect("wait");
            assert!(told, "woken for nothing after {newest}");
            assert!(lain_down.elapsed() < Duration::from_secs(10), "slept on while messages came");
            newest = subscriber.newest().expect("receive").map_or(newest, |state| state.cycle);
        }
    });
    while !reader.is_finished() {
        for cycle in 1..=LAST {
            publisher.send(&ArmState { cycle, ..ArmState::default() }).expect("send");
        }
        // The reader ends when it sees the last one: a next round at once would bury that.
        std::thread::sleep(Duration::from_millis(20));
    }
    reader.join().expect("reader");
}

#[test]
fn a_sleeper_wakes_when_nothing_is_sent_however_short_its_sleep() {
    let seat = node("silence", "reader");
    let wake = seat.wake_on(topics::ARM_STATE.name).expect("wake");
    for nanoseconds in (0..3000).step_by(100).chain([99_999, 100_001, 5_000_001]) {
        assert!(!wake.wait(Duration::from_nanos(nanoseconds)).expect("wait"));
    }
}

#[test]
fn a_second_publisher_is_refused_by_name() {
    let first = node("second", "first");
    let _publisher = first.publisher(topics::ARM_STATE).expect("publisher");
    let second = node("second", "second");
    let error = second.publisher(topics::ARM_STATE).expect_err("a second publisher");
    assert!(matches!(error, TransportError::Full { topic: "/arm/state", .. }), "{error}");
    assert!(error.to_string().contains("another rt_bridge is running"), "{error}");
}

#[test]
fn a_late_reader_gets_the_history() {
    let sender = node("late", "sender");
    let publisher = sender.publisher(topics::CAMERA_INFO).expect("publisher");
    publisher.send(&CameraInfo { width: 640, height: 480, ..CameraInfo::default() }).expect("send");
    let late = node("late", "late");
    let subscriber = late.subscriber(topics::CAMERA_INFO).expect("subscriber");
    publisher.greet_new_readers().expect("greet");
    assert_eq!(subscriber.receive().expect("receive").map(|i| i.width), Some(640));
}

#[test]
fn a_stalled_reader_loses_its_oldest_messages_and_blocks_nobody() {
    let seat = node("stalled", "both");
    let publisher = seat.publisher(topics::ARM_STATE).expect("publisher");
    let subscriber = seat.subscriber(topics::ARM_STATE).expect("subscriber");
    let sent = 3 * topics::ARM_STATE.limits.buffer as u64;
    for cycle in 0..sent {
        publisher.send_quietly(&ArmState { cycle, ..ArmState::default() }).expect("send");
    }
    let mut received = Vec::new();
    while let Some(state) = subscriber.receive().expect("receive") {
        received.push(state.cycle);
    }
    assert_eq!(received.len(), topics::ARM_STATE.limits.buffer);
    assert_eq!(received.last(), Some(&(sent - 1)));
    assert!(received.windows(2).all(|w| w[1] == w[0] + 1));
}

#[test]
fn pictures_arrive_whole_with_their_header() {
    let seat = node("pictures", "both");
    let bytes = 64 * 48 * 3;
    let publisher = seat.image_publisher(topics::CAMERA_COLOR, bytes).expect("publisher");
    let subscriber = seat.image_subscriber(topics::CAMERA_COLOR).expect("subscriber");
    for sequence in 0..3_u64 {
        publisher
            .send_with(bytes, |pixels| {
                pixels.fill(u8::try_from(sequence).expect("small"));
                ImageHeader { sequence, width: 64, height: 48, stride: 192, ..ImageHeader::default() }
            })
            .expect("send");
    }
    for sequence in 0..3_u64 {
        let image = subscriber.receive().expect("receive").expect("a picture");
        assert_eq!(image.header().sequence, sequence);
        assert_eq!(image.bytes().len(), bytes);
        assert!(image.bytes().iter().all(|b| u64::from(*b) == sequence));
    }
    let error = publisher.send_with(bytes + 1, |_| ImageHeader::default()).expect_err("too large");
    assert!(error.to_string().contains("/camera/color"), "{error}");
}
