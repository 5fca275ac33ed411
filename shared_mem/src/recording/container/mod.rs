//! Messages of an MCAP file in the order they were written, from files that may be cut or have changed bits.
//!
//! Chunk checksums are compared before a message of the chunk is believed; a bad chunk is skipped and told in
//! [`Messages::damage`]. Memory holds one chunk at a time, and what rides along within the budget of the file.

mod fields;
mod framing;
#[cfg(test)]
mod tests;

pub(super) use framing::Damage;

use super::error::ReadError;
use crate::budget::{self, Budget, BudgetError};
use crate::input::Packing;
use crate::{ending, input};
use fields::{Chunk, Fields};
use framing::{Framing, PREFIX, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How the messages of a topic are encoded.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Schema {
    /// Type: `sensor_msgs/msg/JointState`, `foxglove.PoseInFrame`.
    pub(super) name: String,
    /// `ros2msg`, `protobuf`.
    pub(super) encoding: String,
    /// Definition of the type in that encoding.
    pub(super) data: Vec<u8>,
}

/// A topic of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Channel {
    pub(super) topic: String,
    /// `cdr`, `protobuf`.
    pub(super) encoding: String,
    /// `None` where the file names no type.
    pub(super) schema: Option<Arc<Schema>>,
    pub(super) metadata: BTreeMap<String, String>,
}

impl Channel {
    /// Name of the type, empty where the file names none.
    pub(super) fn type_name(&self) -> &str {
        self.schema.as_ref().map_or("", |schema| &schema.name)
    }
}

/// One message.
#[derive(Debug, Clone, Copy)]
pub(super) struct Message<'a> {
    pub(super) channel: &'a Arc<Channel>,
    pub(super) sequence: u32,
    /// Unix time [ns].
    pub(super) log_time_ns: u64,
    /// Unix time [ns].
    pub(super) publish_time_ns: u64,
    pub(super) data: &'a [u8],
}

/// A file that rides along.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Attachment {
    pub(super) log_time_ns: u64,
    pub(super) create_time_ns: u64,
    pub(super) name: String,
    pub(super) media_type: String,
    pub(super) data: Vec<u8>,
}

/// Named text that rides along.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Metadata {
    pub(super) name: String,
    pub(super) pairs: BTreeMap<String, String>,
}

/// Steps for a message: it is unpacked, looked up and decoded.
const STEPS_OF_A_MESSAGE: usize = 16;
/// What is kept of a record that rides along, beside its own bytes.
const OVERHEAD: usize = 256;
/// Messages of ROS 2; the first of their bytes is 0, and none of what is packed begins so. A bag recorded with
/// `--compression-mode message` says `cdr` all the same.
const CDR: &str = "cdr";
/// Bytes that are unpacked in a step: some nanoseconds.
const BYTES_OF_A_STEP: usize = 8;

/// Where a message of the current chunk lies in `Messages::bytes`.
#[derive(Debug, Clone)]
struct Entry {
    channel: Arc<Channel>,
    sequence: u32,
    log_time_ns: u64,
    publish_time_ns: u64,
    data: Range<usize>,
}

/// Reads the messages of a file one by one.
#[derive(Debug)]
pub(super) struct Messages<R> {
    path: PathBuf,
    framing: Framing<R>,
    schemas: HashMap<u16, Arc<Schema>>,
    channels: HashMap<u16, Arc<Channel>>,
    /// A chunk was seen.
    chunked: bool,
    /// Message bytes of the current chunk, one after the other.
    bytes: Vec<u8>,
    /// How many of them came out of messages that were packed one by one.
    unpacked: usize,
    entries: Vec<Entry>,
    next: usize,
    /// What is left for this file.
    budget: Budget,
    /// Why nothing more is read.
    spent: Option<BudgetError>,
    /// Attachments met so far.
    pub(super) attachments: Vec<Attachment>,
    /// Metadata met so far.
    pub(super) metadata: Vec<Metadata>,
}

impl Messages<BufReader<File>> {
    /// Opens a file.
    pub(super) fn open(path: &Path) -> Result<Self, ReadError> {
        let file = input::open(path)?;
        if file.metadata().is_ok_and(|about| about.is_file() && about.len() == 0) {
            let what = "is empty: its recorder ended before it wrote anything; record the clip again";
            return Err(ReadError::kind(path, what));
        }
        Self::from_source(BufReader::with_capacity(1 << 16, file), path)
    }
}

impl<R: Read + Seek> Messages<R> {
    /// Reads from any source; `path` only names it in errors.
    pub(super) fn from_source(source: R, path: &Path) -> Result<Self, ReadError> {
        let framing = Framing::open(source).map_err(ReadError::io(path))?.ok_or_else(|| {
            let what = "is no MCAP file; record one with `rt_bridge record --out clip.mcap` or `ros2 bag record -s mcap -a`; \
                        other logs (bags of sqlite3 or ROS 1, CSV, npz, LeRobot, libfranka, SAGE) become a session with \
                        `calibration import FILE --out session`";
            ReadError::kind(path, what)
        })?;
        Ok(Self {
            path: path.to_owned(),
            budget: Budget::of(framing.length),
            spent: None,
            framing,
            schemas: HashMap::new(),
            channels: HashMap::new(),
            chunked: false,
            bytes: Vec::new(),
            unpacked: 0,
            entries: Vec::new(),
            next: 0,
            attachments: Vec::new(),
            metadata: Vec::new(),
        })
    }

    /// The next message, `None` behind the last.
    pub(super) fn next(&mut self) -> Result<Option<Message<'_>>, ReadError> {
        Ok(if self.advance()? { self.current() } else { None })
    }

    /// Goes to the next message; false behind the last.
    pub(super) fn advance(&mut self) -> Result<bool, ReadError> {
        let there = self.peek()?.is_some();
        self.next += usize::from(there);
        Ok(there)
    }

    /// The message that [`Messages::advance`] went to.
    pub(super) fn current(&self) -> Option<Message<'_>> {
        self.message(self.next.checked_sub(1)?)
    }

    /// The message that [`Messages::advance`] will go to.
    pub(super) fn peek(&mut self) -> Result<Option<Message<'_>>, ReadError> {
        while self.next >= self.entries.len() {
            if ending::asked() {
                return Err(ReadError::Interrupted { path: self.path.clone() });
            }
            let loaded = self.load().map_err(ReadError::io(&self.path))?;
            if let Some(spent) = self.spent {
                return Err(ReadError::budget(&self.path)(spent));
            }
            if !loaded {
                return Ok(None);
            }
        }
        Ok(self.message(self.next))
    }

    fn message(&self, index: usize) -> Option<Message<'_>> {
        self.entries.get(index).map(|entry| Message {
            channel: &entry.channel,
            sequence: entry.sequence,
            log_time_ns: entry.log_time_ns,
            publish_time_ns: entry.publish_time_ns,
            data: self.bytes.get(entry.data.clone()).unwrap_or(&[]),
        })
    }

    /// Goes to the end for what rides along alone: chunks are passed over unopened, and the messages are gone.
    pub(super) fn skim(&mut self) -> Result<(), ReadError> {
        while let Some(opcode) = self.framing.advance().map_err(ReadError::io(&self.path))? {
            if ending::asked() {
                return Err(ReadError::Interrupted { path: self.path.clone() });
            }
            if opcode == op::METADATA {
                let record = std::mem::take(&mut self.framing.record);
                // The framing has looked at its lengths.
                let _whole = self.record(opcode, record.get(PREFIX..).unwrap_or(&[]));
                self.framing.record = record;
            }
        }
        Ok(())
    }

    /// What is left for what is made of this file.
    pub(super) fn budget(&self) -> &Budget {
        &self.budget
    }

    /// What could not be read so far.
    pub(super) fn damage(&self) -> &Damage {
        &self.framing.damage
    }

    /// Whether a topic was met so far, with or without messages.
    pub(super) fn has(&self, topic: &str) -> bool {
        self.channels.values().any(|channel| channel.topic == topic)
    }

    /// Topics and types met so far, for errors: `/a (type), /b (type)`.
    pub(super) fn present(&self) -> String {
        let topics: BTreeMap<&str, &str> =
            self.channels.values().map(|channel| (channel.topic.as_str(), channel.type_name())).collect();
        if topics.is_empty() {
            return "no topics at all".into();
        }
        topics.iter().map(|(topic, name)| format!("`{topic}` ({name})")).collect::<Vec<_>>().join(", ")
    }

    /// Loads the next record that may bring messages; false behind the last.
    fn load(&mut self) -> std::io::Result<bool> {
        self.clear();
        let Some(opcode) = self.framing.advance()? else { return Ok(false) };
        let record = std::mem::take(&mut self.framing.record);
        let body = record.get(PREFIX..).unwrap_or(&[]);
        let mut read = self.take_over(opcode, &record, body);
        if read.is_err() && self.spent.is_none() && self.channels_from_summary()? {
            // The chunk that introduced the topics was lost; now they are known.
            self.clear();
            read = self.take_over(opcode, &record, body);
        }
        self.framing.record = record;
        if let Err(what) = read {
            let lost = self.framing.record.len() as u64;
            self.framing.damage.add(lost, format!("{what}: {lost} bytes are skipped"));
        }
        Ok(true)
    }

    /// Lets go of the messages of the record before.
    fn clear(&mut self) {
        self.bytes.clear();
        self.budget.give_back(std::mem::take(&mut self.unpacked));
        self.entries.clear();
        self.next = 0;
    }

    fn take_over(&mut self, opcode: u8, record: &[u8], body: &[u8]) -> Result<(), String> {
        match opcode {
            op::CHUNK => {
                self.chunked = true;
                self.chunk(record, body)
            }
            op::ATTACHMENT => self.attachment(body).ok_or_else(|| "an attachment has changed".into()),
            // Files have chunks or they have not: beside chunks, this is a chunk's inside laid bare by a changed length,
            // without the checksum that vouched for it.
            op::MESSAGE if self.chunked => Err("a message outside of the chunks".into()),
            op::SCHEMA | op::CHANNEL if self.chunked => Ok(()),
            _ => self.record(opcode, body).ok_or_else(|| "a record has changed".into()),
        }
    }

    /// Unpacks a chunk and takes its records over, all or, where the chunk has no checksum, up to the first bad one.
    fn chunk(&mut self, record: &[u8], body: &[u8]) -> Result<(), String> {
        let chunk = Chunk::parse(body).ok_or("a chunk's header has changed")?;
        if chunk.compression.is_empty() {
            let calculated = crc32fast::hash(chunk.records);
            if chunk.uncompressed_crc != 0 && calculated != chunk.uncompressed_crc {
                return Err("a chunk's checksum does not match".into());
            }
            return self.records(chunk.records).ok_or_else(|| "a chunk ends inside a record".into());
        }
        let limit = budget::unpacked(chunk.records.len());
        if chunk.uncompressed_size > limit {
            return Err("a chunk's size has changed".into());
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(limit as usize);
        let mut reader = LinearReader::new_with_options(options);
        let mut rest = record;
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| format!("a chunk cannot be unpacked ({error})"))? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let (head, tail) = rest.split_at(wanted.min(rest.len()));
                    reader.insert(head.len()).copy_from_slice(head);
                    reader.notify_read(head.len());
                    rest = tail;
                }
                LinearReadEvent::Record { opcode, data } => {
                    self.record(opcode, data).ok_or("a record in a chunk makes no sense")?;
                }
            }
        }
        Ok(())
    }

    /// Takes over records that stand one after the other.
    fn records(&mut self, records: &[u8]) -> Option<()> {
        let mut fields = Fields(records);
        while !fields.0.is_empty() {
            let opcode = fields.u8()?;
            let body = fields.long_bytes()?;
            self.record(opcode, body)?;
        }
        Some(())
    }

    /// Draws from the budget; `None` when it is spent.
    fn draw(&mut self, drawn: impl FnOnce(&Budget) -> Result<(), BudgetError>) -> Option<()> {
        drawn(&self.budget).map_err(|spent| self.spent = Some(spent)).ok()
    }

    /// Takes one record over; `None` when it makes no sense, or the budget is spent.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Option<()> {
        let mut f = Fields(body);
        match opcode {
            op::MESSAGE => self.draw(|budget| budget.step(STEPS_OF_A_MESSAGE))?,
            op::SCHEMA | op::CHANNEL | op::METADATA => self.draw(|budget| budget.take(body.len() + OVERHEAD))?,
            _ => self.draw(|budget| budget.step(1))?,
        }
        match opcode {
            op::SCHEMA => {
                let id = f.u16()?;
                let (name, encoding) = (f.text()?.to_owned(), f.text()?.to_owned());
                let data = f.bytes()?.to_vec();
                self.schemas.insert(id, Arc::new(Schema { name, encoding, data }));
            }
            op::CHANNEL => {
                let id = f.u16()?;
                let schema = self.schemas.get(&f.u16()?).cloned();
                let (topic, encoding) = (f.text()?.to_owned(), f.text()?.to_owned());
                let metadata = f.text_map()?;
                self.channels.insert(id, Arc::new(Channel { topic, encoding, schema, metadata }));
            }
            op::MESSAGE => {
                let channel = Arc::clone(self.channels.get(&f.u16()?)?);
                let (sequence, log_time_ns, publish_time_ns) = (f.u32()?, f.u64()?, f.u64()?);
                let start = self.bytes.len();
                match Packing::of(f.0).filter(|_| channel.encoding == CDR) {
                    Some(packing) => self.unpack(packing, f.0)?,
                    None => self.bytes.extend_from_slice(f.0),
                }
                let data = start..self.bytes.len();
                self.entries.push(Entry { channel, sequence, log_time_ns, publish_time_ns, data });
            }
            op::METADATA => {
                let (name, pairs) = (f.text()?.to_owned(), f.text_map()?);
                self.metadata.push(Metadata { name, pairs });
            }
            _ => {}
        }
        Some(())
    }

    /// Puts what is in a packed message behind the others of its chunk; one that cannot be unpacked stays as it is.
    fn unpack(&mut self, packing: Packing, packed: &[u8]) -> Option<()> {
        let Ok(data) = packing.unpack(packed, budget::unpacked(packed.len())) else {
            self.bytes.extend_from_slice(packed);
            return Some(());
        };
        self.draw(|budget| budget.step(data.len() / BYTES_OF_A_STEP).and_then(|()| budget.take(data.len())))?;
        self.unpacked += data.len();
        self.bytes.extend_from_slice(&data);
        Some(())
    }

    fn attachment(&mut self, body: &[u8]) -> Option<()> {
        self.draw(|budget| budget.take(body.len() + OVERHEAD))?;
        let mut f = Fields(body);
        let (log_time_ns, create_time_ns) = (f.u64()?, f.u64()?);
        let (name, media_type) = (f.text()?.to_owned(), f.text()?.to_owned());
        let data = f.long_bytes()?.to_vec();
        let covered = body.len().checked_sub(f.0.len())?;
        let saved = f.u32()?;
        if saved != 0 && crc32fast::hash(body.get(..covered)?) != saved {
            return None;
        }
        self.attachments.push(Attachment { log_time_ns, create_time_ns, name, media_type, data });
        Some(())
    }

    /// A complete file repeats its topics at its end; true when some of them were not known.
    fn channels_from_summary(&mut self) -> std::io::Result<bool> {
        let known = self.channels.len();
        let summary = self.framing.summary()?;
        let mut fields = Fields(&summary);
        while let (Some(opcode), Some(body)) = (fields.u8(), fields.long_bytes()) {
            if matches!(opcode, op::SCHEMA | op::CHANNEL) && self.record(opcode, body).is_none() {
                break;
            }
        }
        Ok(self.channels.len() > known)
    }
}
