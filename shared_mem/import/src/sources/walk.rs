//! The files below a folder, each folder once: links may lead in circles, and many ways to one place.

use super::{failed, go_on};
use crate::error::ImportError;
use std::collections::HashSet;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// Folders that were looked into, by device and number.
#[derive(Debug, Default)]
pub(super) struct Seen(HashSet<(u64, u64)>);

impl Seen {
    /// What lies in a folder; nothing where it was looked into before, by whatever name.
    pub(super) fn entries(&mut self, folder: &Path) -> Result<Vec<PathBuf>, ImportError> {
        go_on(folder)?;
        let about = std::fs::metadata(folder).map_err(failed(folder))?;
        if !self.0.insert((about.dev(), about.ino())) {
            return Ok(Vec::new());
        }
        let entries = std::fs::read_dir(folder).map_err(failed(folder))?;
        entries.map(|entry| Ok(entry.map_err(failed(folder))?.path())).collect()
    }
}

/// All files at or below a path, links to files among them.
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>, ImportError> {
    let (mut seen, mut left, mut found) = (Seen::default(), vec![path.to_owned()], Vec::new());
    while let Some(path) = left.pop() {
        if path.is_dir() {
            left.extend(seen.entries(&path)?);
        } else {
            found.push(path);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_lead_in_circles_are_followed_once() {
        let place = tempfile::tempdir().expect("a folder");
        let (data, own) = (place.path().join("data"), place.path().join("data/own"));
        std::fs::create_dir_all(&own).expect("room");
        std::fs::write(own.join("a.parquet"), b"PAR1").expect("room");
        // 2^40 ways, as deep as names may be.
        for name in ["one", "two"] {
            std::os::unix::fs::symlink(&data, data.join(name)).expect("a link");
        }
        let elsewhere = place.path().join("b.parquet");
        std::fs::write(&elsewhere, b"PAR1").expect("room");
        std::os::unix::fs::symlink(&elsewhere, data.join("b.parquet")).expect("a link");
        let mut names: Vec<_> =
            files(&data).expect("files").iter().filter_map(|path| path.file_name().map(ToOwned::to_owned)).collect();
        names.sort();
        assert_eq!(names, ["a.parquet", "b.parquet"], "a link to a file is one");
    }
}
