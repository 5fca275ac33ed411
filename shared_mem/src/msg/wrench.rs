//! Force/torque sensor at the wrist.

use iceoryx2::prelude::ZeroCopySend;

/// One sample. Topic `/wrench`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
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
