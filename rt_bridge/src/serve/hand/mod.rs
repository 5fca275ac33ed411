//! The Franka Hand beside the arm: version 3 of its protocol, on a port of its own, with a clock of its own. Its fingers
//! close on nothing: the cell has no object between them.
//!
//! | file | owns |
//! |---|---|
//! | `fingers` | how the fingers move and which action that is |
//! | `wire` | from messages to requests, and the state's datagram |
//! | [`service`] | port, client, the hand's clock |

mod fingers;
mod service;
mod wire;

pub(super) use service::HandService;
pub(super) use wire::PORT;
