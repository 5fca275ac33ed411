//! What the machine grants to the control thread before it loops.

use std::fmt;
use std::io;

/// The answer, as the kernel's error numbers; none where it granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    pub(crate) memory: Option<i32>,
    /// `SCHED_FIFO`.
    pub(crate) fifo: Option<i32>,
}

impl Claim {
    /// `true` when everything was granted.
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
