//! Where a file says that it comes from: metadata records, one an origin. They stand before the messages that they are about, or
//! where the arm changed, so that a file has to be read to its end before all are known.

use super::container::Messages;
use crate::origin::{Origin, Origins};
use mcap::records::Metadata;
use std::io::{Read, Seek};

/// Metadata record that says it, and its keys.
const RECORD: &str = "twinalign.origin";
const KIND: &str = "kind";
const NAME: &str = "name";
const FORMAT: &str = "format";
/// Kinds.
const SIMULATION: &str = "simulation";
const ROBOT: &str = "robot";
const REPLAY: &str = "replay";
const IMPORT: &str = "import";
const ELSEWHERE: &str = "elsewhere";
const UNKNOWN: &str = "unknown";

/// Formats that are read as they are.
const BAG: &str = "ROS 2 bag";
const TWINALIGNER: &str = "TwinAligner folder";

/// The record to write.
pub(super) fn record(origin: &Origin) -> Metadata {
    let (kind, name, format) = match origin {
        Origin::Simulation => (SIMULATION, None, None),
        Origin::Robot { host } => (ROBOT, Some(host), None),
        Origin::Replay { clip } => (REPLAY, Some(clip), None),
        Origin::Import { file, format } => (IMPORT, Some(file), Some(format)),
        Origin::Elsewhere { format } => (ELSEWHERE, None, Some(format)),
    };
    let pairs = [(NAME, name), (FORMAT, format)].into_iter().filter_map(|(key, value)| Some((key, value?.as_str())));
    let pairs = pairs.chain([(KIND, kind)]).map(|(key, value)| (key.to_owned(), value.to_owned()));
    Metadata { name: RECORD.into(), metadata: pairs.collect() }
}

/// The records of a file that is no own one: also that nobody knows.
pub(super) fn records(origins: &Origins) -> Vec<Metadata> {
    if origins.is_unknown() {
        let pairs = [(KIND.to_owned(), UNKNOWN.to_owned())];
        return vec![Metadata { name: RECORD.into(), metadata: pairs.into() }];
    }
    origins.iter().map(record).collect()
}

/// What the file says, as far as it was read. What says nothing about itself comes from another program, unless it is an own
/// one (`is_own`): then nobody knows.
pub(super) fn read<R: Read + Seek>(messages: &Messages<R>, is_own: bool) -> Origins {
    let says = messages.metadata.iter().any(|m| m.name == RECORD);
    if says || is_own { said(messages) } else { Origin::elsewhere(BAG).into() }
}

/// What the file says itself, as far as it was read.
pub(super) fn said<R: Read + Seek>(messages: &Messages<R>) -> Origins {
    let mut origins = Origins::default();
    for record in messages.metadata.iter().filter(|m| m.name == RECORD) {
        let text = |key: &str| record.pairs.get(key).map_or("", String::as_str);
        let origin = match text(KIND) {
            SIMULATION => Some(Origin::Simulation),
            ROBOT => Origin::robot(text(NAME)),
            REPLAY => Origin::replay(text(NAME)),
            IMPORT => Origin::import(text(NAME), text(FORMAT)),
            ELSEWHERE => Some(Origin::elsewhere(text(FORMAT))),
            _ => None,
        };
        if let Some(origin) = origin {
            origins.add(origin);
        }
    }
    origins
}

/// Of a TwinAligner folder, which has no room for it.
pub(super) fn of_folder() -> Origins {
    Origin::elsewhere(TWINALIGNER).into()
}
