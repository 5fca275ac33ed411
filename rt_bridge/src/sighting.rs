//! A pose of one of the cell's objects on its way to shared memory.

use shared_mem::msg::object::{NamedPose, ObjectName, ObjectPose};
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, TransportError};

/// Whose pose it is, and the pose.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Whether it is the first object's, which readers of `/object/pose` follow.
    pub is_first: bool,
    /// Its name; empty for the one object of a cell that names none.
    pub name: ObjectName,
    pub pose: ObjectPose,
}

/// The topics of poses.
#[derive(Debug)]
pub(crate) struct PosePorts {
    first: Publisher<ObjectPose>,
    named: Publisher<NamedPose>,
}

impl PosePorts {
    /// Opens them, in the thread that will use them.
    pub(crate) fn open(node: &Node) -> Result<Self, TransportError> {
        Ok(Self { first: node.publisher(topics::OBJECT_POSE)?, named: node.publisher(topics::OBJECT_POSES)? })
    }

    /// Sends a pose on every topic that it belongs to.
    pub(crate) fn send(&self, sighting: &Sighting) -> Result<(), TransportError> {
        if sighting.is_first {
            self.first.send(&sighting.pose)?;
        }
        if !sighting.name.is_empty() {
            self.named.send(&NamedPose::new(sighting.name, &sighting.pose))?;
        }
        Ok(())
    }

    /// Gives readers that came late what they want to know at once.
    pub(crate) fn greet_new_readers(&self) -> Result<(), TransportError> {
        self.first.greet_new_readers()?;
        self.named.greet_new_readers()
    }
}
