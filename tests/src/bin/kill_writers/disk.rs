//! A small disk that is full at a chosen point: a `tmpfs`, which only root can mount.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A filler is written in parts of one page, which is what a tmpfs counts in [bytes].
const PAGE: usize = 4096;

/// A mounted disk; it is taken down when this goes.
pub(crate) struct SmallDisk(PathBuf);

impl SmallDisk {
    /// A disk of `size` bytes; `None` where nothing can be mounted.
    pub(crate) fn mount(at: &Path, size: u64) -> Option<Self> {
        std::fs::create_dir_all(at).ok()?;
        let options = format!("size={size}");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &options, "tmpfs"]).arg(at).status();
        mounted.is_ok_and(|status| status.success()).then(|| Self(at.to_owned()))
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.0
    }

    /// Fills the disk but for `room` bytes; what is really free then.
    pub(crate) fn leave(&self, room: u64) -> u64 {
        let mut filler = File::create(self.0.join("filler")).expect("a filler");
        while self.free() > room && filler.write_all(&[0; PAGE]).is_ok() {}
        self.free()
    }

    /// Takes the filler away.
    pub(crate) fn make_room(&self) {
        std::fs::remove_file(self.0.join("filler")).expect("the filler");
    }

    fn free(&self) -> u64 {
        rustix::fs::statvfs(&self.0).map_or(0, |disk| disk.f_bavail * disk.f_frsize)
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _stays = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}
