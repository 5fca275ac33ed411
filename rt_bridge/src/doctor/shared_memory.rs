//! Shared memory: room, rights, and who sits on it.

use super::Finding;
use shared_mem::transport::{DOMAIN_VARIABLE, ForeignFile, PlaceError, book_keeping, foreign_files, survey};
use shared_mem::typed::Command;

/// Where Linux keeps shared memory.
const SHM: &str = "/dev/shm";
/// What a cell with a 1280x720 camera and all topics takes, rounded up [MB].
const COMFORTABLE_MB: u64 = 512;
/// What the arm's topics alone take, rounded up [MB].
const NEEDED_MB: u64 = 80;

pub(super) fn examine() -> Vec<Finding> {
    vec![room(), rights(), foreign(), seats()]
}

fn room() -> Finding {
    let Ok(disk) = rustix::fs::statvfs(SHM) else {
        return Finding::problem("shared memory", format!("{SHM} is not there"), "mount a tmpfs on /dev/shm");
    };
    let megabytes = |blocks: u64| blocks.saturating_mul(disk.f_frsize) / 1_000_000;
    let (free, all) = (megabytes(disk.f_bavail), megabytes(disk.f_blocks));
    let found = format!("{free} MB of {all} MB free in {SHM}");
    let remedy = "make it larger with `mount -o remount,size=1G /dev/shm` (in a container: --shm-size=1g)";
    if free < NEEDED_MB {
        Finding::problem("shared memory", found, remedy)
    } else if free < COMFORTABLE_MB {
        Finding::warning("shared memory", found, remedy)
    } else {
        Finding::ok("shared memory", found)
    }
}

/// The folder in which this user's processes find each other.
fn rights() -> Finding {
    match book_keeping() {
        Ok(folder) => Finding::ok("book-keeping", format!("{} is this user's alone", folder.display())),
        Err(PlaceError { what, remedy }) => Finding::problem("book-keeping", what, remedy),
    }
}

/// Files of other users under this user's names.
fn foreign() -> Finding {
    let files = foreign_files();
    let Some(ForeignFile { path, owner }) = files.first() else {
        return Finding::ok("other users", "none of their files bears a name of this user's");
    };
    let others = if files.len() > 1 { format!(" and {} more", files.len() - 1) } else { String::new() };
    Finding::problem(
        "other users",
        format!("{} belongs to user {owner}{others}", path.display()),
        format!("remove it as that user or as root: `{}`", Command::new("sudo rm").path(path)),
    )
}

fn seats() -> Finding {
    let domain = std::env::var(DOMAIN_VARIABLE).unwrap_or_else(|_| "0".into());
    let report = match survey() {
        Ok(report) => report,
        Err(e) => return Finding::problem("processes", e.to_string(), "see the lines above"),
    };
    let alive: Vec<_> = report.nodes.iter().filter(|n| n.alive).map(|n| format!("{} ({})", n.name, n.pid)).collect();
    let dead = report.nodes.iter().filter(|n| !n.alive).count() + report.unreadable;
    let living = if alive.is_empty() { "nobody".into() } else { alive.join(", ") };
    let found = format!("domain {domain}: {living}");
    if dead == 0 {
        return Finding::ok("processes", found);
    }
    Finding::warning(
        "processes",
        format!("{found}; {dead} left behind by processes that died"),
        "nothing to do: they are cleared away when the next process starts",
    )
}
