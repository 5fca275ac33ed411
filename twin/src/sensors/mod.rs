//! What the instruments around the simulated cell report: a depth camera, an object tracker, a force sensor. Each takes the true
//! state of [`crate::sim::SimCell`] and adds what the real instrument adds: noise, latency, its own clock. Encoders belong to
//! the simulated arm itself.

pub mod camera;
mod depth;
pub mod tracker;
pub mod wrench;

/// How far the simulated camera's clock is ahead of the simulated robot's [ns]: two devices never share an epoch.
const CAMERA_EPOCH_NS: u64 = 86_400_123_456_789;

/// The camera's own stamp of a moment of the simulation [ns].
pub fn camera_clock_ns(time_ns: u64) -> u64 {
    CAMERA_EPOCH_NS + time_ns
}
