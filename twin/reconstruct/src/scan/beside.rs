//! Files that lie beside the pictures of a scan, by their names. A mask of `images/front/1.png` may stand in any of a dozen places,
//! and some of them could as well be that of `images/top/1.png`: a file is taken only where no other picture has as good a claim.
//! Each folder is looked into once: a scan may have a hundred thousand pictures.

use super::error::ScanError;
use std::collections::{HashMap, HashSet};
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

/// What lies in the folders of a scan, as far as they were looked into.
#[derive(Debug)]
pub(super) struct Beside<'a> {
    scan: &'a Path,
    folders: HashMap<PathBuf, HashSet<OsString>>,
}

/// A picture's claim to a file: the number of the picture, and how many better places there are for its file.
#[derive(Debug, Clone, Copy)]
struct Claim {
    picture: usize,
    rank: usize,
}

impl<'a> Beside<'a> {
    /// Of the scan in that folder.
    pub(super) fn of(scan: &'a Path) -> Self {
        Self { scan, folders: HashMap::new() }
    }

    /// For each picture the file that belongs to it in folders of these names, as masks are: for `images/front/a.jpg` that is
    /// `masks/front/a.jpg`, `masks/front/a.jpg.png` or `masks/front/a.png`, or one in another place that [`folders`] names.
    ///
    /// A picture whose best file is another one's as well gets a [`ScanError`] that names both.
    pub(super) fn pairs(&mut self, pictures: &[&Path], names: &[&str]) -> Vec<Result<Option<PathBuf>, ScanError>> {
        let mut claims: HashMap<PathBuf, Vec<Claim>> = HashMap::new();
        let mut best = Vec::with_capacity(pictures.len());
        for (number, picture) in pictures.iter().enumerate() {
            let files = self.files(picture, names);
            for (rank, file) in &files {
                claims.entry(file.clone()).or_default().push(Claim { picture: number, rank: *rank });
            }
            best.push(files.into_iter().next());
        }
        let decide = |(number, best): (usize, Option<(usize, PathBuf)>)| {
            let Some((rank, file)) = best else { return Ok(None) };
            let picture = pictures[number];
            let as_good = claims[&file].iter().filter(|claim| claim.rank <= rank);
            let Some(other) = as_good.map(|claim| pictures[claim.picture]).find(|other| *other != picture) else {
                return Ok(Some(file));
            };
            let [own, its] = [picture, other].map(|picture| Path::new(names[0]).join(without_first(picture)));
            let what = format!(
                "could be that of {} or of {}: give each its own, {} and {}",
                picture.display(),
                other.display(),
                own.display(),
                its.display()
            );
            Err(ScanError::content(&file, what))
        };
        best.into_iter().enumerate().map(decide).collect()
    }

    /// Files that there are for a picture, the best first, each with its rank among all places.
    fn files(&mut self, picture: &Path, names: &[&str]) -> Vec<(usize, PathBuf)> {
        let Some(file) = picture.file_name().map(Path::new) else { return Vec::new() };
        let own = [file.to_owned(), PathBuf::from(format!("{}.png", file.display())), file.with_extension("png")];
        let mut found: Vec<(usize, PathBuf)> = Vec::new();
        let places = folders(picture, names);
        for (rank, (folder, name)) in
            places.iter().flat_map(|folder| own.iter().map(move |name| (folder, name))).enumerate()
        {
            let folder = self.scan.join(folder);
            let path = folder.join(name);
            let is_there = self.entries(&folder).contains(name.as_os_str()) && path.is_file();
            if is_there && found.iter().all(|(_, known)| *known != path) {
                found.push((rank, path));
            }
        }
        found
    }

    fn entries(&mut self, folder: &Path) -> &HashSet<OsString> {
        self.folders.entry(folder.to_owned()).or_insert_with(|| {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.map(|entry| entry.file_name()).collect()
        })
    }
}

/// Folders of a picture's path, without those that stay where they are.
fn parents(picture: &Path) -> Vec<Component<'_>> {
    let parts = picture.parent().unwrap_or(Path::new("")).components();
    parts.filter(|part| *part != Component::CurDir).collect()
}

/// A picture's path below the folder of all pictures.
fn without_first(picture: &Path) -> PathBuf {
    parents(picture).iter().skip(1).collect::<PathBuf>().join(picture.file_name().unwrap_or_default())
}

/// Where a picture's mask may stand, what says most about the picture first: all of its path below `masks`, `masks` in place of one of
/// its folders, beside it, and `masks` alone.
fn folders(picture: &Path, names: &[&str]) -> Vec<PathBuf> {
    let parents = parents(picture);
    let joined = |before: &[Component<'_>], name: &str, after: &[Component<'_>]| -> PathBuf {
        before.iter().collect::<PathBuf>().join(name).join(after.iter().collect::<PathBuf>())
    };
    let count = parents.len();
    let mut out: Vec<PathBuf> = Vec::new();
    let cuts = std::iter::once((0, 0)).chain((0..count).map(|at| (at, at + 1))).chain([(count, count), (0, count)]);
    for (before, after) in cuts {
        for name in names {
            let folder = joined(&parents[..before], name, &parents[after..]);
            if !out.contains(&folder) {
                out.push(folder);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(files: &[&str]) -> tempfile::TempDir {
        let scan = tempfile::tempdir().expect("a folder");
        for file in files {
            let path = scan.path().join(file);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("room");
            std::fs::write(&path, b"").expect("room");
        }
        scan
    }

    /// What belongs to each picture, relative to the scan; what is said where it is not known.
    fn pairs(scan: &Path, pictures: &[&str]) -> Vec<Result<Option<String>, String>> {
        let pictures: Vec<&Path> = pictures.iter().map(Path::new).collect();
        let found = Beside::of(scan).pairs(&pictures, &["masks", "mask"]).into_iter();
        let name = |path: PathBuf| path.strip_prefix(scan).expect("of the scan").display().to_string();
        found.map(|found| found.map(|path| path.map(name)).map_err(|error| error.to_string())).collect()
    }

    #[test]
    fn a_mask_is_found_in_every_place_that_it_may_have() {
        for (picture, mask) in [
            ("images/a.jpg", "masks/a.png"),
            ("images/b.jpg", "masks/b.jpg.png"),
            ("left/images/c.jpg", "left/mask/c.jpg"),
            ("left/images/d.jpg", "masks/d.jpg"),
            ("images/front/1.png", "masks/front/1.png"),
            ("images/front/1.png", "masks/images/front/1.png"),
            ("images/front/1.png", "images/front/masks/1.png"),
            ("images/front/1.png", "masks/1.png"),
            ("./train/r_0.png", "masks/train/r_0.png"),
            ("e.png", "masks/e.png"),
        ] {
            let scan = scan(&[mask]);
            assert_eq!(pairs(scan.path(), &[picture]), [Ok(Some(mask.to_owned()))], "{picture}");
        }
        let scan = scan(&[]);
        std::fs::create_dir_all(scan.path().join("masks/e.png")).expect("room");
        assert_eq!(pairs(scan.path(), &["images/e.png", "images/f.png"]), [Ok(None), Ok(None)], "a folder is no mask");
    }

    #[test]
    fn cameras_with_pictures_of_one_name_have_masks_of_their_own() {
        let pictures = ["images/front/1.png", "images/top/1.png", "images/top/2.png"];
        let own = scan(&["masks/front/1.png", "masks/top/1.png", "masks/1.png", "masks/2.png"]);
        let wanted = ["masks/front/1.png", "masks/top/1.png", "masks/2.png"].map(|mask| Ok(Some(mask.to_owned())));
        assert_eq!(pairs(own.path(), &pictures), wanted);
        // One mask of that name could be either's.
        for files in [&["masks/1.png"][..], &["masks/1.png", "masks/front/1.png"]] {
            let one = scan(files);
            let found = pairs(one.path(), &pictures);
            let line = found[1].as_ref().expect_err("whose is it");
            assert!(line.contains("images/front/1.png") && line.contains("masks/top/1.png"), "{line}");
            assert_eq!(found[2], Ok(None));
        }
    }

    #[test]
    fn pictures_that_differ_in_their_ending_alone_do_not_share_a_mask() {
        let pictures = ["images/a.jpg", "images/a.png"];
        let both = scan(&["masks/a.jpg.png", "masks/a.png"]);
        let wanted = ["masks/a.jpg.png", "masks/a.png"].map(|mask| Ok(Some(mask.to_owned())));
        assert_eq!(pairs(both.path(), &pictures), wanted);
        let one = scan(&["masks/a.png"]);
        let found = pairs(one.path(), &pictures);
        assert_eq!(found[1], Ok(Some("masks/a.png".to_owned())));
        assert!(found[0].as_ref().expect_err("it is the other's").contains("images/a.png"));
    }
}
