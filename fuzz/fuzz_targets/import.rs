//! A log of another program: a bag, a data set, a table, a folder of a motion. The first byte says which of them the rest is, or
//! which of its files; the others are well-formed. Whatever comes in, there is a session that loads, questions, or one line and
//! nothing written.
#![no_main]

use import::{Order, Outcome};
use libfuzzer_sys::fuzz_target;
use shared_mem::recording::Session;
use std::path::{Path, PathBuf};

/// Logs and the file of each that is fuzzed; none: the log is that file.
const LOGS: [(&str, Option<&str>); 11] = [
    ("rosbag2_mcap", Some("rosbag2_mcap.mcap")),
    ("rosbag2_sqlite3", Some("rosbag2_sqlite3.db3")),
    ("franka_state.bag", None),
    ("joint_states_bz2.bag", None),
    ("joint_states_lz4.bag", None),
    ("lerobot_v3", Some("data/chunk-000/file-000.parquet")),
    ("lerobot_v21", Some("meta/info.json")),
    ("plain.csv", None),
    ("small.npz", None),
    ("libfranka.csv", None),
    ("sage_motion", Some("state_motor.csv")),
];

fn fixture(log: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared_mem/import/tests/fixtures").join(log)
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).expect("room for a folder");
        for entry in std::fs::read_dir(from).expect("a folder").flatten() {
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        std::fs::copy(from, to).expect("room for a file");
    }
}

fn seeds() -> Vec<Vec<u8>> {
    let seed = |(first, (log, file)): (usize, &(&str, Option<&str>))| {
        let whole = fixture(log);
        let bytes = std::fs::read(file.map_or(whole.clone(), |file| whole.join(file))).expect("a fixture");
        [&[first as u8][..], &bytes].concat()
    };
    let mut seeds: Vec<Vec<u8>> = LOGS.iter().enumerate().map(seed).collect();
    // The same table in UTF-16, with decimal commas.
    let table = LOGS.iter().position(|(log, _)| *log == "plain.csv").expect("a table");
    let text = std::fs::read_to_string(fixture("plain.csv")).expect("a fixture").replace(',', ";").replace('.', ",");
    seeds.push(std::iter::once(table as u8).chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect());
    seeds
}

fuzz_target!(
    init: fuzz::seeds(seeds()),
    |bytes: &[u8]| {
        let Some((&first, bytes)) = bytes.split_first() else { return };
        let (name, file) = LOGS[usize::from(first) % LOGS.len()];
        let log = fuzz::folder().join(name);
        if file.is_some() && !log.exists() {
            copy(&fixture(name), &log);
        }
        std::fs::write(file.map_or(log.clone(), |file| log.join(file)), bytes).expect("room for a file");
        let (out, questions) = (fuzz::folder().join("session"), fuzz::folder().join("import.toml"));
        let order = Order {
            files: &[log],
            out: &out,
            mapping: None,
            cell: None,
            force: false,
            questions: &questions,
            arms: &|_, _| Ok(None),
            command: &|mapping| mapping.display().to_string(),
        };
        match fuzz::accepted(import::import(order, |_, _| {})) {
            Some(Outcome::Done { .. }) => {
                let session = Session::open(&out).expect("a session");
                for clip in &session.clips {
                    session.read(clip).expect("a clip");
                }
                std::fs::remove_dir_all(&out).expect("a folder of ours");
            }
            Some(Outcome::Open { .. }) => std::fs::remove_file(&questions).expect("a file of ours"),
            None => assert!(!out.exists() && !questions.exists()),
        }
    }
);
