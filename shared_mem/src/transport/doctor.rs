//! What is on shared memory right now, for `rt_bridge doctor`.

use super::{Service, TransportError, configuration, domain};
use iceoryx2::node::NodeView;
use iceoryx2::prelude::*;

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

/// Lists the seats of this domain.
///
/// # Errors
/// [`TransportError::Node`] when shared memory is not usable.
pub fn survey() -> Result<SharedMemoryReport, TransportError> {
    let mut report = SharedMemoryReport::default();
    iceoryx2::node::Node::<Service>::list(&configuration(&domain())?, |state| {
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
    .map_err(|e| TransportError::Node { what: format!("{e:?}") })?;
    Ok(report)
}
