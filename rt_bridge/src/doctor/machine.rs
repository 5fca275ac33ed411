//! Kernel, scheduling, memory, processors.

use super::Finding;
use crate::rt::process::{self, Limit};
use std::fs;
use std::path::Path;

/// Lines for the limits of one user, for `/etc/security/limits.d/`.
const LIMITS: &str = "put `@realtime - rtprio 99` and `@realtime - memlock unlimited` into /etc/security/limits.d/realtime.conf, add yourself to the group `realtime`, log in again";

pub(super) fn examine() -> Vec<Finding> {
    vec![kernel(), scheduling(), memory_lock(), processors(), governor()]
}

fn kernel() -> Finding {
    let version = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let version = version.trim();
    let realtime = fs::read_to_string("/sys/kernel/realtime").is_ok_and(|flag| flag.trim() == "1");
    if realtime {
        Finding::ok("kernel", format!("{version}, PREEMPT_RT"))
    } else {
        Finding::warning(
            "kernel",
            format!("{version}, not PREEMPT_RT"),
            "install a real-time kernel before a robot moves; with `--realtime ignore` the bridge runs without",
        )
    }
}

/// Tried in a thread of its own, which ends with the priority.
fn scheduling() -> Finding {
    let tried = std::thread::spawn(|| process::set_fifo(process::CONTROL_PRIORITY)).join();
    match tried {
        Ok(Ok(())) => Finding::ok("scheduling", format!("SCHED_FIFO {} is granted", process::CONTROL_PRIORITY)),
        _ => {
            let limit = match process::limit(Limit::RealtimePriority) {
                Ok((soft, _)) => soft.map_or("unlimited".into(), |n| n.to_string()),
                Err(_) => "not known".into(),
            };
            Finding::warning("scheduling", format!("SCHED_FIFO is refused (limit rtprio: {limit})"), LIMITS)
        }
    }
}

fn memory_lock() -> Finding {
    if process::may_lock_all_memory() {
        return Finding::ok("memory lock", "all memory may be locked");
    }
    let limit = match process::limit(Limit::LockedMemory) {
        Ok((Some(bytes), _)) => format!("{} kB", bytes / 1024),
        _ => "not known".into(),
    };
    Finding::warning("memory lock", format!("only a part may be locked (limit memlock: {limit})"), LIMITS)
}

fn processors() -> Finding {
    let count = std::thread::available_parallelism().map_or(1, usize::from);
    let core = process::last_core().unwrap_or(0);
    let found = format!("{count} usable, the control thread takes number {core}");
    match count {
        0 | 1 => {
            Finding::problem("processors", found, "give this machine two cores: one belongs to the control thread")
        }
        2 | 3 => {
            Finding::warning("processors", found, "four cores keep camera, recorder and twin out of each other's way")
        }
        _ => Finding::ok("processors", found),
    }
}

fn governor() -> Finding {
    let folder = Path::new("/sys/devices/system/cpu");
    let core = process::last_core().unwrap_or(0);
    match fs::read_to_string(folder.join(format!("cpu{core}/cpufreq/scaling_governor"))) {
        Ok(name) if name.trim() == "performance" => Finding::ok("governor", "performance"),
        Ok(name) => Finding::warning(
            "governor",
            format!("{} on core {core}", name.trim()),
            "set it with `cpupower frequency-set -g performance`: clocks that ramp up cost hundreds of microseconds",
        ),
        Err(_) => Finding::ok("governor", "the clock is not this system's to set (a virtual machine?)"),
    }
}
