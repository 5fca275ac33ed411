//! Whether this process was asked to end, for work that can take longer than a person waits: reading a recording,
//! simulating one.
//!
//! A signal concerns a process and not one of its tasks, so there is one flag for all of it: readers and simulations are
//! made, cloned and kept in many places, and none of them can be forgotten. Programs that have to go on reading after a
//! signal, because they keep what was recorded, do not set it.

use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Asks all reading and simulating in this process to end. There is no way back.
pub fn ask() {
    ASKED.store(true, Ordering::Relaxed);
}

/// Whether the end was asked for.
pub fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
