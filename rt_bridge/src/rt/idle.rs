//! How deeply idle processors sleep: a sleep state that takes long to leave makes every wake-up late. Linux keeps the shortest
//! limit that any process asks for, as long as that process holds the file open.

use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, write};
use std::fmt;

/// Linux's file for the longest time that a processor may take to leave its sleep, a signed number of 32 bits [us].
const DEVICE: &str = "/dev/cpu_dma_latency";
/// What it costs, for people.
const COST: &str = "idle processors sleep deeply, and the loop wakes up tens of microseconds later";
/// What lets a user of the group `realtime` write the file, from now on.
const RULE: &str = "allow it to the group `realtime`: `echo 'KERNEL==\"cpu_dma_latency\", GROUP=\"realtime\", MODE=\"0660\"' | sudo tee /etc/udev/rules.d/99-cpu-dma-latency.rules && sudo udevadm control --reload && sudo udevadm trigger --sysname-match=cpu_dma_latency`";

/// While it lives, no processor of this machine sleeps more deeply than it leaves at once.
#[derive(Debug)]
pub struct ShallowIdle {
    _held_open: OwnedFd,
}

/// The limit cannot be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub struct DeepIdle(Errno);

impl ShallowIdle {
    /// Asks for it.
    ///
    /// # Errors
    /// [`DeepIdle`] when this user may not, or there is no such file.
    pub fn hold() -> Result<Self, DeepIdle> {
        let device = open(DEVICE, OFlags::WRONLY | OFlags::CLOEXEC, Mode::empty()).map_err(DeepIdle)?;
        write(&device, &0_i32.to_ne_bytes()).map_err(DeepIdle)?;
        Ok(Self { _held_open: device })
    }
}

impl From<Errno> for DeepIdle {
    fn from(reason: Errno) -> Self {
        Self(reason)
    }
}

impl fmt::Display for DeepIdle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Errno::NOENT | Errno::NXIO => {
                write!(f, "there is no {DEVICE}: {COST}; in a container, pass it in with `--device {DEVICE}`")
            }
            errno => write!(f, "{DEVICE} may not be written ({errno}): {COST}; {RULE}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_says_what_it_costs_and_how_to_allow_it() {
        let denied = DeepIdle(Errno::ACCESS).to_string();
        assert!(denied.contains("Permission denied") && denied.contains("; allow it"), "{denied}");
        assert!(denied.contains("99-cpu-dma-latency.rules"), "{denied}");
        let missing = DeepIdle(Errno::NOENT).to_string();
        assert!(missing.contains("; in a container, pass it in with `--device /dev/cpu_dma_latency`"), "{missing}");
    }
}
