//! Messages of an MCAP file as bytes, with their types' definitions: for readers of messages that no clip is made of.

use super::container::Messages;
use super::error::ReadError;
use super::origins;
use crate::origin::Origins;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// One message as it was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawMessage<'a> {
    /// Topic it was recorded on.
    pub topic: &'a str,
    /// Its type: `sensor_msgs/msg/JointState`; empty where the file names none.
    pub type_name: &'a str,
    /// How it is encoded: `cdr`, `ros1`, `protobuf`.
    pub encoding: &'a str,
    /// Definition of the type; empty where the file holds none.
    pub definition: &'a [u8],
    /// When it was recorded: Unix time [ns].
    pub log_time_ns: u64,
    /// Its bytes.
    pub data: &'a [u8],
}

/// Reads the messages of an MCAP file one by one, in the order they were written.
#[derive(Debug)]
pub struct RawMessages(Messages<BufReader<File>>);

impl RawMessages {
    /// Opens a file.
    ///
    /// # Errors
    /// [`ReadError`] when the file is missing or no MCAP file.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Ok(Self(Messages::open(path)?))
    }

    /// The next message, `None` behind the last.
    ///
    /// # Errors
    /// [`ReadError`] when the disk fails or the process was asked to end.
    pub fn read_next(&mut self) -> Result<Option<RawMessage<'_>>, ReadError> {
        let message = self.0.next()?;
        Ok(message.map(|message| RawMessage {
            topic: &message.channel.topic,
            type_name: message.channel.type_name(),
            encoding: &message.channel.encoding,
            definition: message.channel.schema.as_ref().map_or(&[], |schema| &schema.data),
            log_time_ns: message.log_time_ns,
            data: message.data,
        }))
    }

    /// Where the file says that it comes from, as far as it was read.
    pub fn origins(&self) -> Origins {
        origins::said(&self.0)
    }

    /// The part of the file that could not be read so far; `None` while all is whole.
    pub fn damage(&self) -> Option<String> {
        self.0.damage().summary()
    }
}
