//! A Franka Research 3 over the Franka Control Interface, version 10.

use crate::arm::{Arm, ConnectError};
use crate::rt::Realtime;

/// Connects to the robot at `host`.
///
/// # Errors
/// [`ConnectError`] when nobody answers there.
pub fn connect(host: &str, realtime: Realtime) -> Result<Box<dyn Arm>, ConnectError> {
    let what = format!("not connected yet, {realtime:?}");
    Err(ConnectError::NoAnswer { host: host.to_owned(), what })
}
