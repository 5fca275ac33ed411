//! The same logs in other forms, made here out of the fixtures: other encodings, ends of lines, decimal signs and packings. Each is
//! read as what it holds, or named.

use crate::lab;
use crate::lab::{EXACT, ROWS, Read, fixture, holds_the_motion, read};
use import::Outcome;
use rusqlite::Connection;
use shared_mem::recording::Session;
use std::io::{Cursor, Write as _};
use std::path::Path;

/// The line with which a log is refused.
fn refused(log: &Path) -> String {
    let line = lab::run(log, &log.with_file_name("session")).expect_err("a refusal").to_string();
    assert!(line.lines().count() == 1 && line.contains(&log.display().to_string()), "{line}");
    line
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 3).expect("room")
}

/// The bag of the storage mcap with each of its messages packed.
fn packed_mcap() -> Vec<u8> {
    let bytes = std::fs::read(fixture("rosbag2_mcap/rosbag2_mcap.mcap")).expect("a bag");
    let mut writer = mcap::WriteOptions::new().compression(None).create(Cursor::new(Vec::new())).expect("room");
    for message in mcap::MessageStream::new(&bytes).expect("a bag") {
        let mut message = message.expect("a message");
        message.data = zstd(&message.data).into();
        writer.write(&message).expect("room");
    }
    writer.finish().expect("room");
    writer.into_inner().into_inner()
}

#[test]
fn messages_that_are_packed_one_by_one_are_read_in_both_storages() {
    let place = tempfile::tempdir().expect("a folder");
    let (folder, mcap) = (place.path().join("bag"), place.path().join("packed.mcap"));
    lab::copy(&fixture("rosbag2_sqlite3"), &folder);
    let bag = folder.join("rosbag2_sqlite3.db3");
    let database = Connection::open(&bag).expect("a bag");
    let ids: Vec<i64> = {
        let mut statement = database.prepare("SELECT id FROM messages").expect("messages");
        statement.query_map([], |row| row.get(0)).expect("messages").map(|id| id.expect("a number")).collect()
    };
    for id in ids {
        let data: Vec<u8> =
            database.query_row("SELECT data FROM messages WHERE id = ?1", [id], |row| row.get(0)).expect("a message");
        database
            .execute("UPDATE messages SET data = ?2 WHERE id = ?1", rusqlite::params![id, zstd(&data)])
            .expect("room");
    }
    drop(database);
    std::fs::write(&mcap, packed_mcap()).expect("room");
    let alone = place.path().join("alone.db3");
    std::fs::copy(&bag, &alone).expect("room");
    for log in [folder, bag, alone, mcap.clone()] {
        let Read { clip, warnings, .. } = read(&log);
        holds_the_motion(&clip, (0, ROWS), 7, EXACT);
        assert!(warnings.is_empty(), "{}: {warnings:?}", log.display());
    }
    // The bag itself is a clip of a session, too.
    let cell = lab::imported("rosbag2_mcap").session.cell;
    let own = shared_mem::recording::read_clip(&mcap, shared_mem::cell::ClipKind::Excitation, &cell).expect("a bag");
    holds_the_motion(&own, (0, ROWS), 7, EXACT);
}

#[test]
fn messages_of_a_form_that_is_not_known_are_named_as_such() {
    let place = tempfile::tempdir().expect("a folder");
    let bag = place.path().join("odd.db3");
    std::fs::copy(fixture("rosbag2_sqlite3/rosbag2_sqlite3.db3"), &bag).expect("room");
    let database = Connection::open(&bag).expect("a bag");
    database.execute("UPDATE messages SET data = CAST(x'00ff0000' || data AS BLOB)", []).expect("room");
    drop(database);
    let line = refused(&bag);
    assert!(line.contains("in a form that is not known") && !line.contains("damaged"), "{line}");
}

#[test]
fn files_that_are_packed_as_a_whole_are_read_in_place() {
    let place = tempfile::tempdir().expect("a folder");
    for (name, ending) in [("rosbag2_sqlite3", "db3"), ("rosbag2_mcap", "mcap")] {
        let folder = place.path().join(name);
        lab::copy(&fixture(name), &folder);
        let (bag, packed) = (folder.join(format!("{name}.{ending}")), folder.join(format!("{name}.{ending}.zstd")));
        std::fs::write(&packed, zstd(&std::fs::read(&bag).expect("a bag"))).expect("room");
        // Beside what `ros2 bag play` has unpacked it is not a second one.
        holds_the_motion(&read(&folder).clip, (0, ROWS), 7, EXACT);
        std::fs::remove_file(&bag).expect("a file");
        for log in [folder, packed] {
            let Read { clip, warnings, .. } = read(&log);
            holds_the_motion(&clip, (0, ROWS), 7, EXACT);
            assert!(warnings.is_empty(), "{}: {warnings:?}", log.display());
        }
    }
    let ros1 = place.path().join("run.bag.zst");
    std::fs::write(&ros1, zstd(&std::fs::read(fixture("joint_states_lz4.bag")).expect("a bag"))).expect("room");
    holds_the_motion(&read(&ros1).clip, (0, ROWS), 7, EXACT);
}

#[test]
fn a_table_is_the_same_in_every_encoding_and_packing() {
    let place = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(fixture("plain.csv")).expect("a table");
    let log = place.path().join("plain.csv");
    std::fs::write(&log, &text).expect("room");
    let whole = read(&log).clip;
    holds_the_motion(&whole, (0, ROWS), 7, EXACT);
    let commas = |sign: &str| text.replace(',', sign).replace('.', ",");
    let wide = |text: &str, bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
    let latin = [&b"# Gr\xf6\xdfe: Winkel [\xb0]\n"[..], text.as_bytes()].concat();
    let (mut gzip, mut bzip2) = (
        flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast()),
        bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast()),
    );
    gzip.write_all(text.as_bytes()).expect("room");
    bzip2.write_all(text.as_bytes()).expect("room");
    for (name, bytes) in [
        ("semicolons.csv", commas(";").into_bytes()),
        ("tabs.tsv", commas("\t").into_bytes()),
        ("blanks.txt", commas(" ").into_bytes()),
        ("windows.csv", text.replace('\n', "\r\n").into_bytes()),
        ("old.csv", text.replace('\n', "\r").into_bytes()),
        ("wide.csv", wide(&format!("\u{feff}{text}"), u16::to_le_bytes)),
        ("wide_windows.csv", wide(&text.replace('\n', "\r\n"), u16::to_be_bytes)),
        ("marked.csv", format!("\u{feff}{text}").into_bytes()),
        ("packed.csv.gz", gzip.finish().expect("room")),
        ("packed.csv.bz2", bzip2.finish().expect("room")),
        ("packed.csv.zst", zstd(text.as_bytes())),
        ("latin.csv", latin),
    ] {
        let log = place.path().join(name);
        std::fs::write(&log, bytes).expect("room");
        let Read { clip, warnings, .. } = read(&log);
        assert!(clip.measured == whole.measured && clip.desired == whole.desired, "{name}");
        let says = warnings.iter().any(|warning| warning.contains("Windows-1252"));
        assert_eq!(says, name == "latin.csv", "{name}: {warnings:?}");
    }
    let log = place.path().join("run.csv.xz");
    std::fs::write(&log, b"\xfd7zXZ\0\0\0\0\0").expect("room");
    assert!(refused(&log).contains("is packed with xz; unpack it with `unxz`"));
}

#[test]
fn two_tables_that_were_printed_during_one_run_are_one_clip() {
    let place = tempfile::tempdir().expect("a folder");
    let run = place.path().join("run");
    std::fs::create_dir(&run).expect("room");
    // As `ros2 topic echo --csv` prints joint states: no names, the stamp in two columns.
    let row = |k: usize, lag: f64| {
        let q: Vec<String> = (0..7).map(|i| lab::motion(k, i, lag).0.to_string()).collect();
        let ns = k as u64 * lab::STEP_NS + 990_000_000;
        format!("{},{},base,a,b,c,d,e,f,g,{}\n", 1_700_000_000 + ns / 1_000_000_000, ns % 1_000_000_000, q.join(","))
    };
    for (name, lag) in [("states.csv", lab::LAG), ("desired_states.csv", 0.0)] {
        let rows: String = (0..ROWS).map(|k| row(k, lag)).collect();
        std::fs::write(run.join(name), rows).expect("room");
    }
    let mapping = place.path().join("import.toml");
    let block = |table: &str| {
        let q: Vec<String> = (11..18).map(|n| format!("\"column[{n}]\"")).collect();
        format!("table = \"{table}\"\nstamps = \"header\"\nq = [{}]\n", q.join(", "))
    };
    let joints: Vec<String> = (1..=7).map(|i| format!("\"fr3_joint{i}\"")).collect();
    let text = format!(
        "kind = \"excitation\"\njoints = [{}]\n[measured]\n{}[desired]\n{}",
        joints.join(", "),
        block("states"),
        block("desired_states")
    );
    std::fs::write(&mapping, text).expect("room");
    let (files, out) = ([run], place.path().join("session"));
    let order = import::Order { mapping: Some(&mapping), ..lab::order(&files, &out, &mapping) };
    let outcome = import::import(order, |_, _| {}).expect("an import");
    let Outcome::Done { clips, .. } = outcome else { panic!("open") };
    assert_eq!(clips.len(), 1);
    assert!(clips[0].warnings.iter().any(|warning| warning.contains("are seconds and nanoseconds")), "{clips:?}");
    let session = Session::open(&out).expect("a session");
    let clip = session.read(&session.clips[0]).expect("a clip");
    holds_the_motion(&clip, (0, ROWS), 7, EXACT);
    assert_eq!(clip.measured.stamps_ns[0], 1_700_000_000_990_000_000);
}
