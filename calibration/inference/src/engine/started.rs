//! Everything that a process of an engine started, killed: what is in its process group, and what carries its mark.
//!
//! A program can leave group and session of its parent (`setsid`), and the kernel hands it to another parent when its own ends. What it
//! began with stays readable in `/proc`, and its children begin with the same: its environment. So each process of an engine is started
//! with a mark there that no other has. Needs no rights but those over one's own processes. What leaves the group *and* starts a
//! program with an environment of its own (`env -i`), or runs as another user, is not found.

use rustix::fd::OwnedFd;
use rustix::process::{Pid, PidfdFlags, Signal, kill_process_group, pidfd_open, pidfd_send_signal};
use shared_mem::input;
use std::io::Read as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The variable that holds the mark.
pub(super) const VARIABLE: &str = "TWINALIGN_ENGINE";
/// A process that forks as fast as it is killed is pursued for so long (a choice).
const KILL_TIMEOUT: Duration = Duration::from_millis(500);
/// How long the kernel is given to end what was killed before it is looked again (a choice).
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// More than this of an environment is not read: the kernel starts no program with more, unless asked to [bytes].
const MAX_ENVIRONMENT_BYTES: u64 = 8 << 20;

/// Where what a process started is found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Traces {
    /// Its process group, which it leads.
    pub(super) group: Pid,
    /// What [`VARIABLE`] holds in it.
    pub(super) mark: String,
}

/// A mark that no other process has.
pub(super) fn mark() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    format!("{}.{now}.{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Kills what left these traces, and returns when nothing of it is found any more, or after half a second.
pub(super) fn kill(all: &[Traces]) {
    for traces in all {
        // One that is gone already needs no killing.
        let _gone = kill_process_group(traces.group, Signal::KILL);
    }
    let began = Instant::now();
    // Once more: what was looked at may have started another in between.
    while !all.is_empty() && began.elapsed() < KILL_TIMEOUT {
        let found = marked(all);
        if found.is_empty() {
            return;
        }
        for process in found {
            let _gone = pidfd_send_signal(process, Signal::KILL);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// The processes that carry one of the marks.
fn marked(all: &[Traces]) -> Vec<OwnedFd> {
    let marks: Vec<Vec<u8>> = all.iter().map(|traces| format!("{VARIABLE}={}", traces.mark).into_bytes()).collect();
    let Ok(entries) = std::fs::read_dir("/proc") else { return Vec::new() };
    let carries = |folder: &Path| -> Option<OwnedFd> {
        let pid = Pid::from_raw(folder.file_name()?.to_str()?.parse().ok()?)?;
        // Held before it is looked at: where its number is given to another process in between, the signal goes to nobody.
        let process = pidfd_open(pid, PidfdFlags::empty()).ok()?;
        let mut environment = Vec::new();
        input::open(&folder.join("environ")).ok()?.take(MAX_ENVIRONMENT_BYTES).read_to_end(&mut environment).ok()?;
        environment.split(|byte| *byte == 0).any(|entry| marks.iter().any(|mark| mark == entry)).then_some(process)
    };
    entries.flatten().filter_map(|entry| carries(&entry.path())).collect()
}
