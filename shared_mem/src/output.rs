//! Files that are whole or not there: every output except a live recording is written through here.
//!
//! The bytes go to a temporary file in the same folder, reach the disk (`fsync`), and then take the output's name in one
//! step (`rename`), after which the folder reaches the disk too. Whenever the program is killed or the disk fills up,
//! the output is the file of before or the new one.
//!
//! * Temporary files are called `.unfinished-NAME-XXXXXX`. They are removed when writing fails, and by
//!   [`discard_unfinished`] when a signal ends the program. Those of killed programs are removed by the next program
//!   that writes into the same folder; a lock (`flock`) tells them from those of programs that still run.
//! * A new file gets the mode that the umask leaves of 0666, a replaced one keeps its mode. A file that may not be
//!   written is not replaced.
//! * A symbolic link stays: the file that it leads to is replaced. Hard links are parted.
//! * Devices and pipes (`/dev/null`, `/dev/stdout`) are written straight; there, nothing can be kept back.
//!
//! Work that takes long looks at its outputs' places first: [`Destination`].
//!
//! | file | owns |
//! |---|---|
//! | `destination` | what may be written where, asked before the work begins |
//! | `error` | why an output cannot be written, and the remedy |
//! | `folder` | outputs of many files: [`OutputFolder`] |
//! | `unfinished` | temporary names: which are in use, which are left over |

mod destination;
mod error;
mod folder;
#[cfg(test)]
mod tests;
mod unfinished;

pub use destination::Destination;
pub use error::OutputError;
pub use folder::OutputFolder;
pub use unfinished::discard_unfinished;

use error::folder_of;
pub(crate) use error::size;
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use unfinished::{Unfinished, sync_folder};

/// Symbolic links that are followed one after the other, as many as Linux does.
const MOST_LINKS: usize = 40;

/// Writes `bytes` to the file `path`, whole or not at all. A file that is there is replaced.
///
/// # Errors
/// [`OutputError`] with file, cause and remedy; what was there before is unchanged.
///
/// # Example
/// ```
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("theta.toml");
/// shared_mem::output::write(&file, "[object]\nfriction = 0.3\n")?;
/// assert_eq!(std::fs::read_to_string(&file)?, "[object]\nfriction = 0.3\n");
///
/// // A folder is no file: the error says so, and nothing is changed.
/// assert!(shared_mem::output::write(folder.path(), "").is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), OutputError> {
    let bytes = bytes.as_ref();
    let mut output = Output::create(path)?;
    output.needed = bytes.len() as u64;
    output.write_all(bytes).map_err(|error| OutputError::of(path, error))?;
    output.finish()
}

/// A file that is being written. It gets its name with [`Output::finish`]; dropped before, it leaves nothing.
#[derive(Debug)]
pub struct Output {
    /// The name that was asked for.
    path: PathBuf,
    file: File,
    place: Place,
    written: u64,
    /// Size of the whole [bytes], 0 where it is not known before the end.
    needed: u64,
}

/// Where the bytes go until the end.
#[derive(Debug)]
enum Place {
    /// To a temporary file beside the output.
    Beside {
        temporary: Unfinished,
        target: PathBuf,
        /// Whether a file that appeared in the meantime is left alone.
        is_new: bool,
    },
    /// Into an unfinished folder, to this file there.
    InFolder(PathBuf),
    /// To a device or a pipe.
    Straight,
}

/// What a path leads to.
enum Target {
    File { path: PathBuf, exists: bool },
    Straight,
}

impl Output {
    /// Begins a file that replaces the one that may be there.
    ///
    /// # Errors
    /// [`OutputError`] when the folder or the file of before cannot be written.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = |error| OutputError::new(path, &error, 0, 0);
        match target_of(path).map_err(failed)? {
            Target::Straight => {
                let file = OpenOptions::new().write(true).open(path).map_err(failed)?;
                Ok(Self { path: path.to_owned(), file, place: Place::Straight, written: 0, needed: 0 })
            }
            Target::File { path: target, exists } => {
                // Renaming would also replace a file that may not be written.
                let before = exists.then(|| OpenOptions::new().write(true).open(&target)).transpose();
                let before = before.map_err(failed)?;
                let output = Self::beside(path, target, false)?;
                if let Some(before) = before {
                    let mode = before.metadata().map_err(failed)?.permissions();
                    output.file.set_permissions(mode).map_err(failed)?;
                }
                Ok(output)
            }
        }
    }

    /// Begins a new file; one that is there, even if it appears before the end, is left alone.
    ///
    /// # Errors
    /// [`OutputError`] when there is a file, or the folder cannot be written.
    pub fn create_new(path: &Path) -> Result<Self, OutputError> {
        if path.symlink_metadata().is_ok() {
            let exists = io::ErrorKind::AlreadyExists.into();
            return Err(OutputError::new(path, &exists, 0, 0));
        }
        Self::beside(path, path.to_owned(), true)
    }

    fn beside(path: &Path, target: PathBuf, is_new: bool) -> Result<Self, OutputError> {
        let (file, temporary) = Unfinished::file(&target).map_err(|error| OutputError::new(path, &error, 0, 0))?;
        let place = Place::Beside { temporary, target, is_new };
        Ok(Self { path: path.to_owned(), file, place, written: 0, needed: 0 })
    }

    /// The name that was asked for.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where the bytes lie until the end: for another program that writes them, or to read them back.
    pub fn unfinished_path(&self) -> &Path {
        match &self.place {
            Place::Beside { temporary, .. } => temporary.path(),
            Place::InFolder(file) => file,
            Place::Straight => &self.path,
        }
    }

    /// Gives the file its name, once all of it is on the disk.
    ///
    /// # Errors
    /// [`OutputError`]; what was there before is unchanged.
    pub fn finish(self) -> Result<(), OutputError> {
        let Self { path, file, place, written, needed } = self;
        let failed = |error: io::Error| OutputError::new(&path, &error, needed, written);
        if !matches!(place, Place::Straight) {
            file.sync_all().map_err(failed)?;
        }
        if let Place::Beside { temporary, target, is_new } = place {
            temporary.becomes(&target, is_new).map_err(failed)?;
            sync_folder(folder_of(&target)).map_err(|error| OutputError::unsafe_name(&path, &error))?;
        }
        Ok(())
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.file.write(bytes) {
            Ok(count) => {
                self.written += count as u64;
                Ok(count)
            }
            // The caller tries again.
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Err(error),
            Err(error) => {
                let known = self.needed.max(self.written + bytes.len() as u64);
                Err(OutputError::new(&self.path, &error, known, self.written).into())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Follows symbolic links to what is to be written.
fn target_of(path: &Path) -> io::Result<Target> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        // Open files of a process: their names lead nowhere that a file could be put.
        if path.starts_with("/proc") {
            return Ok(Target::Straight);
        }
        let found = match path.symlink_metadata() {
            Ok(found) => found.file_type(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Target::File { path, exists: false }),
            Err(error) => return Err(error),
        };
        if found.is_symlink() {
            let leads_to = path.read_link()?;
            path = path.parent().unwrap_or(Path::new("")).join(leads_to);
        } else if found.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        } else if found.is_file() {
            return Ok(Target::File { path, exists: true });
        } else {
            return Ok(Target::Straight);
        }
    }
    Err(rustix::io::Errno::LOOP.into())
}
