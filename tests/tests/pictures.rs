//! Pictures of 1280x720, colour and depth at 30 Hz, to two readers of which one is killed again and again: the other
//! loses none, none is torn, and memory stays flat.

use shared_mem::msg::image::{ImageHeader, PixelEncoding};
use shared_mem::topics;
use shared_mem::transport::{ImagePublisher, Node};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tests::{Cell, Program};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;

fn send(publisher: &ImagePublisher, sequence: u64, bytes_per_pixel: u32, encoding: PixelEncoding) {
    let bytes = (WIDTH * HEIGHT * bytes_per_pixel) as usize;
    publisher
        .send_with(bytes, |pixels| {
            for word in pixels.as_chunks_mut::<8>().0 {
                *word = sequence.to_le_bytes();
            }
            ImageHeader {
                sequence,
                width: WIDTH,
                height: HEIGHT,
                stride: WIDTH * bytes_per_pixel,
                encoding,
                ..ImageHeader::default()
            }
        })
        .expect("a picture sent");
}

/// Sends both pictures 30 times a second until told to end.
fn film(domain: &str, end: &AtomicBool) -> u64 {
    let node = Node::open_in(domain, "camera").expect("shared memory");
    let color = node.image_publisher(topics::CAMERA_COLOR, (WIDTH * HEIGHT * 3) as usize).expect("a publisher");
    let depth = node.image_publisher(topics::CAMERA_DEPTH, (WIDTH * HEIGHT * 2) as usize).expect("a publisher");
    let (start, mut sequence) = (Instant::now(), 0);
    while !end.load(Ordering::Relaxed) {
        send(&color, sequence, 3, PixelEncoding::Rgb8);
        send(&depth, sequence, 2, PixelEncoding::Depth16);
        sequence += 1;
        let due = Duration::from_nanos(sequence * 1_000_000_000 / 30);
        std::thread::sleep(due.saturating_sub(start.elapsed()));
    }
    sequence
}

/// Bytes this process holds, and bytes of shared memory its domain holds.
fn memory(domain: &str) -> (u64, u64) {
    let status = std::fs::read_to_string("/proc/self/status").expect("/proc");
    let kilobytes = status.lines().find_map(|l| l.strip_prefix("RssAnon:")).expect("RssAnon");
    let own: u64 = kilobytes.trim().trim_end_matches(" kB").parse().expect("a number");
    let shared = std::fs::read_dir("/dev/shm")
        .expect("/dev/shm")
        .filter_map(Result::ok)
        .filter(|e| {
            e.file_name().to_string_lossy().starts_with("twinalign_")
                && e.file_name().to_string_lossy().contains(&format!("_{domain}_"))
        })
        .filter_map(|e| e.metadata().ok())
        .map(|m| m.len())
        .sum();
    (own * 1024, shared)
}

fn two_readers_one_of_them_killed(seconds: f64, kills: u32) {
    let cell = Cell::shipped();
    let domain = cell.domain();
    let end = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let camera = scope.spawn(|| film(domain, &end));
        let survivor = Program::start("picture_reader", domain, &[&seconds.to_string()]);
        let mut before = None;
        for round in 0..kills {
            let mut victim = Program::start("picture_reader", domain, &[]);
            std::thread::sleep(Duration::from_secs_f64(seconds / f64::from(kills + 1)));
            victim.kill_without_warning();
            if round == 1 {
                before = Some(memory(domain));
            }
        }
        let after = memory(domain);
        let answer = survivor.wait(Duration::from_secs_f64(seconds + 20.0)).succeeded().json();
        end.store(true, Ordering::Relaxed);
        let sent = camera.join().expect("the camera");
        eprintln!(
            "{answer}; sent {sent} moments; memory (own, shared) after two kills {before:?}, at the end {after:?}"
        );
        assert!(answer["pictures"].as_u64() > Some((seconds * 50.0) as u64), "too few pictures: {answer}");
        assert_eq!(answer["torn"], 0, "{answer}");
        assert_eq!(answer["lost"], 0, "{answer}");
        let before = before.expect("at least two kills");
        assert!(after.0 < before.0 + 8_000_000, "the sender grew from {} to {} bytes", before.0, after.0);
        assert!(after.1 < before.1 + before.1 / 5, "shared memory grew from {} to {} bytes", before.1, after.1);
    });
}

#[test]
fn a_reader_that_dies_costs_the_other_no_picture() {
    two_readers_one_of_them_killed(6.0, 3);
}

#[test]
#[ignore = "takes a minute: cargo test --release --workspace --test pictures -- --ignored --nocapture"]
fn a_minute_of_pictures_survives_twenty_killed_readers() {
    two_readers_one_of_them_killed(60.0, 20);
}
