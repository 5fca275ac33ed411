//! Room in shared memory: taken before anything is written there.
//!
//! A file in a tmpfs can be made longer than what is free. Whoever then writes to a page of it that is not there is killed
//! by the kernel (SIGBUS), whether another program took the room a moment or an hour after the file was made.

use super::place::MEMORY;
use crate::output::size;
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, open, statvfs};
use rustix::io::Errno;
use std::cell::Cell;
use std::ffi::OsStr;
use std::fmt;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

thread_local! {
    /// What was refused last on this thread: iceoryx2 tells its caller no more than that something failed, or nothing at all.
    static REFUSED: Cell<Option<Refusal>> = const { Cell::new(None) };
}

/// A file that found no room [bytes].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Refusal {
    needed: u64,
    free: u64,
}

/// There is not enough room in shared memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoRoom {
    refusal: Refusal,
    /// What takes most of it.
    largest: Option<Lying>,
}

/// A file that lies in shared memory.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Lying {
    path: PathBuf,
    bytes: u64,
    owner: u32,
}

/// Takes the room for the whole of the file `name` in shared memory, which is `bytes` long; what it holds stays. `false`:
/// there is not enough, and [`with_room`] says so.
pub(super) fn take(name: &OsStr, bytes: usize) -> bool {
    let bytes = bytes as u64;
    let taken = open(Path::new(MEMORY).join(name), OFlags::WRONLY | OFlags::CLOEXEC, Mode::empty()).and_then(|file| {
        loop {
            match fallocate(&file, FallocateFlags::empty(), 0, bytes) {
                Err(Errno::INTR) => {}
                // A file system that reserves nothing is no tmpfs: ramfs, which has no limit either.
                Err(Errno::OPNOTSUPP) => return Ok(()),
                done => return done,
            }
        }
    });
    if taken == Err(Errno::NOSPC) {
        let free = statvfs(MEMORY).map_or(0, |disk| disk.f_bavail.saturating_mul(disk.f_frsize));
        REFUSED.set(Some(Refusal { needed: bytes, free }));
    }
    taken.is_ok()
}

/// Opens something in shared memory. A lack of room that was met on the way is the error, also where iceoryx2 goes on
/// without what it could not make.
///
/// # Errors
/// [`NoRoom`], else what `open` returns.
pub(super) fn with_room<T, E: From<NoRoom>>(open: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
    REFUSED.set(None);
    let opened = open();
    match REFUSED.take() {
        Some(refusal) => Err(NoRoom { refusal, largest: largest(Path::new(MEMORY)) }.into()),
        None => opened,
    }
}

/// The file that takes most of the room in a folder; those below it are left out.
fn largest(folder: &Path) -> Option<Lying> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter_map(|entry| {
        let found = entry.metadata().ok().filter(std::fs::Metadata::is_file)?;
        // In blocks of 512 bytes, whatever the file system's own are.
        Some(Lying { path: entry.path(), bytes: found.blocks().saturating_mul(512), owner: found.uid() })
    });
    files.max_by_key(|lying| lying.bytes).filter(|lying| lying.bytes > 0)
}

impl fmt::Display for NoRoom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Refusal { needed, free } = self.refusal;
        write!(f, "{MEMORY} is full: {} or more are needed there and {} are free", size(needed), size(free))?;
        if let Some(Lying { path, bytes, owner }) = &self.largest {
            write!(f, ", the most is taken by {path:?} with {} of user {owner}", size(*bytes))?;
        }
        f.write_str(
            "; remove what nobody needs (`df -h /dev/shm`, `ls -lS /dev/shm`), or make it larger with `mount -o remount,size=1G /dev/shm` (in a container: --shm-size=1g)",
        )
    }
}

impl std::error::Error for NoRoom {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_file_that_takes_most_room_is_named_and_not_the_longest() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(largest(folder.path()), None);
        fs::write(folder.path().join("small"), [1; 10]).expect("a file");
        fs::write(folder.path().join("taken"), [1; 100_000]).expect("a file");
        fs::File::create(folder.path().join("empty")).and_then(|file| file.set_len(1 << 30)).expect("a file of holes");
        let found = largest(folder.path()).expect("the largest");
        assert_eq!(found.path, folder.path().join("taken"));
        assert!(found.bytes >= 100_000, "{found:?}");
    }

    #[test]
    fn a_refusal_on_the_way_is_the_error_even_if_all_seems_well_and_is_forgotten_then() {
        let refusal = Refusal { needed: 2_500_000, free: 4096 };
        let refused = with_room(|| {
            REFUSED.set(Some(refusal));
            Ok::<_, NoRoom>(1)
        });
        let error = refused.expect_err("refused").to_string();
        assert!(error.starts_with("/dev/shm is full: 2.5 MB or more are needed there and 4.1 kB are free"), "{error}");
        assert!(error.contains("; remove what nobody needs (`df -h /dev/shm`"), "{error}");
        assert_eq!(with_room(|| Ok::<_, NoRoom>(2)), Ok(2));
        REFUSED.set(Some(refusal));
        assert_eq!(with_room(|| Ok::<_, NoRoom>(3)), Ok(3), "what was refused before does not count");
    }
}
