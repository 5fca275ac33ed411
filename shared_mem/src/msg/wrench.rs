//! Force/torque sensor at the wrist.

use super::check::{self, Wrong};
use super::wire::plain;
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// One sample. Topic `/wrench`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/Wrench/1")]
#[repr(C)]
pub struct Wrench {
    /// When the sample reached this machine: monotonic clock [ns].
    pub stamp_ns: u64,
    /// The sensor's own stamp [ns], or the kernel's receive stamp where it has none.
    pub device_ns: u64,
    /// Counts the samples.
    pub sequence: u64,
    /// Force that the environment exerts on the tool, sensor frame [N].
    pub force: [f64; 3],
    /// Torque about the sensor's origin, sensor frame [N m].
    pub torque: [f64; 3],
    /// Bit i set: channel i (fx, fy, fz, tx, ty, tz) was at its range's end.
    pub saturated: u32,
    /// Keeps the size a multiple of 8; always 0.
    pub reserved: u32,
}

impl Wrench {
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::running("device_ns", self.device_ns)?;
        check::running("sequence", self.sequence)?;
        check::numbers("force", &self.force)?;
        check::numbers("torque", &self.torque)?;
        check::count("saturated", self.saturated, 0, 0b11_1111)
    }
}

plain!(Wrench);
