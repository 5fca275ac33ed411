//! Damaged logs: refused in one line with nothing written, or a session that loads, of what is whole: with a warning, or, where a
//! format has no checksum and the damage shows nowhere, without.

#![allow(clippy::print_stdout)] // its table

use crate::lab;
use crate::lab::{copy, fixture};
use rand::{RngExt, SeedableRng};
use shared_mem::recording::Session;
use std::path::PathBuf;

/// Which file of a log is damaged.
const LOGS: [(&str, &str); 13] = [
    ("rosbag2_mcap", "rosbag2_mcap.mcap"),
    ("rosbag2_sqlite3", "rosbag2_sqlite3.db3"),
    ("franka_state.bag", ""),
    ("joint_states_bz2.bag", ""),
    ("joint_states_lz4.bag", ""),
    ("lerobot_v21", "data/chunk-000/episode_000000.parquet"),
    ("lerobot_v3", "data/chunk-000/file-000.parquet"),
    ("plain.csv", ""),
    ("log.npz", ""),
    ("small.npz", ""),
    ("libfranka.csv", ""),
    ("sage_motion", "state_motor.csv"),
    ("sage_motion", "control.csv"),
];

/// How many of the damaged copies were refused or read with a warning, of those that were cut and of those that were changed.
fn damaged(log: &str, file: &str, copies: usize) -> [usize; 2] {
    let lab = tempfile::tempdir().expect("a folder");
    let place: PathBuf = lab.path().join(log);
    copy(&fixture(log), &place);
    let victim = if file.is_empty() { place.clone() } else { place.join(file) };
    let whole = std::fs::read(&victim).expect("the file");
    let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
    let mut refused = [0; 2];
    for number in 0..copies {
        let mut bytes = whole.clone();
        let changed = number % 2;
        if changed == 0 {
            bytes.truncate(rng.random_range(0..whole.len()));
        } else {
            for _ in 0..rng.random_range(1..20) {
                let at = rng.random_range(0..bytes.len());
                bytes[at] ^= rng.random_range(1..=255_u8);
            }
        }
        std::fs::write(&victim, &bytes).expect("room");
        let out = lab.path().join(format!("session_{number}"));
        match lab::run(&place, &out) {
            Err(error) => {
                refused[changed] += 1;
                let line = error.to_string();
                assert!(line.lines().count() == 1 && line.len() < 2000, "{log} {number}: {line}");
                assert!(line.contains(log), "{log} {number}: {line}");
                assert!(!out.exists(), "{log} {number}: {line}");
            }
            Ok(import::Outcome::Done { clips, .. }) => {
                let is_odd = |clip: &import::Imported| {
                    !clip.warnings.is_empty()
                        || clip.left_out.iter().any(|out| out.why.contains("not what their type says"))
                };
                refused[changed] += usize::from(clips.iter().any(is_odd));
                let session = Session::open(&out).unwrap_or_else(|e| panic!("{log} {number}: {e}"));
                for clip in &session.clips {
                    session.read(clip).unwrap_or_else(|e| panic!("{log} {number}: {e}"));
                }
            }
            Ok(import::Outcome::Open { .. }) => assert!(!out.exists()),
        }
        let left: Vec<_> = std::fs::read_dir(lab.path()).expect("a folder").flatten().map(|e| e.file_name()).collect();
        assert!(left.len() <= 3, "{left:?}");
        let _ = std::fs::remove_dir_all(&out);
        let _ = std::fs::remove_file(out.with_extension("toml"));
    }
    refused
}

#[test]
fn a_damaged_log_is_refused_in_one_line_or_read_with_a_warning() {
    for (log, file) in LOGS {
        let [cut, changed] = damaged(log, file, 8);
        assert!(cut + changed >= 4, "{log}/{file}: {cut} cut and {changed} changed of 4 each were noticed");
    }
}

/// `cargo test --release -p import --test logs damaged -- --ignored --nocapture`
#[test]
#[ignore = "takes a minute: cargo test --release --workspace --test logs damaged -- --ignored --nocapture prints how many of 200 damaged \
            copies of each log were refused or read with a warning"]
fn two_hundred_of_each() {
    for (log, file) in LOGS {
        let [cut, changed] = damaged(log, file, 200);
        println!("{log} {file}: noticed {cut} of 100 that were cut and {changed} of 100 with changed bytes");
    }
}
