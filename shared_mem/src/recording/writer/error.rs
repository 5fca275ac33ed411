//! Why a clip cannot be written, and how far it came.

use crate::output::OutputError;
use mcap::McapError;
use std::io;
use std::path::{Path, PathBuf};

/// A clip cannot be written any further.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be created.
    #[error("cannot create {}: {source}; give a new file in a folder that exists and is writable", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No room is left.
    #[error(
        "the disk is full: {} ends after {bytes} bytes and is readable up to its last flush; free some space and \
         record again",
        path.display()
    )]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// Bytes that were written.
        bytes: u64,
    },
    /// A clip that is no live recording; nothing of it is there.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Writing failed for another reason.
    #[error("cannot write {} any further ({what}); it is readable up to its last flush; record to another disk", path.display())]
    Failed {
        /// The file.
        path: PathBuf,
        /// What the system said.
        what: String,
    },
}

impl WriteError {
    /// `bytes`: how far the file came.
    pub(in super::super) fn from_mcap(path: &Path, bytes: u64, error: &McapError) -> Self {
        if let McapError::Io(io) = error
            && let Some(refused) = OutputError::inside(io)
        {
            return Self::Output(refused);
        }
        let path = path.to_owned();
        match error {
            McapError::Io(e) if matches!(e.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded) => {
                Self::DiskFull { path, bytes }
            }
            McapError::Io(e) => Self::Failed { path, what: e.to_string() },
            McapError::AttemptedWriteAfterFailure => Self::Failed { path, what: "an earlier write failed".into() },
            other => Self::Failed { path, what: other.to_string() },
        }
    }
}
