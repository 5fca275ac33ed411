//! Why logs cannot be imported, one line each: what happened and what to do.

use shared_mem::budget::BudgetError;
use shared_mem::cell::CellError;
use shared_mem::input::InputError;
use shared_mem::output::OutputError;
use shared_mem::printable;
use shared_mem::recording::{ExportError, ReadError, WriteError};
use shared_mem::toml_file::TomlFileError;
use std::path::{Path, PathBuf};

/// Logs cannot be imported. No session is there then.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A recording cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file is missing, no file, or too large.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The session cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The session's folder is taken.
    #[error(transparent)]
    Folder(#[from] ExportError),
    /// A clip cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The mapping is no import.toml.
    #[error(transparent)]
    Mapping(#[from] TomlFileError),
    /// An import.toml with open lines is there from an import before.
    #[error("{} is there from an import before: fill in its open lines, then: {command}; or have them asked anew with --force", file.display())]
    Asked {
        file: PathBuf,
        /// What imports with it.
        command: String,
    },
    /// The given cell.toml cannot be used.
    #[error(transparent)]
    Cell(#[from] CellError),
    /// A log is damaged, or of no known kind.
    #[error("{}: {what}", path.display())]
    Log {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong and how to mend it.
        what: String,
    },
    /// A log asks for more than is spent on one of its size.
    #[error("{}: {source}", path.display())]
    Budget {
        /// The file or folder.
        path: PathBuf,
        /// What was spent.
        source: BudgetError,
    },
    #[error("{}: interrupted while it was read; start again", path.display())]
    Interrupted { path: PathBuf },
}

impl ImportError {
    /// What is wrong with the log at `path`.
    pub(crate) fn log(path: &Path, what: impl Into<String>) -> Self {
        // What a log holds may be quoted, and be anything.
        Self::Log { path: path.to_owned(), what: printable::one_line(&what.into()) }
    }

    /// Itself where it is about a log, which may be left out for it; `Err` where the import ends with it.
    pub(crate) fn about_a_log(self) -> Result<Self, Self> {
        match self {
            Self::Read(ReadError::Interrupted { .. }) => Err(self),
            Self::Log { .. } | Self::Budget { .. } | Self::Read(_) | Self::Input(_) => Ok(self),
            other => Err(other),
        }
    }

    /// A budget is spent, or the process was asked to end.
    pub(crate) fn budget(path: &Path) -> impl Fn(BudgetError) -> Self + '_ {
        move |source| match source {
            BudgetError::Ended => Self::Interrupted { path: path.to_owned() },
            BudgetError::Memory(_) | BudgetError::Steps(_) => Self::Budget { path: path.to_owned(), source },
        }
    }
}
