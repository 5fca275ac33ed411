//! The Franka Hand beside the arm: version 3 of its protocol, on a port of its own, with a clock of its own. Its fingers
//! (`crate::gripper`) close on nothing: the cell has no object between them.
//!
//! | file | owns |
//! |---|---|
//! | `wire` | from messages to requests, and the state's datagram |
//! | [`service`] | port, client, the hand's clock |

mod service;
pub(super) mod wire;

pub(super) use service::HandService;
pub(super) use wire::PORT;
