//! Slow devices beside the arm: gripper and force/torque sensor. Each has a thread and ports of its own, far from the
//! control thread, so that one that falls silent, is unplugged or comes back touches nothing but its own topic. What
//! happened is said once, in one line with the remedy, on `/events`.

mod attendance;
mod fault;
mod service;

pub use fault::DeviceFault;
pub use service::{Lines, Service, ServiceError};

use std::time::Duration;

/// How long after a failure a device is tried again.
pub(crate) const RETRY: Duration = Duration::from_secs(1);

/// A device that was reached.
pub trait Device {
    /// What it reports.
    type Sample;
    /// Its commands.
    type Order;

    /// One round: hands `order` over and reads. Takes as long as the device's rate asks for, a second at most. `None` where
    /// nothing new is known, which is no failure.
    ///
    /// # Errors
    /// [`DeviceFault`] when it cannot be used any more; it is opened anew then.
    fn round(&mut self, order: Option<&Self::Order>) -> Result<Option<Self::Sample>, DeviceFault>;

    /// What the device itself complains about, with the remedy: asked after each round, said when it changes.
    fn complaint(&self) -> Option<String> {
        None
    }
}
