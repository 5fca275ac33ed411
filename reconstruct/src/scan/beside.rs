//! Files that lie beside the pictures of a scan, by their names. Each folder is looked into once: a scan may have a hundred thousand
//! pictures, and a mask may stand in any of a dozen places.

use std::collections::{HashMap, HashSet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What lies in the folders of a scan, as far as they were looked into.
#[derive(Debug)]
pub(super) struct Beside<'a> {
    scan: &'a Path,
    folders: HashMap<PathBuf, HashSet<OsString>>,
}

impl<'a> Beside<'a> {
    /// Of the scan in that folder.
    pub(super) fn of(scan: &'a Path) -> Self {
        Self { scan, folders: HashMap::new() }
    }

    /// A file of the same name as a picture in a folder beside the picture's: `masks/a.png` or `masks/a.jpg.png` for
    /// `images/a.jpg`.
    pub(super) fn find(&mut self, picture: &Path, names: &[&str]) -> Option<PathBuf> {
        let file = Path::new(picture.file_name()?);
        let parent = picture.parent().unwrap_or(Path::new(""));
        let own = [file.to_owned(), file.with_extension("png"), PathBuf::from(format!("{}.png", file.display()))];
        for place in [parent.parent().unwrap_or(Path::new("")), Path::new("")] {
            for folder in names.iter().map(|name| self.scan.join(place).join(name)) {
                let there = self.entries(&folder);
                let mut found =
                    own.iter().filter(|file| there.contains(file.as_os_str())).map(|file| folder.join(file));
                if let Some(file) = found.find(|file| file.is_file()) {
                    return Some(file);
                }
            }
        }
        None
    }

    fn entries(&mut self, folder: &Path) -> &HashSet<OsString> {
        self.folders.entry(folder.to_owned()).or_insert_with(|| {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.map(|entry| entry.file_name()).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_is_found_in_every_place_that_it_may_have() {
        let scan = tempfile::tempdir().expect("a folder");
        for (picture, mask) in [
            ("images/a.jpg", "masks/a.png"),
            ("images/b.jpg", "masks/b.jpg.png"),
            ("left/images/c.jpg", "left/mask/c.jpg"),
            ("left/images/d.jpg", "masks/d.jpg"),
        ] {
            let mask = scan.path().join(mask);
            std::fs::create_dir_all(mask.parent().expect("a folder")).expect("room");
            std::fs::write(&mask, b"").expect("room");
            assert_eq!(Beside::of(scan.path()).find(Path::new(picture), &["masks", "mask"]), Some(mask));
        }
        std::fs::create_dir_all(scan.path().join("masks/e.png")).expect("room");
        let mut beside = Beside::of(scan.path());
        assert_eq!(beside.find(Path::new("images/e.png"), &["masks"]), None, "a folder is no mask");
        assert_eq!(beside.find(Path::new("images/f.png"), &["masks"]), None);
    }
}
