//! What the control thread asks of the machine before it loops.

use super::process;
use crate::remark::Claim;
use std::io;

impl Claim {
    /// Asks for locked memory, `SCHED_FIFO`, exact timers and a core of its own for the calling thread.
    ///
    /// Being bound to a core is a help and no guarantee (a container may own a single one), so its refusal does not count.
    pub fn make() -> Self {
        let errno = |outcome: io::Result<()>| outcome.err().map(|e| e.raw_os_error().unwrap_or(0));
        let memory = errno(process::lock_memory());
        let fifo = errno(process::set_fifo(process::CONTROL_PRIORITY));
        process::set_exact_timers();
        let _bound = process::last_core().map(process::pin_to);
        Self { memory, fifo }
    }
}
