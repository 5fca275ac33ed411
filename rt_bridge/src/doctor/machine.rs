//! Scheduling, memory, processors.

use super::Finding;
use crate::rt::process::{self, Limit};

/// Lines for the limits of one user, for `/etc/security/limits.d/`.
const LIMITS: &str = "put `@realtime - rtprio 99` and `@realtime - memlock unlimited` into /etc/security/limits.d/realtime.conf, add yourself to the group `realtime`, log in again";

pub(super) fn examine() -> Vec<Finding> {
    vec![scheduling(), memory_lock(), processors()]
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
            Finding::warning("scheduling", format!("SCHED_FIFO is refused (limit rtprio: {limit})"), LIMITS).delaying()
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
    Finding::warning("memory lock", format!("only a part may be locked (limit memlock: {limit})"), LIMITS).delaying()
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
