//! An output of many files: a folder that is whole or not there.

use super::error::folder_of;
use super::unfinished::{MadeFolders, Unfinished, clear, sync_folder};
use super::{Output, OutputError, Place};
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// A folder that is being filled. It gets its name with [`OutputFolder::finish`]; dropped before, it leaves nothing.
///
/// A folder that does not exist yet appears in one step. One that exists, and is empty, is filled at the end: it may be a
/// mount point, or the folder that somebody works in. One that is to be replaced changes places with the new one in one step.
#[derive(Debug)]
pub struct OutputFolder {
    /// The name that was asked for.
    path: PathBuf,
    staging: Unfinished,
    /// Folders on the way that were made for it; they go after what is in them.
    made: MadeFolders,
    before: Before,
}

/// What has the name before the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Before {
    Nothing,
    EmptyFolder,
    Replaced,
}

impl OutputFolder {
    /// Begins the new folder `path`; folders in between are made.
    ///
    /// # Errors
    /// [`OutputError`] when there is something else than an empty folder, or it cannot be written.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = |error: io::Error| OutputError::new(path, &error, 0, 0);
        let exists = match fs::metadata(path) {
            Ok(found) if found.is_dir() => true,
            Ok(_) => {
                let kind = io::ErrorKind::NotADirectory;
                return Err(OutputError::refused(path, kind, "it is a file", "give a new folder"));
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(error) => return Err(failed(error)),
        };
        let parent = if exists { path } else { folder_of(path) };
        if exists {
            clear(path);
            if fs::read_dir(path).map_err(failed)?.next().is_some() {
                let (kind, remedy) =
                    (io::ErrorKind::DirectoryNotEmpty, "choose a new folder, or replace it with --force");
                return Err(OutputError::refused(path, kind, "it is not empty", remedy));
            }
        }
        let made = if exists { MadeFolders::default() } else { MadeFolders::make(parent).map_err(failed)? };
        let staging = Unfinished::folder(parent, path).map_err(failed)?;
        let before = if exists { Before::EmptyFolder } else { Before::Nothing };
        Ok(Self { path: path.to_owned(), staging, made, before })
    }

    /// Begins a folder that takes the place of the folder `path` at the end; all that was in that one is gone then.
    ///
    /// # Errors
    /// [`OutputError`] when there is no such folder, or its place cannot be written.
    pub fn replacing(path: &Path) -> Result<Self, OutputError> {
        let failed = |error: io::Error| OutputError::new(path, &error, 0, 0);
        // A link stays, and what it leads to is replaced.
        let path = path.canonicalize().map_err(failed)?;
        let staging = Unfinished::folder(folder_of(&path), &path).map_err(failed)?;
        Ok(Self { path, staging, made: MadeFolders::default(), before: Before::Replaced })
    }

    /// Begins a file in the folder; folders in between are made.
    ///
    /// # Errors
    /// [`OutputError`], which names the file by its final path.
    pub fn file(&self, name: &Path) -> Result<Output, OutputError> {
        let (path, at) = (self.path.join(name), self.staging.path().join(name));
        let file = fs::create_dir_all(folder_of(&at)).and_then(|()| File::create_new(&at));
        let file = file.map_err(|error| OutputError::new(&path, &error, 0, 0))?;
        Ok(Output { path, file, place: Place::InFolder(at), written: 0, needed: 0 })
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// As [`OutputFolder::file`].
    pub fn write(&self, name: &Path, bytes: &[u8]) -> Result<(), OutputError> {
        let mut output = self.file(name)?;
        output.needed = bytes.len() as u64;
        output.write_all(bytes).map_err(|error| OutputError::of(&self.path.join(name), error))?;
        output.finish()
    }

    /// Gives the folder its name, once all of it is on the disk. Where it existed before, its files appear one after the
    /// other, `last` in the end.
    ///
    /// # Errors
    /// [`OutputError`]; the folder is then missing, or without `last`.
    pub fn finish(self, last: &str) -> Result<(), OutputError> {
        let Self { path, staging, made, before } = self;
        let named = || {
            sync_all(staging.path())?;
            match before {
                Before::Nothing => {
                    staging.becomes(&path, true)?;
                    made.keep();
                    return sync_folder(folder_of(&path));
                }
                Before::Replaced => {
                    staging.changes_places_with(&path)?;
                    return sync_folder(folder_of(&path));
                }
                Before::EmptyFolder => {}
            }
            let entries = fs::read_dir(staging.path())?.collect::<io::Result<Vec<_>>>()?;
            let mut names: Vec<_> = entries.iter().map(fs::DirEntry::file_name).collect();
            names.sort_by_key(|name| name == last);
            for name in names {
                fs::rename(staging.path().join(&name), path.join(&name))?;
            }
            drop(staging);
            sync_folder(&path)
        };
        named().map_err(|error| OutputError::new(&path, &error, 0, 0))
    }
}

/// Takes the names in all folders below to the disk; the files are there already.
fn sync_all(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_all(&entry.path())?;
        }
    }
    sync_folder(folder)
}
