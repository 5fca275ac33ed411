//! What stands around the point that a scan looks at: every object of the cell beside the one that is scanned, where it was seen last,
//! or, unseen, where cell.toml has it start. Base frame; m.

use super::obstacle::{OBJECT_CLEARANCE, Obstacle, corners};
use nalgebra::{Isometry3, Point3};
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::msg::object::{NamedPose, ObjectName};
use shared_mem::topics::OBJECT_POSES;
use shared_mem::transport::{Node, Subscriber, TransportError};
use std::time::{Duration, Instant};
use twin::scene::{MeshFileError, bodies_of, body_starts};

/// How long poses are waited for.
const FIRST_POSES: Duration = Duration::from_secs(2);

/// What stands around cannot be known.
#[derive(Debug, thiserror::Error)]
pub(super) enum AroundError {
    /// Shared memory failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The shape of an object is not known.
    #[error("{0}; where it is the object that is scanned, name it with --object")]
    Shape(MeshFileError),
    /// No object of that name.
    #[error("{0}")]
    Unknown(String),
}

/// A seat beside the tracker of a cell with several objects.
#[derive(Debug)]
pub(super) struct Around {
    poses: Subscriber<NamedPose>,
    others: Vec<Other>,
    // Declared last: ports go before the node they belong to.
    node: Node,
}

#[derive(Debug)]
struct Other {
    name: ObjectName,
    object: usize,
    corners: [Point3<f64>; 8],
    pose: Isometry3<f64>,
    is_seen: bool,
}

impl Around {
    /// Takes the seat in `domain` (default: the one this process was started in); `scanned`: the name of the object that is scanned.
    /// `None` for a cell of fewer than two objects: what stands there is scanned.
    ///
    /// # Errors
    /// [`AroundError`].
    pub(super) fn open(domain: Option<&str>, cell: &Cell, scanned: Option<&str>) -> Result<Option<Self>, AroundError> {
        const NAME: &str = "calibration capture scan objects";
        let scanned = scanned.map(|name| cell.place_of(name)).transpose().map_err(AroundError::Unknown)?;
        if cell.objects.len() < 2 {
            return Ok(None);
        }
        let mut bodies = Vec::new();
        // The shape of what is scanned need not be known yet.
        for number in (0..cell.objects.len()).filter(|number| scanned != Some(*number)) {
            bodies.extend(bodies_of(cell, number).map_err(AroundError::Shape)?);
        }
        let starts = body_starts(cell, &bodies, cell.table.as_ref().map_or(0.0, |table| table.height));
        let others = bodies.iter().zip(starts).map(|(body, pose)| Other {
            name: body.name,
            object: body.object,
            corners: corners(body),
            pose,
            is_seen: false,
        });
        let node = domain.map_or_else(|| Node::open(NAME), |domain| Node::open_in(domain, NAME))?;
        Ok(Some(Self { poses: node.subscriber(OBJECT_POSES)?, others: others.collect(), node }))
    }

    /// Waits for a pose of each, says of which none comes, and, where nobody named the object that is scanned, takes it to be
    /// the one that stands at `at`.
    ///
    /// # Errors
    /// [`AroundError::Transport`].
    pub(super) fn settle(&mut self, at: &Point3<f64>, is_named: bool) -> Result<(), AroundError> {
        let asked = Instant::now();
        while !self.others.iter().all(|other| other.is_seen) && asked.elapsed() < FIRST_POSES {
            self.look()?;
            std::thread::sleep(Duration::from_millis(10));
        }
        if !is_named {
            self.leave_out(at);
        }
        for Other { name, pose, .. } in self.others.iter().filter(|other| !other.is_seen) {
            let [x, y] = [pose.translation.x, pose.translation.y];
            console::line(format_args!(
                "no poses of `{}` arrive on /object/poses: it is kept clear of at x {x:.2} m, y {y:.2} m, where cell.toml has it start",
                name.text()
            ));
        }
        Ok(())
    }

    /// Leaves out the object that stands at a point.
    fn leave_out(&mut self, at: &Point3<f64>) {
        let gaps = self.others.iter().map(|other| (other.obstacle().gap(at, 0.0).0, other.object));
        let nearest = gaps.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(gap, _)| *gap < OBJECT_CLEARANCE);
        self.others.retain(|other| nearest.is_none_or(|(_, scanned)| other.object != scanned));
    }

    /// Takes in what has come.
    ///
    /// # Errors
    /// [`AroundError::Transport`].
    pub(super) fn look(&mut self) -> Result<(), AroundError> {
        while let Some(pose) = self.poses.receive()? {
            let other = self.others.iter_mut().find(|other| other.name == pose.name);
            if let (Some(other), Some(seen)) = (other, pose.unnamed().pose()) {
                (other.pose, other.is_seen) = (seen.isometry(), true);
            }
        }
        for ignored in self.node.newly_ignored() {
            console::line(ignored);
        }
        Ok(())
    }

    /// All of them.
    pub(super) fn obstacles(&self) -> Vec<Obstacle> {
        self.others.iter().map(Other::obstacle).collect()
    }
}

impl Other {
    fn obstacle(&self) -> Obstacle {
        Obstacle::at(self.name.text(), &self.corners, &self.pose)
    }
}
