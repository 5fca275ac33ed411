//! Logs that say little and mean to become much, made here: each is refused in one line, with nothing written, or read as what
//! it holds.

use crate::lab;
use crate::lab::fixture;
use rusqlite::Connection;
use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use zip::write::SimpleFileOptions;

/// The line with which a log is refused.
fn refused(log: &Path) -> String {
    let out = log.with_extension("session");
    let line = lab::run(log, &out).expect_err("a log that is refused").to_string();
    assert!(line.lines().count() == 1 && line.contains(&log.display().to_string()), "{line}");
    assert!(!out.exists(), "{line}");
    line
}

/// A record of a ROS 1 bag: its fields and data, each behind its length.
fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let behind = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    let field = |(name, value): &(&str, &[u8])| behind(&[name.as_bytes(), b"=", value].concat());
    let header: Vec<u8> = fields.iter().flat_map(field).collect();
    [behind(&header), behind(data)].concat()
}

/// A bag of one topic with one message.
fn bag(definition: &str, message: &[u8]) -> Vec<u8> {
    let about = record(&[("type", b"a/Msg"), ("message_definition", definition.as_bytes())], b"");
    let length = u32::from_le_bytes([about[0], about[1], about[2], about[3]]) as usize;
    let conn = 0_u32.to_le_bytes();
    [
        b"#ROSBAG V2.0\n".to_vec(),
        record(&[("op", &[7]), ("conn", &conn), ("topic", b"/states")], &about[4..4 + length]),
        record(&[("op", &[2]), ("conn", &conn), ("time", &[0; 8])], message),
    ]
    .concat()
}

#[test]
fn arrays_without_end_of_what_takes_no_byte_are_no_type() {
    let place = tempfile::tempdir().expect("a folder");
    let (log, rule) = (place.path().join("empty.bag"), "=".repeat(80));
    let empty = format!("\n{rule}\nMSG: a/Empty\n{rule}\nMSG: a/Inner\nEmpty[] e\n");
    for (own, message) in [
        ("Empty[1000000000000] e", vec![]),
        // Four bytes say how many.
        ("Empty[] e", 4_u32.to_le_bytes().to_vec()),
        ("Inner[] i", [0x0000_ffff_u32.to_le_bytes().to_vec(), vec![0xff; 0x1_0000]].concat()),
    ] {
        std::fs::write(&log, bag(&format!("{own}{empty}"), &message)).expect("room");
        let line = refused(&log);
        assert!(line.contains("`/states` (the bag holds no definition of its type that can be read)"), "{own}: {line}");
    }
}

#[test]
fn a_chunk_that_becomes_thousands_of_times_its_size_is_refused_before_it_is_unpacked() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("chunk.bag");
    let size = (64 << 20) + 1;
    let mut packed = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    packed.write_all(&vec![0; size]).expect("room");
    let packed = packed.finish().expect("room");
    assert!(packed.len() < 1000);
    let fields: &[(&str, &[u8])] = &[("op", &[5]), ("compression", b"bz2"), ("size", &(size as u32).to_le_bytes())];
    std::fs::write(&log, [b"#ROSBAG V2.0\n".to_vec(), record(fields, &packed)].concat()).expect("room");
    assert!(refused(&log).contains("cut or damaged"));
}

#[test]
fn only_plain_tables_of_a_database_are_read() {
    let place = tempfile::tempdir().expect("a folder");
    let endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)";
    let topics = "CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT);";
    let messages = "CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);";
    let cases = [
        (
            "topics.db3",
            format!("CREATE VIEW topics AS {endless} SELECT i AS id, '/t' AS name, 'a/B' AS type FROM n; {messages}"),
            "`topics` is a view",
        ),
        (
            "messages.db3",
            format!(
                "{topics} CREATE VIEW messages AS {endless} SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"
            ),
            "`messages` is a view",
        ),
        (
            "definitions.db3",
            format!(
                "{topics} {messages} CREATE VIEW message_definitions AS {endless} SELECT 'a' AS topic_type, 'ros2msg' AS encoding, 'x' AS encoded_message_definition FROM n"
            ),
            "`message_definitions` is a view",
        ),
        (
            "calculated.db3",
            format!(
                "{topics} CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB AS (zeroblob(1000000000)))"
            ),
            "columns that are calculated",
        ),
        ("nothing.db3", topics.to_owned(), "it has no `messages`"),
    ];
    for (name, sql, words) in cases {
        let log = place.path().join(name);
        Connection::open(&log).and_then(|database| database.execute_batch(&sql)).expect("a database");
        let line = refused(&log);
        assert!(line.contains(words), "{line}");
    }
    // A demand that is never fulfilled in time is not evaluated.
    let log = place.path().join("demand.db3");
    let demand = format!("{topics} {messages} CREATE TABLE t (x CHECK (x LIKE '%a%a%a%a%a%a%a%a%a%b'));");
    let long = "INSERT INTO t VALUES (replace(hex(zeroblob(50000)), '0', 'a'))";
    Connection::open(&log)
        .and_then(|database| database.execute_batch(&format!("PRAGMA ignore_check_constraints = ON; {demand} {long}")))
        .expect("a database");
    assert!(refused(&log).contains("holds no numbers of a robot"));
}

#[test]
fn links_in_circles_below_a_data_set_are_followed_once() {
    let place = tempfile::tempdir().expect("a folder");
    let (log, out) = (place.path().join("set"), place.path().join("session"));
    lab::copy(&fixture("lerobot_v3"), &log);
    for name in ["one", "two"] {
        std::os::unix::fs::symlink(".", log.join("data").join(name)).expect("a link");
    }
    lab::run(&log, &out).expect("a data set");
    assert!(out.join("cell.toml").is_file());
}

#[test]
fn a_data_set_with_more_rows_than_it_says_is_refused_before_they_are_read() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("set");
    lab::copy(&fixture("lerobot_v3"), &log);
    let info = log.join("meta/info.json");
    let text = std::fs::read_to_string(&info).expect("a text");
    let mut said: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    said["total_frames"] = 7.into();
    std::fs::write(&info, said.to_string()).expect("room");
    let line = refused(&log);
    assert!(line.contains("meta/info.json leaves 7"), "{line}");
}

#[test]
fn arrays_of_one_body_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("overlap.npz");
    let mut archive = zip::ZipWriter::new(File::create(&log).expect("room"));
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    archive.start_file("q0.npy", options).expect("room");
    archive.write_all(&lab::npy("<f8", 2, &[0; 16])).expect("room");
    for number in 1..5 {
        archive.shallow_copy_file("q0.npy", &format!("q{number}.npy")).expect("a second name");
    }
    archive.finish().expect("room");
    assert!(refused(&log).contains("share their bytes"));
}

#[test]
fn bytes_that_become_gigabytes_of_numbers_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let log = place.path().join("bytes.npz");
    let mut archive = zip::ZipWriter::new(File::create(&log).expect("room"));
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    archive.start_file("q.npy", options).expect("room");
    // Eight times as much in doubles as there is room for.
    let count = shared_mem::budget::ROOM as usize / 8 + 1;
    archive.write_all(&lab::npy("|u1", count, &vec![0; count])).expect("room");
    archive.finish().expect("room");
    let line = refused(&log);
    assert!(line.contains("becomes more than 512 MiB"), "{line}");
}
