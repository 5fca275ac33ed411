//! Why an output cannot be written, in one line: the file, the cause, and what to do.

use std::io;
use std::path::{Path, PathBuf};

/// An output cannot be written. Nothing of it is there; a file of before is unchanged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot write {}: {cause}{}; {remedy}", path.display(), if *.had_file { "; the file of before is unchanged" } else { "" })]
pub struct OutputError {
    path: PathBuf,
    kind: io::ErrorKind,
    cause: String,
    had_file: bool,
    remedy: &'static str,
}

impl OutputError {
    /// The system's refusal, for `path`. `needed`: size of the whole as far as it is known, `written`: how far it came
    /// [bytes].
    pub(super) fn new(path: &Path, error: &io::Error, needed: u64, written: u64) -> Self {
        let kind = error.kind();
        let (cause, remedy) = match kind {
            io::ErrorKind::StorageFull => (full(path, needed, written), "free some space there, or give another place"),
            io::ErrorKind::QuotaExceeded => {
                ("the quota of disk space is used up".to_owned(), "free some space there, or give another place")
            }
            io::ErrorKind::FileTooLarge => {
                let cause = "it would be larger than its file system or `ulimit -f` allows";
                (cause.to_owned(), "raise that limit, or give another place")
            }
            io::ErrorKind::NotFound => {
                let cause = format!("there is no folder {}", folder_of(path).display());
                (cause, "make it, or give another place")
            }
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                (error.to_string(), "give a place that you may write to")
            }
            io::ErrorKind::AlreadyExists => ("it exists, and is not overwritten".to_owned(), "give a new name"),
            io::ErrorKind::IsADirectory => ("it is a folder".to_owned(), "give the name of a file"),
            _ => (error.to_string(), "give another place"),
        };
        let had_file = kind != io::ErrorKind::AlreadyExists && path.is_file();
        Self { path: path.to_owned(), kind, cause, had_file, remedy }
    }

    /// A refusal in own words.
    pub(super) fn refused(path: &Path, kind: io::ErrorKind, cause: &str, remedy: &'static str) -> Self {
        Self { path: path.to_owned(), kind, cause: cause.to_owned(), had_file: false, remedy }
    }

    /// A file that is there, and whose replacement nobody asked for.
    pub(super) fn kept(path: &Path) -> Self {
        let remedy = "give another name, or replace it with --force";
        Self::refused(path, io::ErrorKind::AlreadyExists, "it exists, and is kept", remedy)
    }

    /// The output has its name, but the folder could not be taken to the disk.
    pub(super) fn unsafe_name(path: &Path, error: &io::Error) -> Self {
        let cause = format!("it has its name, which a power cut may take back: {error}");
        Self { path: path.to_owned(), kind: error.kind(), cause, had_file: false, remedy: "check the disk" }
    }

    /// What `error` says of the output `path`: the [`OutputError`] in it, if a writer of this module raised it.
    pub fn of(path: &Path, error: io::Error) -> Self {
        Self::inside(&error).unwrap_or_else(|| Self::new(path, &error, 0, 0))
    }

    /// The [`OutputError`] that a writer of this module raised, out of what the caller of that writer got.
    pub fn inside(error: &io::Error) -> Option<Self> {
        error.get_ref().and_then(|inner| inner.downcast_ref::<Self>()).cloned()
    }

    /// The output.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl From<OutputError> for io::Error {
    fn from(error: OutputError) -> Self {
        Self::new(error.kind, error)
    }
}

/// The folder that holds `path`.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// How much room is lacking where.
fn full(path: &Path, needed: u64, written: u64) -> String {
    let folder = folder_of(path);
    let free = rustix::fs::statvfs(folder).map_or(0, |disk| disk.f_bavail.saturating_mul(disk.f_frsize));
    // What was written so far has been taken from the free space.
    let (needed, free) = (size(needed.max(written)), size(free.saturating_add(written)));
    format!("the disk is full: it needs {needed} or more, and {free} are free in {}", folder.display())
}

/// Bytes as a person reads them.
pub(crate) fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 * 1e-3),
        _ => format!("{:.1} MB", bytes as f64 * 1e-6),
    }
}
