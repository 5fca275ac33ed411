//! Why a scan cannot be used: one line with what is missing and what to do.

use shared_mem::input::InputError;
use shared_mem::recording::ReadError;
use std::path::{Path, PathBuf};

/// A scan cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// A file is missing, unreadable, or too large.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A picture is damaged.
    #[error(transparent)]
    Picture(#[from] ReadError),
    /// A file says something that cannot be.
    #[error("{}: {what}", path.display())]
    Content {
        path: PathBuf,
        /// What is wrong, and what to do.
        what: String,
    },
    /// What was given is not enough.
    #[error("{0}")]
    Missing(String),
    /// The end was asked for.
    #[error("interrupted")]
    Interrupted,
}

impl ScanError {
    /// A file that says something that cannot be.
    pub fn content(path: &Path, what: impl Into<String>) -> Self {
        Self::Content { path: path.to_owned(), what: what.into() }
    }
}
