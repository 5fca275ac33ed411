//! What the control thread asks of the machine before it loops, and what it is granted.

use super::process;
use std::fmt;
use std::io;

/// The answer, as the kernel's error numbers; none where it granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    memory: Option<i32>,
    fifo: Option<i32>,
}

impl Claim {
    /// Asks for locked memory, `SCHED_FIFO` and a core of its own for the calling thread.
    ///
    /// Being bound to a core is a help and no guarantee (a container may own a single one), so its refusal does not count.
    #[must_use]
    pub fn make() -> Self {
        let errno = |outcome: io::Result<()>| outcome.err().map(|e| e.raw_os_error().unwrap_or(0));
        let memory = errno(process::lock_memory());
        let fifo = errno(process::set_fifo(process::CONTROL_PRIORITY));
        let _bound = process::last_core().map(process::pin_to);
        Self { memory, fifo }
    }

    /// `true` when everything was granted.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.memory.is_none() && self.fifo.is_none()
    }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let missing = [("memory cannot be locked", self.memory), ("SCHED_FIFO is refused", self.fifo)];
        let mut separator = "";
        for (what, errno) in missing {
            if let Some(errno) = errno {
                write!(f, "{separator}{what} ({})", io::Error::from_raw_os_error(errno))?;
                separator = ", ";
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named_with_the_kernels_reason() {
        let claim = Claim { memory: None, fifo: Some(libc::EPERM) };
        assert!(!claim.is_complete());
        assert_eq!(claim.to_string(), "SCHED_FIFO is refused (Operation not permitted (os error 1))");
    }
}
