//! What the commands of a sweep name: files and folders of any size, as a hash of what they hold.
//!
//! A link counts as what it leads to: a file by its bytes, a folder with all that is in it. Each folder is walked once, however many
//! links lead to it, so that a circle of links has an end; where it is met again, that stands in its place. A link that leads
//! nowhere counts by what is written in it.

use super::SweepError;
use inference::interrupt::Interrupt;
use sha2::{Digest as _, Sha256};
use shared_mem::command_line;
use shared_mem::input::{self, InputError};
use shared_mem::progress::Progress;
use std::collections::{BTreeMap, HashMap};
use std::ffi::OsString;
use std::io::{self, Read as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// Most files and folders that a word of a command may stand for.
const MOST: usize = 1_000_000;
/// Read at once, and what the bar counts [bytes].
const BLOCK: usize = 1 << 20;
/// What holds no more is hashed without a bar [blocks].
const UNSHOWN: u64 = 64;

/// Hashes of the files and folders that commands name; each is read once.
#[derive(Debug, Default)]
pub(super) struct Inputs(BTreeMap<String, Option<String>>);

impl Inputs {
    /// The hash of a command, of this build and of what the command names.
    ///
    /// # Errors
    /// [`SweepError`] for what cannot be read, and when it was interrupted.
    pub(super) fn hash(&mut self, command: &[String], interrupt: &Interrupt) -> Result<String, SweepError> {
        let mut hasher = Sha256::new();
        hasher.update(command_line::fingerprint());
        for word in command {
            going_on(interrupt)?;
            hasher.update((word.len() as u64).to_le_bytes());
            hasher.update(word);
            // Worlds of an evaluation stand in one word.
            for part in word.split([',', '=']) {
                if let Some(content) = self.content(part, interrupt)? {
                    hasher.update(content);
                }
            }
        }
        Ok(hex(&hasher.finalize()))
    }

    /// The hash of a file or folder; `None` where a word names none.
    fn content(&mut self, word: &str, interrupt: &Interrupt) -> Result<Option<String>, SweepError> {
        if let Some(known) = self.0.get(word) {
            return Ok(known.clone());
        }
        let path = Path::new(word);
        let found = if word.is_empty() || !path.exists() { None } else { Some(content_of(path, interrupt)?) };
        self.0.insert(word.to_owned(), found.clone());
        Ok(found)
    }
}

/// What stands at a place below what a command names.
#[derive(Debug)]
enum Kind {
    /// With its size [bytes].
    File(u64),
    /// With so many entries, which follow.
    Folder(usize),
    /// The so-manieth folder, from 0, met again.
    Again(usize),
    /// A link that leads nowhere, with what is written in it.
    Nowhere(PathBuf),
    /// A pipe, a socket or a device: it holds nothing.
    Other,
}

#[derive(Debug)]
struct Entry {
    name: OsString,
    path: PathBuf,
    kind: Kind,
}

/// The hash of a file, or of all that is in a folder with its names.
fn content_of(path: &Path, interrupt: &Interrupt) -> Result<String, SweepError> {
    let entries = entries(path, interrupt)?;
    let blocks = |entry: &Entry| if let Kind::File(size) = entry.kind { size / BLOCK as u64 } else { 0 };
    let all = entries.iter().map(blocks).sum();
    let bar = (all > UNSHOWN).then(|| Progress::new("hashing", all));
    let (mut hasher, mut done, mut block) = (Sha256::new(), 0, vec![0; BLOCK]);
    let number = |number: usize| (number as u64).to_le_bytes();
    for entry in &entries {
        let name = entry.name.as_encoded_bytes();
        hasher.update(number(name.len()));
        hasher.update(name);
        match &entry.kind {
            Kind::File(_) => {
                hasher.update(b"f");
                hasher.update(file(&entry.path, &mut block, interrupt, |blocks| {
                    if let Some(bar) = &bar {
                        bar.show(done + blocks, &entry.name.to_string_lossy());
                    }
                })?);
                done += blocks(entry);
            }
            Kind::Folder(inside) => {
                hasher.update(b"d");
                hasher.update(number(*inside));
            }
            Kind::Again(folder) => {
                hasher.update(b"a");
                hasher.update(number(*folder));
            }
            Kind::Nowhere(target) => {
                let target = target.as_os_str().as_encoded_bytes();
                hasher.update(b"l");
                hasher.update(number(target.len()));
                hasher.update(target);
            }
            Kind::Other => hasher.update(b"o"),
        }
    }
    Ok(hex(&hasher.finalize()))
}

/// The hash of a file's bytes; `shown` is given how many blocks have been read.
fn file(
    path: &Path,
    block: &mut [u8],
    interrupt: &Interrupt,
    mut shown: impl FnMut(u64),
) -> Result<sha2::digest::Output<Sha256>, SweepError> {
    let mut file = input::open(path)?;
    let (mut hasher, mut read) = (Sha256::new(), 0);
    loop {
        going_on(interrupt)?;
        match file.read(block) {
            Ok(0) => return Ok(hasher.finalize()),
            Ok(count) => {
                hasher.update(block.get(..count).unwrap_or_default());
                read += count as u64;
                shown(read / BLOCK as u64);
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(source) => return Err(InputError::Io { path: path.to_owned(), source }.into()),
        }
    }
}

/// What there is at a path and below it, a folder before its entries, and those by their names.
fn entries(path: &Path, interrupt: &Interrupt) -> Result<Vec<Entry>, SweepError> {
    let (mut listed, mut folders) = (Vec::new(), HashMap::new());
    let mut open = vec![(OsString::new(), path.to_owned())];
    while let Some((name, at)) = open.pop() {
        going_on(interrupt)?;
        if listed.len() + open.len() >= MOST {
            return Err(too_many(path));
        }
        let kind = match std::fs::metadata(&at) {
            Ok(found) if found.is_file() => Kind::File(found.len()),
            Ok(found) if found.is_dir() => {
                let number = folders.len();
                match *folders.entry((found.dev(), found.ino())).or_insert(number) {
                    before if before < number => Kind::Again(before),
                    _ => {
                        let inside = inside(&at, path, interrupt)?;
                        let count = inside.len();
                        // The last of the list is looked at first.
                        open.extend(inside.into_iter().rev());
                        Kind::Folder(count)
                    }
                }
            }
            Ok(_) => Kind::Other,
            Err(error) => match std::fs::read_link(&at) {
                Ok(target) => Kind::Nowhere(target),
                Err(_) => return Err(unreadable(&at, &error)),
            },
        };
        listed.push(Entry { name, path: at, kind });
    }
    Ok(listed)
}

/// Names and paths in a folder, by the alphabet.
fn inside(folder: &Path, whole: &Path, interrupt: &Interrupt) -> Result<Vec<(OsString, PathBuf)>, SweepError> {
    let unreadable = |error: io::Error| unreadable(folder, &error);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        going_on(interrupt)?;
        let entry = entry.map_err(unreadable)?;
        if found.len() >= MOST {
            return Err(too_many(whole));
        }
        found.push((entry.file_name(), entry.path()));
    }
    found.sort();
    Ok(found)
}

fn unreadable(path: &Path, error: &io::Error) -> SweepError {
    SweepError::Content { file: path.to_owned(), what: format!("it cannot be read ({error}); see that it may be") }
}

fn too_many(path: &Path) -> SweepError {
    let what = format!("it holds more than {MOST} files and folders; name those that the command reads");
    SweepError::Content { file: path.to_owned(), what }
}

fn going_on(interrupt: &Interrupt) -> Result<(), SweepError> {
    if interrupt.asked() { Err(SweepError::Interrupted) } else { Ok(()) }
}

/// Bytes as text, two signs each.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    fn hash(path: &Path) -> String {
        content_of(path, &Interrupt::default()).expect("a hash")
    }

    #[test]
    fn a_hash_is_that_of_the_command_and_of_what_it_names() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("task.toml");
        std::fs::write(&file, "one").expect("room");
        let of_words = |words: &[&str]| {
            let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
            Inputs::default().hash(&words, &Interrupt::default()).expect("a hash")
        };
        let of = |word: &str| of_words(&["evaluate", word]);
        let (named, listed) = (file.display().to_string(), format!("twin,{}", file.display()));
        let (before, in_list, of_folder) = (of(&named), of(&listed), of(&folder.path().display().to_string()));
        assert_eq!(before, of(&named));
        std::fs::write(&file, "two").expect("room");
        assert!(
            before != of(&named) && in_list != of(&listed) && of_folder != of(&folder.path().display().to_string())
        );
        assert_ne!(of("ab"), of_words(&["evaluatea", "b"]));
    }

    #[test]
    fn a_link_counts_as_what_it_leads_to() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        for name in ["copied/bag", "linked", "elsewhere/bag"] {
            std::fs::create_dir_all(at(name)).expect("room");
        }
        for name in
            ["copied/clip.mcap", "copied/bag/metadata.yaml", "elsewhere/clip.mcap", "elsewhere/bag/metadata.yaml"]
        {
            std::fs::write(at(name), "one").expect("room");
        }
        symlink(at("elsewhere/clip.mcap"), at("linked/clip.mcap")).expect("a link");
        symlink(at("elsewhere/bag"), at("linked/bag")).expect("a link");
        assert_eq!(hash(&at("copied")), hash(&at("linked")));
        symlink(at("linked"), at("session")).expect("a link");
        assert_eq!(hash(&at("session")), hash(&at("linked")), "the session itself may be one");
        for changed in ["elsewhere/clip.mcap", "elsewhere/bag/metadata.yaml"] {
            let before = hash(&at("linked"));
            std::fs::write(at(changed), "two").expect("room");
            assert_ne!(hash(&at("linked")), before, "{changed}");
        }
        // One that leads nowhere counts by where it leads.
        symlink("gone", at("linked/lost")).expect("a link");
        let before = hash(&at("linked"));
        std::fs::remove_file(at("linked/lost")).expect("a link");
        symlink("away", at("linked/lost")).expect("a link");
        assert_ne!(hash(&at("linked")), before);
    }

    #[test]
    fn circles_and_ladders_of_links_have_an_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("clip.mcap"), "one").expect("room");
        for name in ["a", "b"] {
            symlink(".", at(name)).expect("a link");
        }
        // Forty floors with two ways up each.
        std::fs::create_dir(at("floor_0")).expect("room");
        for floor in 1..40 {
            let here = at(&format!("floor_{floor}"));
            std::fs::create_dir(&here).expect("room");
            for way in ["left", "right"] {
                symlink(at(&format!("floor_{}", floor - 1)), here.join(way)).expect("a link");
            }
        }
        symlink("second", at("first")).expect("a link");
        symlink("first", at("second")).expect("a link");
        let before = hash(folder.path());
        assert_eq!(before, hash(folder.path()));
        std::fs::write(at("floor_0/clip.mcap"), "one").expect("room");
        assert_ne!(hash(folder.path()), before);
    }

    #[test]
    fn what_moves_between_names_or_folders_has_another_hash() {
        let whole = |make: &dyn Fn(&Path)| {
            let folder = tempfile::tempdir().expect("a folder");
            make(folder.path());
            hash(folder.path())
        };
        let file = |path: PathBuf, text: &str| std::fs::write(path, text).expect("room");
        let sub = |path: PathBuf| std::fs::create_dir(path).expect("room");
        let hashes = [
            whole(&|at| file(at.join("ab"), "c")),
            whole(&|at| file(at.join("a"), "bc")),
            whole(&|at| {
                sub(at.join("a"));
                file(at.join("a/b"), "c");
            }),
            whole(&|at| {
                sub(at.join("a"));
                file(at.join("b"), "c");
            }),
            whole(&|at| sub(at.join("a"))),
            whole(&|at| file(at.join("a"), "")),
            whole(&|_| ()),
        ];
        let apart: std::collections::BTreeSet<&String> = hashes.iter().collect();
        assert_eq!(apart.len(), hashes.len(), "{hashes:?}");
    }

    #[test]
    fn an_interruption_is_seen_while_a_large_file_is_hashed() {
        let folder = tempfile::tempdir().expect("a folder");
        let (large, interrupt) = (folder.path().join("large"), Interrupt::default());
        // Hours of hashing, without any bytes on the disk.
        std::fs::File::create(&large).and_then(|file| file.set_len(1 << 42)).expect("a sparse file");
        std::thread::scope(|scope| {
            let hashes = scope.spawn(|| content_of(folder.path(), &interrupt));
            interrupt.ask();
            assert!(matches!(hashes.join().expect("it ends"), Err(SweepError::Interrupted)));
        });
        let mut blocks = 0;
        let interrupt = Interrupt::default();
        let ended = file(&large, &mut [0; BLOCK], &interrupt, |read| {
            blocks = read;
            if read == 8 {
                interrupt.ask();
            }
        });
        assert!(matches!(ended, Err(SweepError::Interrupted)) && blocks == 8, "{blocks}");
    }
}
