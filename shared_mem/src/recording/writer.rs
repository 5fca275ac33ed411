//! Writes own clips. Called by the recorder of the bridge, `twin replay --out`, `rt_bridge convert` and the export.
//!
//! A live recording ([`ClipWriter::create`]) is there from the beginning and only grows: a chunk reaches it whole, so a
//! killed writer loses what came after its last [`ClipWriter::flush`] and nothing else. Reading needs neither the index
//! nor the footer that [`ClipWriter::finish`] adds. Every other clip ([`ClipWriter::whole`]) is an [`Output`]: there
//! when it is finished, or not at all.

mod error;
mod records;
mod shown;

pub use error::WriteError;

use super::wire::{self, UnixClock, Wire};
use super::{origins, torques};
use crate::cell::Cell;
use crate::msg::image::ImageHeader;
use crate::msg::origin::ArmOrigin;
use crate::origin::Origins;
use crate::output::Output;
use crate::topics::ImageTopic;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions};
use shown::Shown;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Metadata record and attachment that every own clip carries.
pub(super) const METADATA: &str = "twinalign";
pub(super) const CELL_TOML: &str = "cell.toml";
/// Keys of the metadata record.
pub(super) const PROGRAM: &str = "program";
pub(super) const CONFIGURATION: &str = "configuration";
pub(super) const UNIX_OFFSET_NS: &str = "unix_offset_ns";
/// A chunk is closed when it holds this much [bytes]: 3 s of one arm, or one to two pictures.
const CHUNK_SIZE: u64 = 4 << 20;

/// What rides along with a clip.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ClipInfo {
    /// Text of the cell.toml in force.
    pub cell_toml: Option<String>,
    /// Effective configuration of the program that records, as TOML.
    pub configuration: String,
    /// Name and version of that program.
    pub program: String,
    /// Whether the torques of a state act from its stamp on, and not until it as those that a robot reports: see
    /// [`Clip::torques_end_at_rows`](super::Clip::torques_end_at_rows).
    pub torques_begin_at_rows: bool,
    /// Where the clip comes from, as far as it is known from the beginning; the states of an arm say it themselves.
    pub origins: Origins,
}

/// What a finished clip holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriteSummary {
    /// Messages.
    pub messages: u64,
    /// Size of the file.
    pub bytes: u64,
}

/// Counts what reaches the file.
#[derive(Debug)]
struct Counted<W> {
    sink: W,
    bytes: Arc<AtomicU64>,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.sink.write(bytes)?;
        self.bytes.fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

/// A topic that was written to.
#[derive(Debug, Clone, Copy)]
struct Channel {
    id: u16,
    sequence: u32,
}

/// Writes one clip.
///
/// A clip of three rows, written and read back:
///
/// ```
/// use shared_mem::cell::{Cell, ClipKind};
/// use shared_mem::msg::arm::ArmState;
/// use shared_mem::output::Output;
/// use shared_mem::recording::{ClipInfo, ClipWriter, read_clip};
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("clip.mcap");
/// let text = "[robot]\nmodel = \"fr3\"\n";
/// let info = ClipInfo { cell_toml: Some(text.into()), program: "example".into(), ..ClipInfo::default() };
/// let mut writer = ClipWriter::whole(Output::create(&file)?, &info)?;
/// for row in 0..3u64 {
///     let mut state = ArmState { stamp_ns: 1 + row * 1_000_000, dof: 7, ..ArmState::default() };
///     state.q[0] = 0.1 * row as f64; // rad
///     writer.arm_state(&state)?;
/// }
/// assert!(!file.exists(), "it gets its name when it is whole");
/// writer.finish()?;
///
/// let cell = Cell::parse(text, &folder.path().join("cell.toml"))?;
/// let clip = read_clip(&file, ClipKind::Excitation, &cell)?;
/// assert_eq!((clip.measured.len(), clip.measured.dof), (3, 7));
/// assert_eq!(clip.measured.q_row(2)[0], 0.2);
/// assert!((clip.measured.duration() - 2e-3).abs() < 1e-9); // s
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ClipWriter<W: Write = File> {
    path: PathBuf,
    mcap: mcap::Writer<NoSeek<BufWriter<Counted<W>>>>,
    clock: UnixClock,
    channels: HashMap<String, Channel>,
    messages: u64,
    bytes: Arc<AtomicU64>,
    /// Name of the frame that the object's poses are in.
    base_frame: String,
    /// The robot that viewers are shown.
    shown: Option<Shown>,
    /// Where the clip comes from, as far as it says so already.
    origins: Origins,
    /// What the last state said about that.
    origin: ArmOrigin,
    /// Encoded message, reused.
    scratch: Vec<u8>,
}

impl ClipWriter<File> {
    /// Creates a clip. An existing file is never overwritten.
    ///
    /// # Errors
    /// [`WriteError::Create`] when the file exists or cannot be created, else as the other methods.
    pub fn create(path: &Path, info: &ClipInfo) -> Result<Self, WriteError> {
        let file = File::create_new(path).map_err(|source| WriteError::Create { path: path.to_owned(), source })?;
        Self::with_sink(file, path, info)
    }
}

impl ClipWriter<Output> {
    /// Writes a clip that is there when it is finished, or not at all.
    ///
    /// # Errors
    /// [`WriteError::Output`] when the disk refuses the first bytes.
    pub fn whole(output: Output, info: &ClipInfo) -> Result<Self, WriteError> {
        let path = output.path().to_owned();
        Self::with_sink(output, &path, info)
    }

    /// The same for messages whose stamps are Unix time, as those of a recording made elsewhere: before this machine was
    /// started there is no monotonic time for them.
    ///
    /// # Errors
    /// As [`Self::whole`].
    pub fn whole_in_unix_time(output: Output, info: &ClipInfo) -> Result<Self, WriteError> {
        let path = output.path().to_owned();
        Self::with_clock(output, &path, info, UnixClock(0))
    }

    /// Completes the clip and gives it its name.
    ///
    /// # Errors
    /// [`WriteError::Output`]; nothing of it is there then.
    pub fn finish(self) -> Result<WriteSummary, WriteError> {
        let (summary, output) = self.close()?;
        output.finish()?;
        Ok(summary)
    }
}

impl ClipWriter<File> {
    /// Completes the file with index and footer, and takes it to the disk.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn finish(self) -> Result<WriteSummary, WriteError> {
        let path = self.path.clone();
        let (summary, file) = self.close()?;
        file.sync_all().map_err(|error| WriteError::from_mcap(&path, summary.bytes, &error.into()))?;
        Ok(summary)
    }
}

impl<W: Write> ClipWriter<W> {
    /// Writes to any sink; `path` only names it in errors.
    ///
    /// # Errors
    /// [`WriteError`] when the sink refuses the first bytes.
    pub fn with_sink(sink: W, path: &Path, info: &ClipInfo) -> Result<Self, WriteError> {
        Self::with_clock(sink, path, info, UnixClock(crate::time::unix_offset_ns()))
    }

    fn with_clock(sink: W, path: &Path, info: &ClipInfo, clock: UnixClock) -> Result<Self, WriteError> {
        let bytes = Arc::new(AtomicU64::new(0));
        let failed = |error: McapError| WriteError::from_mcap(path, bytes.load(Ordering::Relaxed), &error);
        let counted = Counted { sink, bytes: Arc::clone(&bytes) };
        let mcap = WriteOptions::new()
            .library(concat!("twinalign ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .compression_threads(0)
            .chunk_size(Some(CHUNK_SIZE))
            // Chunks are put together in memory: the file never holds one whose header is not true yet.
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(counted)))
            .map_err(failed)?;
        // A cell.toml that cannot be read names no frame; whoever reads the clip is told what is wrong with it.
        let cell = info.cell_toml.as_deref().and_then(|text| Cell::parse(text, path).ok()).unwrap_or_default();
        let (path, base_frame, channels) = (path.to_owned(), cell.base_frame().to_owned(), HashMap::new());
        let mut writer = Self {
            path,
            mcap,
            clock,
            channels,
            messages: 0,
            bytes,
            base_frame,
            shown: None,
            origins: info.origins.clone(),
            origin: ArmOrigin::default(),
            scratch: Vec::new(),
        };
        writer.ride_along(info).map_err(|error| writer.failed(&error))?;
        Ok(writer)
    }

    fn ride_along(&mut self, info: &ClipInfo) -> Result<(), McapError> {
        let pairs = [
            (PROGRAM, info.program.clone()),
            (CONFIGURATION, info.configuration.clone()),
            (UNIX_OFFSET_NS, self.clock.0.to_string()),
        ];
        let metadata = pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        self.mcap.write_metadata(&Metadata { name: METADATA.into(), metadata })?;
        self.mcap.write_metadata(&torques::record(!info.torques_begin_at_rows))?;
        for origin in info.origins.iter() {
            self.mcap.write_metadata(&origins::record(origin))?;
        }
        if let Some(text) = &info.cell_toml {
            let now = self.clock.unix_ns(crate::time::now_ns());
            self.mcap.attach(&Attachment {
                log_time: now,
                create_time: now,
                name: CELL_TOML.into(),
                media_type: "application/toml".into(),
                data: Cow::Borrowed(text.as_bytes()),
            })?;
        }
        self.mcap.flush()
    }

    /// Says which arm the states from here on are of, where that is new.
    fn say_origin(&mut self, origin: &ArmOrigin) -> Result<(), WriteError> {
        if *origin == self.origin {
            return Ok(());
        }
        self.origin = *origin;
        match origin.origin() {
            Some(origin) if self.origins.add(origin.clone()) => self.note(&origins::record(&origin)),
            _ => Ok(()),
        }
    }

    /// A record about the clip as a whole.
    pub(super) fn note(&mut self, record: &Metadata) -> Result<(), WriteError> {
        self.mcap.write_metadata(record).map_err(|error| self.failed(&error))
    }

    /// Records a picture: its header and its pixels, rows of `header.stride` bytes.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn image(&mut self, topic: ImageTopic, header: &ImageHeader, pixels: &[u8]) -> Result<(), WriteError> {
        self.scratch.clear();
        wire::image_to_wire(header, pixels, self.clock, &mut self.scratch);
        self.put(topic.name, wire::IMAGE_SCHEMA, header.stamp_ns).map_err(|error| self.failed(&error))
    }

    fn message<T: Wire>(&mut self, message: &T) -> Result<(), WriteError> {
        self.encoded::<T>(message.stamp_ns(), &message.to_wire(self.clock))
    }

    fn encoded<T: Wire>(&mut self, stamp_ns: u64, message: &T::Message) -> Result<(), WriteError> {
        self.named(T::TOPIC, T::SCHEMA, stamp_ns, message)
    }

    /// Records a message whose topic no constant names.
    pub(super) fn named(
        &mut self,
        topic: &str,
        schema: &str,
        stamp_ns: u64,
        message: &impl prost::Message,
    ) -> Result<(), WriteError> {
        self.scratch.clear();
        let encoded = message.encode(&mut self.scratch);
        debug_assert!(encoded.is_ok(), "a vector grows as needed");
        self.put(topic, schema, stamp_ns).map_err(|error| self.failed(&error))
    }

    /// What makes Unix time of a stamp.
    pub(super) fn clock(&self) -> UnixClock {
        self.clock
    }

    /// Writes the scratch buffer as one message.
    fn put(&mut self, topic: &str, schema: &str, stamp_ns: u64) -> Result<(), McapError> {
        let known = self.channels.get(topic).copied();
        let channel = match known {
            Some(channel) => channel,
            None => self.open(topic, (schema, "protobuf", &wire::descriptor(schema)), "protobuf")?,
        };
        let time = self.clock.unix_ns(stamp_ns);
        let header =
            MessageHeader { channel_id: channel.id, sequence: channel.sequence, log_time: time, publish_time: time };
        self.mcap.write_to_known_channel(&header, &self.scratch)?;
        if let Some(channel) = self.channels.get_mut(topic) {
            channel.sequence = channel.sequence.wrapping_add(1);
        }
        self.messages += 1;
        Ok(())
    }

    /// A topic whose messages have a schema of this name, encoding and definition.
    fn open(&mut self, topic: &str, schema: (&str, &str, &[u8]), encoding: &str) -> Result<Channel, McapError> {
        let schema = self.mcap.add_schema(schema.0, schema.1, schema.2)?;
        let id = self.mcap.add_channel(schema, topic, encoding, &BTreeMap::new())?;
        let channel = Channel { id, sequence: 0 };
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }

    /// Closes the open chunk and hands everything to the operating system: a kill from here on loses only what comes
    /// later.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.mcap.flush().map_err(|error| self.failed(&error))
    }

    /// Adds index and footer, and gives the sink back.
    ///
    /// # Errors
    /// As [`ClipWriter::arm_state`].
    pub fn close(mut self) -> Result<(WriteSummary, W), WriteError> {
        let finished = self.mcap.finish().map(|_| ());
        finished.map_err(|error| self.failed(&error))?;
        let (mcap, path, bytes, messages) = (self.mcap, self.path, self.bytes, self.messages);
        let written = bytes.load(Ordering::Relaxed);
        let failed = |error: io::Error| WriteError::from_mcap(&path, written, &error.into());
        let mut buffer = mcap.into_inner().into_inner();
        buffer.flush().map_err(failed)?;
        let sink = buffer.into_inner().map_err(|error| failed(error.into_error()))?.sink;
        Ok((WriteSummary { messages, bytes: bytes.load(Ordering::Relaxed) }, sink))
    }

    /// Bytes that reached the file so far; what waits in the open chunk is not among them.
    pub fn bytes_written(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    fn failed(&self, error: &McapError) -> WriteError {
        WriteError::from_mcap(&self.path, self.bytes_written(), error)
    }
}
