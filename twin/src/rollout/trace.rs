//! What a rollout is asked for and what it answers. Stamps integer nanoseconds, base frame, SI.

use crate::control::{CommandTrack, Reading};
use nalgebra::Vector3;
use shared_mem::frames::{Base, Object, Pose};

/// The commands of a clip, and when the answers to them are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a> {
    /// Commands to the arm; `None` where there is no arm, or where it shall stay as it is.
    pub commands: Option<&'a CommandTrack>,
    /// Stamps at which the arm's sensors are read, ascending.
    pub joints_ns: &'a [u64],
    /// Stamps of the object poses that the camera reports, ascending.
    pub poses_ns: &'a [u64],
}

/// The object at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectState {
    /// Its geometric centre.
    pub pose: Pose<Base, Object>,
    /// Velocity of that point [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector3<f64>,
}

impl ObjectState {
    pub fn at_rest(pose: Pose<Base, Object>) -> Self {
        Self { pose, velocity: Vector3::zeros(), angular_velocity: Vector3::zeros() }
    }
}

/// What a cell did. Made empty, filled by [`super::CellRollout::run`], and kept for the next run: its vectors grow once.
#[derive(Debug, Default, PartialEq)]
pub struct CellTrace {
    /// What the arm's sensors read, one for each stamp of [`Course::joints_ns`].
    pub joints: Vec<Reading>,
    /// What the camera reports, one for each stamp of [`Course::poses_ns`]. Empty without an object.
    pub poses: Vec<Pose<Base, Object>>,
    /// When tool and object touched; `None` when they have not yet.
    pub contact: Option<ContactSpan>,
}

/// From the first touch of tool and object to the last release so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactSpan {
    /// First touch [ns].
    pub start_ns: u64,
    /// Last moment of touch [ns].
    pub end_ns: u64,
}

impl Clone for CellTrace {
    fn clone(&self) -> Self {
        Self { joints: self.joints.clone(), poses: self.poses.clone(), contact: self.contact }
    }

    /// Reuses the vectors: a run may go on from the trace of a checkpoint without allocating.
    fn clone_from(&mut self, source: &Self) {
        self.joints.clone_from(&source.joints);
        self.poses.clone_from(&source.poses);
        self.contact = source.contact;
    }
}

impl CellTrace {
    /// Forgets everything but the memory it holds.
    pub fn clear(&mut self) {
        self.joints.clear();
        self.poses.clear();
        self.contact = None;
    }
}
