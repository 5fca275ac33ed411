//! Rewrites a cut or changed recording, so that any MCAP reader opens it. Works on own clips and on foreign bags.

use super::container::{Channel, Message, Messages};
use super::error::ReadError;
use super::writer::WriteError;
use crate::output::Output;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{BufWriter, IntoInnerError, Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What came out of a damaged file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovered {
    /// The new file.
    pub path: PathBuf,
    /// Messages in it.
    pub messages: u64,
    /// Bytes of the old file that could not be read.
    pub lost_bytes: u64,
    /// What was wrong with the old file; `None` when it was whole.
    pub damage: Option<String>,
}

/// A file cannot be recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The old file.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The new file.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Writes everything that is whole in `path` to `NAME_recovered.mcap` beside it; the old file is left alone.
///
/// # Errors
/// [`RecoverError`] when the old file is missing or no MCAP file, when the new one exists already, or the disk is full.
pub fn recover(path: &Path) -> Result<Recovered, RecoverError> {
    let mut messages = Messages::open(path)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let out = path.with_file_name(format!("{stem}_recovered.mcap"));
    let failed = |error: McapError| WriteError::from_mcap(&out, 0, &error);
    let output = Output::create_new(&out).map_err(WriteError::from)?;
    let mut copy = Copy::new(output).map_err(failed)?;
    while messages.advance()? {
        // In their old place: readers look for them before the first message.
        copy.ride_along(&mut messages).map_err(failed)?;
        if let Some(message) = messages.current() {
            copy.message(&message).map_err(failed)?;
        }
    }
    copy.ride_along(&mut messages).map_err(failed)?;
    let (count, output) = copy.finish().map_err(failed)?;
    output.finish().map_err(WriteError::from)?;
    let damage = messages.damage();
    Ok(Recovered { path: out, messages: count, lost_bytes: damage.lost_bytes, damage: damage.summary() })
}

/// The new file.
struct Copy {
    mcap: mcap::Writer<NoSeek<BufWriter<Output>>>,
    /// New numbers of the old channels.
    ids: HashMap<*const Channel, u16>,
    /// Keeps the channels of `ids` alive, so that an address names one channel.
    channels: Vec<Arc<Channel>>,
    messages: u64,
}

impl Copy {
    fn new(output: Output) -> Result<Self, McapError> {
        let mcap = WriteOptions::new()
            .library(concat!("twinalign ", env!("CARGO_PKG_VERSION"), " (recovered)"))
            .compression(Some(Compression::Lz4))
            .compression_threads(0)
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(output)))?;
        Ok(Self { mcap, ids: HashMap::new(), channels: Vec::new(), messages: 0 })
    }

    fn message(&mut self, message: &Message<'_>) -> Result<(), McapError> {
        let channel_id = match self.ids.get(&Arc::as_ptr(message.channel)) {
            Some(id) => *id,
            None => self.channel(message.channel)?,
        };
        self.messages += 1;
        let header = MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.log_time_ns,
            publish_time: message.publish_time_ns,
        };
        self.mcap.write_to_known_channel(&header, message.data)
    }

    fn channel(&mut self, channel: &Arc<Channel>) -> Result<u16, McapError> {
        let schema = match &channel.schema {
            Some(schema) => self.mcap.add_schema(&schema.name, &schema.encoding, &schema.data)?,
            None => 0,
        };
        let id = self.mcap.add_channel(schema, &channel.topic, &channel.encoding, &channel.metadata)?;
        self.ids.insert(Arc::as_ptr(channel), id);
        self.channels.push(Arc::clone(channel));
        Ok(id)
    }

    /// Writes what rides along and was met since the last call.
    fn ride_along<R: Read + Seek>(&mut self, messages: &mut Messages<R>) -> Result<(), McapError> {
        for m in messages.metadata.drain(..) {
            self.mcap.write_metadata(&Metadata { name: m.name, metadata: m.pairs })?;
        }
        for a in messages.attachments.drain(..) {
            self.mcap.attach(&Attachment {
                log_time: a.log_time_ns,
                create_time: a.create_time_ns,
                name: a.name,
                media_type: a.media_type,
                data: Cow::Owned(a.data),
            })?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<(u64, Output), McapError> {
        self.mcap.finish()?;
        let output = self.mcap.into_inner().into_inner().into_inner().map_err(IntoInnerError::into_error)?;
        Ok((self.messages, output))
    }
}
