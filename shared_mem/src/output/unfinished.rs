//! Temporary files and folders beside the outputs that they become: their names, which of them this program is writing,
//! and which a killed program left over.
//!
//! Whoever writes one holds a lock on it (`flock`), which the kernel takes back when the process ends. Where a file system
//! knows no such locks, left-over ones stay.

use super::error::folder_of;
use rustix::fs::{CWD, RenameFlags};
use std::collections::HashSet;
use std::fs::{self, File, Permissions, TryLockError};
use std::io;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use tempfile::{Builder, TempDir, TempPath};

/// What every temporary name begins with; the output's name, `-` and [`RANDOM`] letters and digits follow.
const PREFIX: &str = ".unfinished-";
const RANDOM: usize = 6;
/// More of an output's name is left out, so that the temporary one is not too long for a file system [bytes].
const LONGEST: usize = 200;
/// Tries to make one that no other program takes for left over between its making and its lock.
const TRIES: usize = 20;

/// What this program is writing, and where it has looked for left-over ones.
#[derive(Debug, Default)]
struct Known {
    writing: HashSet<PathBuf>,
    /// Folders that were made on the way to them, innermost first.
    made: Vec<PathBuf>,
    searched: HashSet<PathBuf>,
}

static KNOWN: LazyLock<Mutex<Known>> = LazyLock::new(Mutex::default);

fn known() -> MutexGuard<'static, Known> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every temporary file and folder of this program, and lets nobody begin another: for a signal handler's thread
/// that ends the program afterwards.
pub fn discard_unfinished() {
    let known = known();
    for path in &known.writing {
        // What has just got its name is not there any more.
        let _gone = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    remove_empty(&known.made);
    std::mem::forget(known);
}

/// A temporary file or folder; it goes when this goes.
#[derive(Debug)]
pub(super) struct Unfinished {
    listed: Listed,
    kind: Kind,
}

/// Who removes it.
#[derive(Debug)]
enum Kind {
    File(TempPath),
    /// With the open folder that holds the lock.
    Folder(TempDir, File),
}

/// Enters a path into what this program is writing, until it is dropped.
#[derive(Debug)]
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        known().writing.remove(&self.0);
    }
}

/// Folders that were made on the way to an output: they go with it where it does not come about, as far as they are empty.
#[derive(Debug, Default)]
pub(super) struct MadeFolders(Vec<PathBuf>);

impl MadeFolders {
    /// Makes `folder` and those on the way that are not there.
    pub(super) fn make(folder: &Path) -> io::Result<Self> {
        let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let made = Self(folder.ancestors().take_while(missing).map(Path::to_owned).collect());
        known().made.splice(0..0, made.0.iter().cloned());
        fs::create_dir_all(folder)?;
        Ok(made)
    }

    /// The output is there: so do they stay.
    pub(super) fn keep(mut self) {
        self.forget();
    }

    fn forget(&mut self) -> Vec<PathBuf> {
        known().made.retain(|folder| !self.0.contains(folder));
        std::mem::take(&mut self.0)
    }
}

impl Drop for MadeFolders {
    fn drop(&mut self) {
        remove_empty(&self.forget());
    }
}

/// Removes folders as far as they are empty, innermost first.
fn remove_empty(folders: &[PathBuf]) {
    for folder in folders {
        // Whoever put something there meanwhile needs it.
        let _stays = fs::remove_dir(folder);
    }
}

impl Unfinished {
    /// A file beside `target`, with the mode that the umask leaves of 0666; its handle holds the lock.
    pub(super) fn file(target: &Path) -> io::Result<(File, Self)> {
        let prefix = prefix_of(target);
        let mut make = Builder::new();
        make.prefix(&prefix).rand_bytes(RANDOM).permissions(Permissions::from_mode(0o666));
        let folder = folder_of(target);
        clear(folder);
        for _ in 0..TRIES {
            let mut known = known();
            let (file, path) = make.tempfile_in(folder)?.into_parts();
            let listed = list(&mut known, &path);
            drop(known);
            if is_held(&file, &path)? {
                return Ok((file, Self { listed, kind: Kind::File(path) }));
            }
        }
        Err(io::Error::other("other programs remove its temporary file"))
    }

    /// A folder in `parent` for what is to be called `name`, with the mode that the umask leaves of 0777.
    pub(super) fn folder(parent: &Path, name: &Path) -> io::Result<Self> {
        let prefix = prefix_of(name);
        let mut make = Builder::new();
        make.prefix(&prefix).rand_bytes(RANDOM).permissions(Permissions::from_mode(0o777));
        clear(parent);
        for _ in 0..TRIES {
            let mut known = known();
            let folder = make.tempdir_in(parent)?;
            let listed = list(&mut known, folder.path());
            drop(known);
            let handle = File::open(folder.path());
            match handle.and_then(|handle| Ok((is_held(&handle, folder.path())?, handle))) {
                Ok((true, handle)) => return Ok(Self { listed, kind: Kind::Folder(folder, handle) }),
                Ok((false, _)) => {}
                // Taken for left over before it could be opened.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other("other programs remove its temporary folder"))
    }

    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        &self.listed.0
    }

    /// Gives it the name `target`, in one step. `is_new`: never in place of another.
    pub(super) fn becomes(self, target: &Path, is_new: bool) -> io::Result<()> {
        let Self { listed, kind } = self;
        match kind {
            Kind::File(path) if is_new => path.persist_noclobber(target).map_err(|refused| refused.error)?,
            Kind::File(path) => path.persist(target).map_err(|refused| refused.error)?,
            Kind::Folder(folder, _lock) => {
                fs::rename(folder.path(), target)?;
                let _renamed = folder.keep();
            }
        }
        drop(listed);
        Ok(())
    }

    /// Gives a folder the name of another one, in one step, and removes that other one with all that is in it.
    pub(super) fn changes_places_with(self, target: &Path) -> io::Result<()> {
        rustix::fs::renameat_with(CWD, self.path(), CWD, target, RenameFlags::EXCHANGE)?;
        // What has the temporary name now goes as this goes.
        Ok(())
    }
}

fn list(known: &mut Known, path: &Path) -> Listed {
    known.writing.insert(path.to_owned());
    Listed(path.to_owned())
}

/// Takes the lock. `false`: another program took it for left over and removed it first.
fn is_held(file: &File, path: &Path) -> io::Result<bool> {
    // A file system without locks: nobody will take it for left over either.
    let _held = file.lock();
    let (own, there) = (file.metadata()?, fs::symlink_metadata(path));
    Ok(there.is_ok_and(|there| (there.dev(), there.ino()) == (own.dev(), own.ino())))
}

/// Begin of the temporary names of an output.
fn prefix_of(target: &Path) -> String {
    let mut name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    while name.len() > LONGEST {
        name.pop();
    }
    format!("{PREFIX}{name}-")
}

fn is_temporary(name: &str) -> bool {
    let random = name.strip_prefix(PREFIX).and_then(|rest| rest.rsplit_once('-')).map(|(_, random)| random);
    random.is_some_and(|random| random.len() == RANDOM && random.bytes().all(|byte| byte.is_ascii_alphanumeric()))
}

/// Removes what killed programs left in `folder`; once in a program's life, because a folder may hold many files.
pub(super) fn clear(folder: &Path) {
    let Ok(folder) = folder.canonicalize() else { return };
    if !known().searched.insert(folder.clone()) {
        return;
    }
    for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(is_temporary) {
            remove_left_over(&entry.path());
        }
    }
}

/// Removes a temporary file or folder whose writer has ended.
fn remove_left_over(path: &Path) {
    let Ok(found) = path.symlink_metadata() else { return };
    if !found.is_file() && !found.is_dir() {
        return;
    }
    let Ok(file) = File::open(path) else { return };
    match file.try_lock() {
        // Whatever cannot be removed stays, and disturbs nobody.
        Ok(()) => drop(if found.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }),
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
    }
}

/// Takes a folder's names to the disk. File systems that cannot are as safe as they can be.
pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder)?.sync_all() {
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        done => done,
    }
}
