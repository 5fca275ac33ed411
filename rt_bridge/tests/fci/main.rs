//! The FR3 driver against a scripted robot on this machine's loopback: what it sends, what it takes over, how it fails.
//! Bytes are laid out by hand from the protocol's offsets, so that the driver is not tested against itself.

mod allocation;
#[path = "../counting/mod.rs"]
mod counting;
mod forged;
mod live;
mod motion;
mod refusal;
mod robot;
