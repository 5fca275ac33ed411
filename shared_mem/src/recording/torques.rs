//! In which control period the torques of a recording's rows acted, as the file says it about itself. A robot's state
//! reports the period that has just ended; a controller that logs what it has calculated means the one that begins. Between
//! the two lies a millisecond: dozens of sigmas of a good torque sensor.

use super::container::Messages;
use mcap::records::Metadata;
use std::io::{Read, Seek};

/// Metadata record that says it, and its only key.
const RECORD: &str = "twinalign.torques";
const ACT: &str = "act";
const UNTIL: &str = "until the stamp of their row";
const FROM: &str = "from the stamp of their row";

/// The record to write.
pub(super) fn record(end_at_rows: bool) -> Metadata {
    let act = if end_at_rows { UNTIL } else { FROM };
    Metadata { name: RECORD.into(), metadata: [(ACT.to_owned(), act.to_owned())].into() }
}

/// What the file says; `usual` where it says nothing. All of the file must have been read.
pub(super) fn end_at_rows<R: Read + Seek>(messages: &Messages<R>, usual: bool) -> bool {
    let said = messages.metadata.iter().find(|m| m.name == RECORD).and_then(|m| m.pairs.get(ACT));
    match said.map(String::as_str) {
        Some(UNTIL) => true,
        Some(FROM) => false,
        _ => usual,
    }
}
