//! ROS 1 bags (version 2.0): records front to back, chunks as they are, in bzip2 or in LZ4. The index is not needed, so that a bag
//! reads whose recorder was killed (`.bag.active`). Memory holds one chunk at a time.
//!
//! The format is that of <http://wiki.ros.org/Bags/Format/2.0>.

use super::{go_on, stem};
use crate::error::ImportError;
use crate::log::{Facts, Log};
use crate::ros::{Collector, Encoding, Incoming};
use shared_mem::budget::{self, Budget, BudgetError};
use shared_mem::input::Packing;
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

/// A bag as it is read.
struct Bag<'a> {
    path: &'a Path,
    collector: Collector<'a>,
    connections: Connections,
    /// What is missing of it, in the order of the file.
    missing: Vec<String>,
    /// Chunks that were unpacked, and those that its header says it has.
    chunks: u32,
    expected: Option<u32>,
    /// Chunks that could not be unpacked, and their bytes.
    lost: [u64; 2],
}

/// Why a record is not taken over.
enum Bad {
    /// It is cut or has changed.
    Record,
    Budget(BudgetError),
}

impl From<BudgetError> for Bad {
    fn from(over: BudgetError) -> Self {
        Self::Budget(over)
    }
}

pub(super) fn read(path: &Path, budget: &Budget) -> Result<Log, ImportError> {
    let file = shared_mem::input::open(path)?;
    let length = file.metadata().map_or(0, |about| about.len());
    let mut source = BufReader::with_capacity(1 << 16, file);
    let mut magic = [0; MAGIC.len()];
    let is_whole = source.read_exact(&mut magic).is_ok();
    if is_whole && magic != MAGIC {
        let what = "is a bag of another version than 2.0; `rosbag fix` or `rosbag reindex` writes one of 2.0";
        return Err(ImportError::log(path, what));
    }
    let mut bag = Bag {
        path,
        collector: Collector::new(Encoding::Ros1, budget),
        connections: Connections::new(),
        missing: Vec::new(),
        chunks: 0,
        expected: None,
        lost: [0; 2],
    };
    let at = bag.records(&mut source)?;
    if at < length {
        bag.missing.push(format!("the file is cut or damaged from byte {at} of {length} on"));
    }
    bag.log(is_whole)
}

impl Bag<'_> {
    /// Takes records over to the last whole one; where the file is damaged from there on.
    fn records(&mut self, source: &mut impl Read) -> Result<u64, ImportError> {
        let mut at = MAGIC.len() as u64;
        while let Ok(Some((header, data))) = record(source) {
            go_on(self.path)?;
            match Fields::parse(&header).ok_or(Bad::Record).and_then(|fields| self.record(&fields, &data)) {
                Ok(()) => at += (header.len() + data.len() + 8) as u64,
                Err(Bad::Record) => break,
                Err(Bad::Budget(over)) => return Err(ImportError::budget(self.path)(over)),
            }
        }
        Ok(at)
    }

    /// A record that stands by itself.
    fn record(&mut self, fields: &Fields<'_>, data: &[u8]) -> Result<(), Bad> {
        match fields.op().ok_or(Bad::Record)? {
            op::BAG => self.expected = fields.number("chunk_count").filter(|count| *count > 0),
            op::CHUNK => match self.chunk(fields, data) {
                Err(Bad::Record) => self.lost = [self.lost[0] + 1, self.lost[1] + data.len() as u64],
                other => other?,
            },
            op::CONNECTION | op::MESSAGE => self.message(fields, data)?,
            op::INDEX | op::CHUNK_INFO => {}
            _ => return Err(Bad::Record),
        }
        Ok(())
    }

    fn chunk(&mut self, fields: &Fields<'_>, data: &[u8]) -> Result<(), Bad> {
        self.chunks += 1;
        let size = fields.number("size").ok_or(Bad::Record)? as usize;
        let compression = fields.get("compression").ok_or(Bad::Record)?;
        let bytes = unpack(data, compression, size).ok_or(Bad::Record)?;
        let mut inside = &bytes[..];
        while let Some((header, data)) = record(&mut inside).map_err(|Cut| Bad::Record)? {
            let fields = Fields::parse(&header).ok_or(Bad::Record)?;
            self.message(&fields, &data)?;
        }
        Ok(())
    }

    /// A connection, or a message of one.
    fn message(&mut self, fields: &Fields<'_>, data: &[u8]) -> Result<(), Bad> {
        // Records without a message in them are steps, too.
        self.collector.budget().step(STEPS_OF_A_RECORD)?;
        let id = fields.number("conn").ok_or(Bad::Record);
        match fields.op() {
            Some(op::CONNECTION) => {
                self.collector.budget().take(data.len() + size_of::<Connection>())?;
                let about = Fields::parse(data).ok_or(Bad::Record)?;
                let text =
                    |bytes: Option<&[u8]>| bytes.map(|b| String::from_utf8_lossy(b).into_owned()).ok_or(Bad::Record);
                let connection = Connection {
                    topic: text(fields.get("topic"))?,
                    type_name: text(about.get("type"))?,
                    definition: about.get("message_definition").ok_or(Bad::Record)?.to_vec(),
                };
                self.connections.insert(id?, connection);
                Ok(())
            }
            Some(op::MESSAGE) => {
                let connection = self.connections.get(&id?).ok_or(Bad::Record)?;
                let time = fields.get("time").and_then(|t| t.first_chunk::<8>()).ok_or(Bad::Record)?;
                let [seconds, rest] = [0, 4]
                    .map(|at| u64::from(u32::from_le_bytes([time[at], time[at + 1], time[at + 2], time[at + 3]])));
                let incoming = Incoming {
                    topic: &connection.topic,
                    type_name: &connection.type_name,
                    definition: &connection.definition,
                    log_time_ns: seconds * 1_000_000_000 + rest,
                    data,
                };
                Ok(self.collector.take(&incoming)?)
            }
            Some(op::INDEX) => Ok(()),
            _ => Err(Bad::Record),
        }
    }

    /// What was read; an error where nothing is left.
    fn log(mut self, is_whole: bool) -> Result<Log, ImportError> {
        let [chunks, bytes] = self.lost;
        if chunks > 0 {
            self.missing
                .push(format!("{chunks} of {} chunks ({bytes} bytes) cannot be unpacked or are damaged", self.chunks));
        }
        // A bag that was closed says how many chunks it has.
        if let Some(expected) = self.expected.filter(|expected| *expected != self.chunks) {
            self.missing.push(format!("{} of the {expected} chunks that it should have are there", self.chunks));
        }
        let (tables, left_out) = self.collector.finish();
        if tables.is_empty() && (!is_whole || !self.missing.is_empty()) {
            let what = "is cut or damaged, and nothing of a robot is left of it; copy it from its source again, or leave it out";
            return Err(ImportError::log(self.path, what));
        }
        let missing = self.missing.join("; ");
        let warnings = if missing.is_empty() { vec![] } else { vec![format!("{missing}; what is whole is read")] };
        let franka = tables.iter().any(|table| table.name.contains("franka"));
        let torque = franka.then_some((true, "franka_ros publishes tau_J, which holds gravity"));
        Ok(Log {
            file: self.path.to_owned(),
            name: stem(self.path),
            format: "ROS 1 bag",
            tables,
            facts: Facts { franka, torque, ..Facts::default() },
            left_out,
            warnings,
            ..Log::default()
        })
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
    let packing = match compression {
        b"none" => return (data.len() == size).then(|| data.to_vec()),
        b"bz2" => Packing::Bzip2,
        b"lz4" => Packing::Lz4,
        _ => return None,
    };
    packing.unpack(data, size as u64).ok().filter(|bytes| bytes.len() == size)
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
