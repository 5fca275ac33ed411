//! The cell at one moment, as far as a camera sees it: the arm, and everything on the table by its name.

use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::Joints;
use shared_mem::msg::object::ObjectName;

/// Most bodies of a cell: objects, and parts of those that move in themselves.
pub const MOST_BODIES: usize = 32;

/// The cell at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SceneSnapshot {
    /// Simulated clock [ns].
    pub time_ns: u64,
    /// Joints that count.
    pub dof: usize,
    /// Joint positions [rad].
    pub q: Joints,
    /// The first object's geometric centre, where there is an object.
    pub object: Option<Pose<Base, Object>>,
    /// All bodies that have a name, the first object among them.
    pub named: NamedPoses,
}

impl SceneSnapshot {
    /// Where the body of this name is; an empty name stands for the first object.
    pub fn of(&self, name: &ObjectName) -> Option<Pose<Base, Object>> {
        match name.is_empty() {
            true => self.object,
            false => self.named.of(name),
        }
    }
}

/// Poses by name.
#[derive(Clone, Copy)]
pub struct NamedPoses {
    count: usize,
    poses: [(ObjectName, Pose<Base, Object>); MOST_BODIES],
}

impl Default for NamedPoses {
    fn default() -> Self {
        Self { count: 0, poses: [(ObjectName::default(), Pose::identity()); MOST_BODIES] }
    }
}

impl PartialEq for NamedPoses {
    fn eq(&self, other: &Self) -> bool {
        self.all() == other.all()
    }
}

impl std::fmt::Debug for NamedPoses {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_map().entries(self.all().iter().map(|(name, pose)| (name, pose))).finish()
    }
}

impl NamedPoses {
    /// Adds one; nothing happens to one without a name, or where there are [`MOST_BODIES`] already.
    pub fn push(&mut self, name: ObjectName, pose: Pose<Base, Object>) {
        if let Some(place) = self.poses.get_mut(self.count).filter(|_| !name.is_empty()) {
            *place = (name, pose);
            self.count += 1;
        }
    }

    /// That of this name.
    pub fn of(&self, name: &ObjectName) -> Option<Pose<Base, Object>> {
        self.all().iter().find(|(own, _)| own == name).map(|(_, pose)| *pose)
    }

    /// All, in the order of cell.toml.
    pub fn all(&self) -> &[(ObjectName, Pose<Base, Object>)] {
        &self.poses[..self.count]
    }
}
