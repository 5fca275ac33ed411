//! Topics of one host on another: `rt_bridge link`. The robot's host sends states and pictures, the other host publishes
//! them on its own shared memory with the stamps of their origin, and twin, viewer and recorder there run as they would
//! beside the bridge.
//!
//! | module | owns |
//! |---|---|
//! | [`endpoint`] | `tcp/HOST:PORT` |
//! | [`crossing`] | which topics cross and in which direction; commands do not, unless they are named |
//! | [`envelope`] | what stands beside a message's bytes on the way: sender, number, time, schema |
//! | [`history`] | numbered messages that the sender keeps, to send again what the other host missed |
//! | [`order`] | the receiver's count: next in order, missing, repeated, or from a stranger |
//! | [`queue`], [`pace`] | what waits for a thread, the oldest dropped first; how fast a backlog is published |
//! | [`clock`] | how far the clocks of two hosts are apart, from round trips |
//! | [`ages`], [`report`] | how long messages took, and the answer of the program |
//! | `network` | zenoh, behind the feature `zenoh` |
//!
//! Everything but `network` is free of sockets and tested without any.
#![warn(missing_docs)]

pub mod ages;
pub mod clock;
pub mod crossing;
pub mod endpoint;
pub mod envelope;
pub mod history;
#[cfg(feature = "zenoh")]
mod network;
pub mod order;
pub mod pace;
pub mod queue;
pub mod report;

use crossing::Plan;
use endpoint::Endpoint;
#[cfg(not(feature = "zenoh"))]
use report::Report;
use shared_mem::transport::TransportError;
#[cfg(not(feature = "zenoh"))]
use std::sync::{Arc, atomic::AtomicBool};
use std::time::Duration;

/// Where the other host is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Side {
    /// It connects to us here.
    Listen(Endpoint),
    /// It listens there.
    Connect(Endpoint),
}

/// What to do, and until when.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Where the other host is.
    pub side: Side,
    /// What crosses.
    pub plan: Plan,
    /// Stop after this long.
    pub duration: Option<Duration>,
}

/// The hosts are not, or no longer, linked.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The program was built without the network.
    #[error(
        "this rt_bridge was built without topics between hosts; build it with `cargo build --release --workspace --features rt_bridge/link`, or install it with `cargo install --path rt_bridge --locked --features link`"
    )]
    NotBuilt,
    /// The address cannot be listened at.
    #[error(
        "cannot listen at {endpoint}: {what}; give another address or port, or stop the program that has it (`ss -ltnp` names it)"
    )]
    Listen {
        /// The address.
        endpoint: Endpoint,
        /// What the network said.
        what: String,
    },
    /// The other host was not reached before the end.
    #[error(
        "{endpoint} was not reached: {what}; start `rt_bridge link --listen tcp/0.0.0.0:PORT` on that host, and see that no firewall closes the port"
    )]
    NotReached {
        /// The address.
        endpoint: Endpoint,
        /// What the network said last.
        what: String,
    },
    /// The network refuses to work.
    #[error("the network failed: {what}; start the link again")]
    Network {
        /// What it said.
        what: String,
    },
    /// A thread cannot be made, or has crashed.
    #[error("a thread of the link failed: {0}; start it again")]
    Thread(String),
    /// Shared memory.
    #[error(transparent)]
    Transport(#[from] TransportError),
}

#[cfg(feature = "zenoh")]
pub use network::run;

/// Links two hosts where the network is built in.
///
/// # Errors
/// [`LinkError::NotBuilt`].
#[cfg(not(feature = "zenoh"))]
pub fn run(_settings: &Settings, _stop: &Arc<AtomicBool>) -> Result<Report, LinkError> {
    Err(LinkError::NotBuilt)
}
