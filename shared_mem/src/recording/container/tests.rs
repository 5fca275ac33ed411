//! Messages of files that say little and become much.

use super::*;
use std::io::Cursor;

/// Ten messages on a topic each, in chunks that are packed.
fn packed() -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Zstd))
        .repeat_schemas(false)
        .create(Cursor::new(Vec::new()))
        .expect("room");
    for number in 0..10 {
        let schema = writer.add_schema(&format!("Type{number}"), "ros2msg", &[b' '; 100_000]).expect("room");
        let channel = writer.add_channel(schema, &format!("/{number}"), "cdr", &BTreeMap::new()).expect("room");
        let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &[0; 8]).expect("room");
    }
    writer.finish().expect("room");
    writer.into_inner().into_inner()
}

fn read(bytes: &[u8], budget: Budget) -> Result<usize, ReadError> {
    let mut messages = Messages::from_source(Cursor::new(bytes), Path::new("clip.mcap")).expect("a clip");
    messages.budget = budget;
    let mut count = 0;
    while messages.next()?.is_some() {
        count += 1;
    }
    assert_eq!(*messages.damage(), Damage::default());
    Ok(count)
}

/// A hundred messages that are packed one by one.
fn packed_one_by_one(message: &[u8]) -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new().compression(None).create(Cursor::new(Vec::new())).expect("room");
    let channel = writer.add_channel(0, "/joint_states", "cdr", &BTreeMap::new()).expect("room");
    let data = Packing::with_zstd(message);
    for sequence in 0..100 {
        let header = mcap::records::MessageHeader { channel_id: channel, sequence, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &data).expect("room");
    }
    writer.finish().expect("room");
    writer.into_inner().into_inner()
}

#[test]
fn messages_that_were_packed_one_by_one_are_unpacked_within_the_budget() {
    let message = [&[0, 1, 0, 0][..], &[7; 100_000]].concat();
    let bytes = packed_one_by_one(&message);
    assert!(bytes.len() < 100_000, "{}", bytes.len());
    let mut messages = Messages::from_source(Cursor::new(&bytes), Path::new("bag.mcap")).expect("a bag");
    let mut count = 0;
    while let Some(read) = messages.next().expect("a message") {
        assert_eq!(read.data, message);
        count += 1;
    }
    assert_eq!(count, 100);
    // All of a chunk are there at once.
    let line = |memory, steps| read(&bytes, Budget::with(memory, steps)).expect_err("too little").to_string();
    assert!(line(5_000_000, 1 << 30).contains("becomes more than"));
    assert!(line(1 << 30, 500_000).contains("is not read after"));
}

#[test]
fn what_rides_along_in_a_packed_chunk_and_messages_without_bytes_are_drawn_from_the_budget() {
    let bytes = packed();
    assert!(bytes.len() < 100_000, "{}", bytes.len());
    assert_eq!(read(&bytes, Budget::of(bytes.len() as u64)).expect("a clip"), 10);
    let spent = |memory, steps| read(&bytes, Budget::with(memory, steps)).expect_err("too little").to_string();
    let line = spent(500_000, 1000);
    assert!(line.contains("clip.mcap: becomes more than") && !line.contains('\n'), "{line}");
    let line = spent(1 << 30, 100);
    assert!(line.contains("clip.mcap: is not read after") && !line.contains('\n'), "{line}");
}
