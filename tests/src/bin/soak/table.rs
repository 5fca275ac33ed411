//! Memory of the programs and of their shared memory over time.

use super::cell::Running;
use rustix::process::geteuid;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::time::Duration;

/// A line of the table every so often.
const EVERY: Duration = Duration::from_secs(10);
/// What a program may take more than at the start of growth before it counts as grown [bytes]: an allocator's arenas, and the
/// index that a recorder keeps of its file.
const SPARE: u64 = 16 << 20;
/// A block of a file, as the kernel counts them [bytes].
const BLOCK: u64 = 512;

/// Memory of one program, or of one domain in `/dev/shm` [bytes].
#[derive(Debug, Clone, Copy, Default)]
struct Used {
    /// The most until growth is counted.
    at_first: u64,
    /// The most since.
    later: u64,
    last: u64,
}

/// The table, and the most of each column.
pub(crate) struct Table {
    file: File,
    next: Duration,
    growth_from: Duration,
    used: BTreeMap<String, Used>,
}

impl Table {
    pub(crate) fn create(file: &Path, growth_from: Duration) -> Self {
        let mut file = File::create(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        writeln!(file, "minutes,what,bytes").expect("the table");
        Self { file, next: Duration::ZERO, growth_from, used: BTreeMap::new() }
    }

    /// A line for each program and each domain, where it is time for one.
    pub(crate) fn look(&mut self, at: Duration, running: &[Running]) {
        if at < self.next {
            return;
        }
        self.next = at + EVERY;
        for cell in running {
            for (program, pid) in cell.processes() {
                self.note(at, format!("{}: {program}", cell.name()), resident(pid));
            }
            self.note(at, format!("{}: /dev/shm", cell.name()), shared(cell.domain()));
        }
    }

    fn note(&mut self, at: Duration, what: String, bytes: u64) {
        writeln!(self.file, "{:.2},{what},{bytes}", at.as_secs_f64() / 60.0).expect("the table");
        let used = self.used.entry(what).or_default();
        let most = if at < self.growth_from { &mut used.at_first } else { &mut used.later };
        *most = (*most).max(bytes);
        used.last = bytes;
    }

    /// What takes more than it did at first.
    pub(crate) fn grown(&self) -> Vec<String> {
        let grown = self.used.iter().filter(|(_, used)| used.later > used.at_first + SPARE);
        grown.map(|(what, used)| format!("{what}: {} MiB more", (used.later - used.at_first) >> 20)).collect()
    }

    /// The most of each column before and after growth is counted, and the last value.
    pub(crate) fn json(&self) -> Value {
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let rows = self.used.iter().map(|(what, used)| {
            let [first, later, last] = [used.at_first, used.later, used.last].map(mebibytes);
            (what.clone(), json!({ "most_at_first_mib": first, "most_later_mib": later, "last_mib": last }))
        });
        Value::Object(rows.collect())
    }
}

/// Resident memory of a process [bytes]; 0 where it is gone.
fn resident(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) * 1024
}

/// What a domain's files take in `/dev/shm` [bytes].
fn shared(domain: &str) -> u64 {
    let prefix = format!("twinalign_{}_{domain}_", geteuid().as_raw());
    let files = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    files
        .filter(|file| file.file_name().to_string_lossy().starts_with(&prefix))
        .filter_map(|file| file.metadata().ok())
        .map(|file| file.blocks() * BLOCK)
        .sum()
}
