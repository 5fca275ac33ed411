//! A reader of both picture topics that checks every byte: one word fills a picture, so a torn one shows.
//!
//! Runs until killed or its parent is gone, or for as many seconds as its only argument says; then prints one JSON object.
#![allow(clippy::print_stdout)] // its answer

use shared_mem::transport::{ImageSubscriber, Node};
use shared_mem::{parent, topics};
use std::os::unix::process::parent_id;
use std::time::{Duration, Instant};

/// What one topic brought.
#[derive(Debug, Default)]
struct Tally {
    pictures: u64,
    torn: u64,
    lost: u64,
    last: Option<u64>,
}

impl Tally {
    fn drain(&mut self, subscriber: &ImageSubscriber) {
        while let Some(picture) = subscriber.receive().expect("a picture") {
            let sequence = picture.header().sequence;
            if let Some(last) = self.last {
                self.lost += sequence - last - 1;
            }
            self.last = Some(sequence);
            self.pictures += 1;
            let word = sequence.to_le_bytes();
            let (words, rest) = picture.bytes().as_chunks::<8>();
            if !rest.is_empty() || words.iter().any(|w| *w != word) {
                self.torn += 1;
            }
        }
    }
}

fn main() {
    let seconds: f64 = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(f64::INFINITY);
    let node = Node::open("picture reader").expect("shared memory");
    let color = node.image_subscriber(topics::CAMERA_COLOR).expect("a place to read");
    let depth = node.image_subscriber(topics::CAMERA_DEPTH).expect("a place to read");
    let wake = node.wake_on(topics::CAMERA_DEPTH.name).expect("a bell");
    let (mut colors, mut depths) = (Tally::default(), Tally::default());
    let (start, parent) = (Instant::now(), parent_id());
    while !parent::is_gone(parent) && start.elapsed().as_secs_f64() < seconds {
        let _rung = wake.wait(Duration::from_millis(50)).expect("a bell");
        colors.drain(&color);
        depths.drain(&depth);
    }
    println!(
        r#"{{"pictures": {}, "torn": {}, "lost": {}}}"#,
        colors.pictures + depths.pictures,
        colors.torn + depths.torn,
        colors.lost + depths.lost
    );
}
