//! What is on shared memory right now, for `rt_bridge doctor`.

use super::place::{ForeignFile, Place, PlaceError, all_foreign_files, folder};
use super::{Service, TransportError, domain};
use iceoryx2::node::NodeView;
use iceoryx2::prelude::*;
use std::path::PathBuf;

/// A seat on shared memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeReport {
    /// Name the process gave itself.
    pub name: String,
    /// Program.
    pub executable: String,
    /// Process id.
    pub pid: u32,
    /// `false`: the process died; what it left is cleared away at the next start of any process.
    pub alive: bool,
}

/// Everything found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SharedMemoryReport {
    /// Seats of this domain.
    pub nodes: Vec<NodeReport>,
    /// Seats whose owner could not be read.
    pub unreadable: usize,
}

/// The folder in which this user's processes find each other.
///
/// # Errors
/// [`PlaceError`] when it is not this user's alone, with the remedy.
pub fn book_keeping() -> Result<PathBuf, PlaceError> {
    folder(rustix::process::geteuid().as_raw())
}

/// Files of other users in shared memory under names of this user's, in every domain. None of them is used.
pub fn foreign_files() -> Vec<ForeignFile> {
    all_foreign_files(rustix::process::geteuid().as_raw())
}

/// Lists the seats of this domain.
///
/// # Errors
/// [`TransportError`] when shared memory is not usable.
pub fn survey() -> Result<SharedMemoryReport, TransportError> {
    let mut report = SharedMemoryReport::default();
    iceoryx2::node::Node::<Service>::list(&Place::open(&domain())?.configuration()?, |state| {
        let (details, alive) = match &state {
            NodeState::Alive(view) => (view.details().clone(), true),
            NodeState::Dead(view) => (view.details().clone(), false),
            NodeState::Inaccessible(_) | NodeState::Undefined(_) => (None, false),
        };
        match details {
            Some(details) => report.nodes.push(NodeReport {
                name: details.name().as_str().to_owned(),
                executable: details.executable().to_string(),
                pid: u32::try_from(details.process_id().value()).unwrap_or(0),
                alive,
            }),
            None => report.unreadable += 1,
        }
        CallbackProgression::Continue
    })
    .map_err(TransportError::node)?;
    Ok(report)
}
