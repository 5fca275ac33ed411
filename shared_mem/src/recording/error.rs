//! Why a recording cannot be used, one line each: what happened and what to do.

use crate::budget::BudgetError;
use crate::cell::CellError;
use crate::input::InputError;
use std::path::{Path, PathBuf};

/// A clip or a session cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is missing, or the disk fails.
    #[error("cannot read {}: {source}; give the path of an existing clip or session folder", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is missing, no file, or too large.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Ctrl-C.
    #[error("{}: interrupted while it was read; start again", path.display())]
    Interrupted {
        /// The file.
        path: PathBuf,
    },
    /// It asks for more than is spent on a file of its size.
    #[error("{}: {source}", path.display())]
    Budget {
        /// The file.
        path: PathBuf,
        /// What was spent.
        source: BudgetError,
    },
    /// The file is no recording of a known kind.
    #[error("{}: {what}", path.display())]
    Kind {
        /// The file or folder.
        path: PathBuf,
        /// What was expected and how to mend it.
        what: String,
    },
    /// A topic that is needed is not there.
    #[error(
        "{}: no messages on `{topic}` ({role}); the file has {present}; set `{key} = \"...\"` in cell.toml",
        path.display()
    )]
    Topic {
        /// The file.
        path: PathBuf,
        /// The topic looked for.
        topic: String,
        /// What it should hold.
        role: &'static str,
        /// Block and key of cell.toml that name it.
        key: &'static str,
        /// Topics and types that the file has.
        present: String,
    },
    /// A message does not hold what its topic should.
    #[error("{}: `{topic}`: {what}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The topic, or the file of a folder.
        topic: String,
        /// What is wrong and how to mend it.
        what: String,
    },
    /// The cell.toml of a session cannot be used.
    #[error(transparent)]
    Cell(#[from] CellError),
}

impl ReadError {
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    /// A budget is spent, or the process was asked to end.
    pub(super) fn budget(path: &Path) -> impl Fn(BudgetError) -> Self + '_ {
        move |source| match source {
            BudgetError::Ended => Self::Interrupted { path: path.to_owned() },
            BudgetError::Memory(_) | BudgetError::Steps(_) => Self::Budget { path: path.to_owned(), source },
        }
    }

    pub(super) fn kind(path: &Path, what: impl Into<String>) -> Self {
        Self::Kind { path: path.to_owned(), what: what.into() }
    }

    pub(super) fn content(path: &Path, topic: &str, what: impl Into<String>) -> Self {
        Self::Content { path: path.to_owned(), topic: topic.to_owned(), what: what.into() }
    }
}
