//! Why a device cannot be used: one line each, with the remedy.

/// A device is lost. `device` is what the user called it, as in `serial:///dev/ttyUSB0`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeviceFault {
    /// There is no way to it.
    #[error("{device} cannot be opened ({why}); {remedy}")]
    NotOpened {
        device: String,
        /// What the system said.
        why: String,
        /// What to do.
        remedy: String,
    },
    /// It was there and is not any more.
    #[error("{device} is gone ({why}); plug it in again, it is taken up by itself")]
    Gone {
        device: String,
        /// What the system said.
        why: String,
    },
    /// The way is there, nobody answers.
    #[error("{device} does not answer; check {check}; it is taken up by itself when it does")]
    Silent {
        device: String,
        /// What to look at.
        check: &'static str,
    },
    /// Somebody answers, not as this device does.
    #[error("{device} answers garbled ({why}); check {check}")]
    Garbled {
        device: String,
        /// What is wrong with the answers.
        why: String,
        /// What to look at.
        check: &'static str,
    },
    /// The CAN controller has given up.
    #[error(
        "{device}: the bus is off after too many errors; check its bit rate and the 120 ohm at both ends, then `ip link set {interface} down` and `ip link set {interface} up`"
    )]
    BusOff {
        device: String,
        /// Its network interface.
        interface: String,
    },
}
