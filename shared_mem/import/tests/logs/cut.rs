//! Logs of which a part is cut, damaged or no log at all, made here: the good rest is read, and what is missing is said.

use crate::lab;
use crate::lab::{EXACT, Read, fixture};
use import::{ImportError, Outcome};
use rusqlite::Connection;
use std::io::{Cursor, Write as _};
use std::path::Path;

/// A bag of the storage mcap in chunks of a few messages.
fn chunked() -> Vec<u8> {
    let bytes = std::fs::read(fixture("rosbag2_mcap/rosbag2_mcap.mcap")).expect("a bag");
    let options = mcap::WriteOptions::new().compression(Some(mcap::Compression::Zstd)).chunk_size(Some(4096));
    let mut writer = options.create(Cursor::new(Vec::new())).expect("room");
    for message in mcap::MessageStream::new(&bytes).expect("a bag") {
        let message = message.expect("a message");
        if message.channel.topic != "/camera/color/image_raw" {
            writer.write(&message).expect("room");
        }
    }
    writer.finish().expect("room");
    writer.into_inner().into_inner()
}

fn says(read: &Read, words: &str) {
    assert!(read.warnings.iter().any(|warning| warning.contains(words)), "{words}: {:?}", read.warnings);
}

#[test]
fn a_recording_whose_recorder_was_killed_is_read_up_to_its_last_whole_chunk() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("killed.mcap");
    let whole = chunked();
    std::fs::write(&log, &whole[..whole.len() * 6 / 10]).expect("room");
    let read = lab::read(&log);
    let rows = read.clip.measured.len();
    assert!((20..lab::ROWS).contains(&rows), "{rows}");
    lab::holds_the_motion_from(&read.clip, rows, EXACT);
    says(&read, "the file is cut");
    says(&read, "messages that are whole are read");
    // Of a bag of two files.
    let bag = place.path().join("bag");
    std::fs::create_dir(&bag).expect("room");
    std::fs::write(bag.join("metadata.yaml"), "rosbag2_bagfile_information:\n").expect("room");
    std::fs::write(bag.join("bag_0.mcap"), &whole).expect("room");
    std::fs::write(bag.join("bag_1.mcap"), b"").expect("room");
    let read = lab::read(&bag);
    assert_eq!(read.clip.measured.len(), lab::ROWS);
    says(&read, "bag_1.mcap");
    // Nothing but its beginning.
    std::fs::write(&log, &whole[..200]).expect("room");
    let line = lab::run(&log, &place.path().join("nothing")).expect_err("nothing is left").to_string();
    assert!(line.contains("the file is cut") && line.lines().count() == 1, "{line}");
}

#[test]
fn a_database_that_is_cut_or_has_a_bad_page_gives_the_rest() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("bag.db3");
    let whole = std::fs::read(fixture("rosbag2_sqlite3/rosbag2_sqlite3.db3")).expect("a bag");
    std::fs::write(&log, &whole).expect("room");
    // Small pages, as many recordings of hours have them.
    Connection::open(&log)
        .and_then(|database| {
            database.execute_batch("DELETE FROM messages WHERE topic_id NOT IN (SELECT id FROM topics WHERE type LIKE '%JointState'); PRAGMA page_size = 1024; VACUUM")
        })
        .expect("a database");
    let whole = std::fs::read(&log).expect("a bag");
    std::fs::write(&log, &whole[..whole.len() * 7 / 10]).expect("room");
    let read = lab::read(&log);
    let rows = read.clip.measured.len();
    assert!((20..lab::ROWS).contains(&rows), "{rows}: {:?}", read.warnings);
    says(&read, "pages are there");
    // A page in the middle that was never written.
    let mut bytes = whole.clone();
    let page = bytes.len() / 2 / 1024 * 1024;
    bytes[page..page + 1024].fill(0);
    std::fs::write(&log, &bytes).expect("room");
    let read = lab::read(&log);
    let rows = read.clip.measured.len();
    assert!((lab::ROWS - 20..=lab::ROWS).contains(&rows), "{rows}: {:?}", read.warnings);
    says(&read, "the file is damaged");
}

#[test]
fn what_a_recorder_was_changing_is_taken_back_without_a_change_to_its_file() {
    let place = tempfile::tempdir().expect("a folder");
    let (log, killed) = (place.path().join("bag.db3"), place.path().join("killed.db3"));
    std::fs::copy(fixture("rosbag2_sqlite3/rosbag2_sqlite3.db3"), &log).expect("room");
    let mut database = Connection::open(&log).expect("a bag");
    // Pages go to the disk before the transaction ends, and the journal is there.
    database
        .execute_batch("PRAGMA journal_mode = DELETE; PRAGMA cache_size = 1; PRAGMA cache_spill = 1")
        .expect("a database");
    let transaction = database.transaction().expect("a database");
    transaction.execute("UPDATE messages SET data = zeroblob(3000)", []).expect("room");
    let journal = |path: &Path| path.with_extension("db3-journal");
    assert!(journal(&log).exists());
    std::fs::copy(&log, &killed).expect("room");
    std::fs::copy(journal(&log), journal(&killed)).expect("room");
    let before = std::fs::read(&killed).expect("a file");
    let read = lab::read(&killed);
    lab::holds_the_motion(&read.clip, (0, lab::ROWS), 7, EXACT);
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    assert!(before == std::fs::read(&killed).expect("a file") && journal(&killed).exists());
}

/// A record of a ROS 1 bag: its fields and data, each behind its length.
fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let behind = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    let field = |(name, value): &(&str, &[u8])| behind(&[name.as_bytes(), b"=", value].concat());
    let header: Vec<u8> = fields.iter().flat_map(field).collect();
    [behind(&header), behind(data)].concat()
}

/// Joint states and commands as a ROS 1 recorder has written them before it was killed: no index, and a header without one.
fn active() -> Vec<u8> {
    let definition = "Header header\nstring[] name\nfloat64[] position\n\
        ================================================================================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let mut bag = b"#ROSBAG V2.0\n".to_vec();
    let none = 0_u32.to_le_bytes();
    bag.extend(record(
        &[("op", &[3]), ("index_pos", &[0; 8]), ("conn_count", &none), ("chunk_count", &none)],
        &[b' '; 4000],
    ));
    for first in (0..lab::ROWS).step_by(10) {
        let mut chunk = Vec::new();
        for (id, topic, lag) in [(0_u32, "/joint_states", lab::LAG), (1, "/desired_joint_states", 0.0)] {
            let id = id.to_le_bytes();
            let about =
                record(&[("type", b"sensor_msgs/JointState"), ("message_definition", definition.as_bytes())], b"");
            let length = u32::from_le_bytes([about[0], about[1], about[2], about[3]]) as usize;
            chunk.extend(record(&[("op", &[7]), ("conn", &id), ("topic", topic.as_bytes())], &about[4..4 + length]));
            for row in first..first + 10 {
                let ns = row as u32 * lab::STEP_NS as u32;
                let stamp = [1_700_000_000 + ns / 1_000_000_000, ns % 1_000_000_000].map(u32::to_le_bytes).concat();
                let mut data = [&[0; 4][..], &stamp, &text("")].concat();
                data.extend(7_u32.to_le_bytes());
                (1..=7).for_each(|i| data.extend(text(&format!("fr3_joint{i}"))));
                data.extend(7_u32.to_le_bytes());
                (0..7).for_each(|i| data.extend(lab::motion(row, i, lag).0.to_le_bytes()));
                chunk.extend(record(&[("op", &[2]), ("conn", &id), ("time", &stamp)], &data));
            }
        }
        let size = (chunk.len() as u32).to_le_bytes();
        bag.extend(record(&[("op", &[5]), ("compression", b"none"), ("size", &size)], &chunk));
    }
    bag
}

#[test]
fn a_ros_1_bag_without_an_index_is_read_and_one_that_is_cut_gives_the_rest() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("run.bag.active");
    let whole = active();
    std::fs::write(&log, &whole).expect("room");
    let read = lab::read(&log);
    lab::holds_the_motion(&read.clip, (0, lab::ROWS), 7, EXACT);
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    std::fs::write(&log, &whole[..whole.len() - 500]).expect("room");
    let read = lab::read(&log);
    assert_eq!(read.clip.measured.len(), lab::ROWS - 10);
    lab::holds_the_motion_from(&read.clip, lab::ROWS - 10, EXACT);
    says(&read, "cut or damaged from byte");
    // In a folder it is found, too.
    let week = place.path().join("week");
    std::fs::create_dir(&week).expect("room");
    std::fs::rename(&log, week.join("run.bag.active")).expect("room");
    assert_eq!(lab::read(&week).clip.measured.len(), lab::ROWS - 10);
}

#[test]
fn a_data_set_gives_the_episodes_that_are_whole() {
    let place = tempfile::tempdir().expect("a folder");
    let set = place.path().join("set");
    lab::copy(&fixture("lerobot_v21"), &set);
    let last = set.join("data/chunk-000/episode_000001.parquet");
    let whole = std::fs::read(&last).expect("a file");
    for bytes in [Some(&whole[..whole.len() / 2]), None] {
        match bytes {
            Some(bytes) => std::fs::write(&last, bytes).expect("room"),
            None => std::fs::remove_file(&last).expect("a file"),
        }
        let read = lab::read(&set);
        assert_eq!((read.clips, read.clip.measured.len()), (1, lab::ROWS));
        says(&read, "60 of 100 frames and 1 of 2 episodes are there");
        assert!(!read.warnings.iter().any(|warning| warning.contains("download")), "{:?}", read.warnings);
    }
    std::fs::remove_file(set.join("data/chunk-000/episode_000000.parquet")).expect("a file");
    let line = lab::run(&set, &place.path().join("nothing")).expect_err("no episode").to_string();
    assert!(line.contains("0 of 100 frames") && line.lines().count() == 1, "{line}");
}

#[test]
fn a_table_with_a_cut_line_or_one_bad_row_gives_the_others() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("run.csv");
    let text = std::fs::read_to_string(fixture("plain.csv")).expect("a table");
    std::fs::write(&log, &text[..text.len() - 100]).expect("room");
    let read = lab::read(&log);
    lab::holds_the_motion_from(&read.clip, lab::ROWS - 1, EXACT);
    says(&read, "its last line (61 from the beginning of the table) has no end");
    let lines: Vec<&str> = text.lines().collect();
    let with = |row: &str| {
        let mut lines = lines.clone();
        lines[30] = row;
        std::fs::write(&log, lines.join("\n") + "\n").expect("room");
        lab::read(&log)
    };
    let (nan, word) = (format!("0.58{}", ",nan".repeat(28)), lines[30].replacen("0.58,", "0.58,#ERR", 1));
    for (row, words) in [("0.58,1,2", "line 31 has 3 columns"), (&word, "holds `#ERR")] {
        let read = with(row);
        assert_eq!(read.clip.measured.len(), lab::ROWS - 1, "{row}");
        says(&read, words);
    }
    let read = with(&nan);
    assert_eq!(read.clip.measured.len(), lab::ROWS - 1);
    assert!(!read.warnings.is_empty());
}

#[test]
fn what_comes_out_of_a_packed_file_before_its_cut_is_read() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("run.csv.gz");
    let text = std::fs::read(fixture("plain.csv")).expect("a table");
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
    packer.write_all(&text).expect("room");
    std::fs::write(&log, &packer.finish().expect("room")[..text.len() / 2]).expect("room");
    let read = lab::read(&log);
    let rows = read.clip.measured.len();
    assert!((20..lab::ROWS).contains(&rows), "{rows}");
    lab::holds_the_motion_from(&read.clip, rows, EXACT);
    says(&read, "could be unpacked, and are read");
    // A few bytes that become more than a log of their size.
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    let row = "0,1\n".repeat(1 << 18);
    (0..600).for_each(|_| packer.write_all(row.as_bytes()).expect("room"));
    std::fs::write(&log, packer.finish().expect("room")).expect("room");
    let line = lab::run(&log, &place.path().join("large")).expect_err("too much").to_string();
    assert!(line.contains("run.csv.gz: becomes more than 512 MiB"), "{line}");
}

#[test]
fn what_lies_beside_good_logs_is_named_once_and_left_out() {
    let place = tempfile::tempdir().expect("a folder");
    let week = place.path().join("week");
    std::fs::create_dir(&week).expect("room");
    std::fs::copy(fixture("joint_states_lz4.bag"), week.join("monday.bag")).expect("room");
    let log = "[INFO] [1760000000.12] [bridge]: started\n[WARN] [1760000003.40] [bridge]: 3 cycles late\n".repeat(2000);
    for (name, bytes) in [
        ("README.txt", &b"Monday: gripper off, 0.4 kg plate on the flange.\n"[..]),
        ("bridge.log", log.as_bytes()),
        ("photo.jpg", b"\xff\xd8\xff\xe0 a picture"),
        ("tuesday.mcap", b"\x89MCAP0\r\n"),
        ("wednesday.bag", b""),
        (".hidden.bag", b"nothing"),
    ] {
        std::fs::write(week.join(name), bytes).expect("room");
    }
    let read = lab::read(&week);
    assert_eq!((read.clips, read.clip.measured.len()), (1, lab::ROWS));
    let left_out = read.left_out.join("\n");
    for name in ["README.txt", "bridge.log", "photo.jpg", "tuesday.mcap", "wednesday.bag"] {
        assert_eq!(left_out.matches(name).count(), 1, "{name}: {left_out}");
    }
    assert!(!left_out.contains("hidden") && !left_out.contains("monday"), "{left_out}");
    // Named itself, a log is not left out.
    let named =
        |name: &str| -> ImportError { lab::run(&week.join(name), &place.path().join("named")).expect_err("no log") };
    assert!(named("README.txt").to_string().contains("is no table of numbers"));
    std::fs::remove_file(week.join("monday.bag")).expect("a file");
    let line = lab::run(&week, &place.path().join("nothing")).expect_err("no log").to_string();
    assert!(line.contains("week") && line.lines().count() == 1, "{line}");
    for name in ["bridge.log", "tuesday.mcap", "wednesday.bag", "README.txt"] {
        std::fs::remove_file(week.join(name)).expect("a file");
    }
    let line = lab::run(&week, &place.path().join("nothing")).expect_err("no log").to_string();
    assert!(line.contains("holds no log that is known (there are photo.jpg)"), "{line}");
}

#[test]
fn the_questions_of_an_import_say_what_is_left_out() {
    let place = tempfile::tempdir().expect("a folder");
    let week = place.path().join("week");
    std::fs::create_dir(&week).expect("room");
    std::fs::copy(fixture("unnamed.csv"), week.join("run.csv")).expect("room");
    std::fs::write(week.join("photo.jpg"), b"\xff\xd8\xff\xe0 a picture").expect("room");
    let outcome = lab::run(&week, &place.path().join("session")).expect("questions");
    let Outcome::Open { notes, .. } = outcome else { panic!("nothing was asked") };
    assert!(
        notes.iter().any(|note| note.line == "left out" && note.why.contains("photo.jpg") && !note.open),
        "{notes:?}"
    );
}
