//! Shared memory: room, rights, and who sits on it.

use super::Finding;
use shared_mem::transport::{DOMAIN_VARIABLE, survey};
use std::path::Path;

/// Where Linux keeps shared memory.
const SHM: &str = "/dev/shm";
/// What a cell with a 1280x720 camera and all topics takes, rounded up [MB].
const COMFORTABLE_MB: u64 = 512;
/// What the arm's topics alone take, rounded up [MB].
const NEEDED_MB: u64 = 64;

pub(super) fn examine() -> Vec<Finding> {
    vec![room(), rights(), seats()]
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

/// iceoryx2 keeps its book-keeping in files that all users of a machine share.
fn rights() -> Finding {
    let folder = Path::new("/tmp/iceoryx2");
    if !folder.exists() {
        return Finding::ok("book-keeping", format!("{} will be made", folder.display()));
    }
    match rustix::fs::access(folder, rustix::fs::Access::WRITE_OK) {
        Ok(()) => Finding::ok("book-keeping", format!("{} is writable", folder.display())),
        Err(_) => Finding::problem(
            "book-keeping",
            format!("{} belongs to another user", folder.display()),
            "let that user stop its processes and remove the folder, or run as that user",
        ),
    }
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
