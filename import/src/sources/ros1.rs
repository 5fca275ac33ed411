//! ROS 1 bags (version 2.0): records front to back, chunks as they are, in bzip2 or in LZ4. The index is not needed. Memory
//! holds one chunk at a time.
//!
//! The format is that of <http://wiki.ros.org/Bags/Format/2.0>.

use super::{go_on, stem};
use crate::error::ImportError;
use crate::log::{Facts, Log};
use crate::ros::{Collector, Encoding, Incoming, Refused};
use shared_mem::budget::{self, Budget};
use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::Path;

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// The largest chunk or record that is believed [bytes]: recorders make chunks below a megabyte, or of one large picture.
const LARGEST: usize = 1 << 29;

/// A record is taken apart before anything is made of it.
const STEPS_OF_A_RECORD: usize = 16;

mod op {
    pub(super) const MESSAGE: u8 = 2;
    pub(super) const BAG: u8 = 3;
    pub(super) const INDEX: u8 = 4;
    pub(super) const CHUNK: u8 = 5;
    pub(super) const CHUNK_INFO: u8 = 6;
    pub(super) const CONNECTION: u8 = 7;
}

/// A topic with its type.
struct Connection {
    topic: String,
    type_name: String,
    definition: Vec<u8>,
}

type Connections = HashMap<u32, Connection>;

pub(super) fn read(path: &Path, budget: &Budget) -> Result<Log, ImportError> {
    let file = shared_mem::input::open(path)?;
    let mut source = BufReader::with_capacity(1 << 16, file);
    let cut = || {
        let what = "is cut or damaged; `rosbag reindex` mends a bag whose recorder was stopped, or leave it out";
        ImportError::log(path, what)
    };
    let mut magic = [0; MAGIC.len()];
    source.read_exact(&mut magic).map_err(|_| cut())?;
    if magic != MAGIC {
        let what = "is a bag of another version than 2.0; `rosbag fix` or `rosbag reindex` writes one of 2.0";
        return Err(ImportError::log(path, what));
    }
    let refused = |what: Option<Refused>| what.map_or_else(cut, |what| what.of(path));
    let mut collector = Collector::new(Encoding::Ros1, budget);
    let mut connections = Connections::new();
    let (mut chunks, mut expected) = (0_u32, None);
    while let Some((header, data)) = record(&mut source).map_err(|Cut| cut())? {
        go_on(path)?;
        let fields = Fields::parse(&header).ok_or_else(cut)?;
        match fields.op().ok_or_else(cut)? {
            op::BAG => expected = fields.number("chunk_count"),
            op::CHUNK => {
                chunks += 1;
                let size = fields.number("size").ok_or_else(cut)? as usize;
                let compression = fields.get("compression").ok_or_else(cut)?;
                let bytes = unpack(&data, compression, size).ok_or_else(cut)?;
                let mut inside = &bytes[..];
                while let Some((header, data)) = record(&mut inside).map_err(|Cut| cut())? {
                    let fields = Fields::parse(&header).ok_or_else(cut)?;
                    message(&fields, &data, &mut connections, &mut collector).map_err(refused)?;
                }
            }
            op::CONNECTION | op::MESSAGE => {
                message(&fields, &data, &mut connections, &mut collector).map_err(refused)?
            }
            op::INDEX | op::CHUNK_INFO => {}
            _ => return Err(cut()),
        }
    }
    // A bag that was closed says how many chunks it has.
    if expected.is_some_and(|expected| expected != chunks) {
        return Err(cut());
    }
    let (tables, left_out) = collector.finish();
    let franka = tables.iter().any(|table| table.name.contains("franka"));
    let torque = franka.then_some((true, "franka_ros publishes tau_J, which holds gravity"));
    Ok(Log {
        file: path.to_owned(),
        name: stem(path),
        format: "ROS 1 bag",
        tables,
        facts: Facts { franka, torque, ..Facts::default() },
        left_out,
        ..Log::default()
    })
}

/// A connection, or a message of one; `Err(None)` where the record is broken.
fn message(
    fields: &Fields<'_>,
    data: &[u8],
    connections: &mut Connections,
    collector: &mut Collector<'_>,
) -> Result<(), Option<Refused>> {
    // Records without a message in them are steps, too.
    let spent = |over| Some(Refused::Budget(over));
    collector.budget().step(STEPS_OF_A_RECORD).map_err(spent)?;
    let id = fields.number("conn");
    match fields.op() {
        Some(op::CONNECTION) => {
            collector.budget().take(data.len() + size_of::<Connection>()).map_err(spent)?;
            let about = Fields::parse(data).ok_or(None)?;
            let text = |bytes: Option<&[u8]>| bytes.map(|b| String::from_utf8_lossy(b).into_owned()).ok_or(None);
            let connection = Connection {
                topic: text(fields.get("topic"))?,
                type_name: text(about.get("type"))?,
                definition: about.get("message_definition").ok_or(None)?.to_vec(),
            };
            connections.insert(id.ok_or(None)?, connection);
            Ok(())
        }
        Some(op::MESSAGE) => {
            let connection = connections.get(&id.ok_or(None)?).ok_or(None)?;
            let time = fields.get("time").and_then(|t| t.first_chunk::<8>()).ok_or(None)?;
            let [seconds, rest] =
                [0, 4].map(|at| u64::from(u32::from_le_bytes([time[at], time[at + 1], time[at + 2], time[at + 3]])));
            let incoming = Incoming {
                topic: &connection.topic,
                type_name: &connection.type_name,
                definition: &connection.definition,
                log_time_ns: seconds * 1_000_000_000 + rest,
                data,
            };
            collector.take(&incoming).map_err(Some)
        }
        Some(op::INDEX) => Ok(()),
        _ => Err(None),
    }
}

/// The source ends within a record.
struct Cut;

/// Header and data.
type Record = (Vec<u8>, Vec<u8>);

/// The next record; `None` at the end.
fn record(source: &mut impl Read) -> Result<Option<Record>, Cut> {
    let mut first = [0; 1];
    if source.read(&mut first).map_err(|_| Cut)? == 0 {
        return Ok(None);
    }
    let mut rest = [0; 3];
    source.read_exact(&mut rest).map_err(|_| Cut)?;
    let header = part(source, [first[0], rest[0], rest[1], rest[2]])?;
    let mut length = [0; 4];
    source.read_exact(&mut length).map_err(|_| Cut)?;
    let data = part(source, length)?;
    Ok(Some((header, data)))
}

fn part(source: &mut impl Read, length: [u8; 4]) -> Result<Vec<u8>, Cut> {
    let length = u32::from_le_bytes(length) as usize;
    if length > LARGEST {
        return Err(Cut);
    }
    // Memory grows with what is there, and not with what a damaged length says.
    let mut bytes = Vec::new();
    source.take(length as u64).read_to_end(&mut bytes).map_err(|_| Cut)?;
    if bytes.len() == length { Ok(bytes) } else { Err(Cut) }
}

fn unpack(data: &[u8], compression: &[u8], size: usize) -> Option<Vec<u8>> {
    if size as u64 > budget::unpacked(data.len()) {
        return None;
    }
    let mut bytes = Vec::new();
    let limit = size as u64 + 1;
    match compression {
        b"none" => bytes.extend_from_slice(data),
        b"bz2" => drop(bzip2::read::BzDecoder::new(data).take(limit).read_to_end(&mut bytes).ok()?),
        b"lz4" => drop(lz4_flex::frame::FrameDecoder::new(data).take(limit).read_to_end(&mut bytes).ok()?),
        _ => return None,
    }
    (bytes.len() == size).then_some(bytes)
}

/// `name=value` fields, each behind its length.
struct Fields<'a>(Vec<(&'a [u8], &'a [u8])>);

impl<'a> Fields<'a> {
    fn parse(mut bytes: &'a [u8]) -> Option<Self> {
        let mut fields = Vec::new();
        while !bytes.is_empty() {
            let (length, rest) = bytes.split_first_chunk::<4>()?;
            let (field, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
            let at = field.iter().position(|b| *b == b'=')?;
            fields.push((&field[..at], &field[at + 1..]));
            bytes = rest;
        }
        Some(Self(fields))
    }

    fn get(&self, name: &str) -> Option<&'a [u8]> {
        self.0.iter().find(|(key, _)| *key == name.as_bytes()).map(|(_, value)| *value)
    }

    fn op(&self) -> Option<u8> {
        self.get("op").and_then(|value| value.first().copied())
    }

    fn number(&self, name: &str) -> Option<u32> {
        self.get(name)?.first_chunk::<4>().map(|bytes| u32::from_le_bytes(*bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut source = &bytes[..];
            while let Ok(Some((header, _))) = record(&mut source) {
                let _ = Fields::parse(&header);
            }
            let _ = unpack(&bytes, b"bz2", 1000);
            let _ = unpack(&bytes, b"lz4", 1000);
        }
    }
}
