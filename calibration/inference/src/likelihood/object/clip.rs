//! One recorded clip with an object, prepared for being held against the twin: when its object was hit, let go and came
//! to rest, and where the arm is looked at. Base frame, SI, stamps of the recording.

use super::super::vertical;
use super::clearance::Clearance;
use nalgebra::Vector3;
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::{Clip, ObjectSeries};
use twin::arm::{ArmModel, Joints};
use twin::control::CommandTrack;
use twin::effects::CameraEffects;

/// Poses this far from the last (or first) ones move, in sigmas of the noise: 1 of 100 000 resting poses is.
const MOVING_SIGMAS: f64 = 8.0;
/// The arm is looked at so often from a moment before the hit until one after the tool has let go [ns]: from then on it
/// says nothing about the blow.
const ARM_EVERY_NS: u64 = 10_000_000;
/// The one moment: two poses of a 60 Hz tracker [ns].
const BEFORE_HIT_NS: u64 = 40_000_000;
/// The other moment: the arm swings out meanwhile [ns].
const AFTER_RELEASE_NS: u64 = 50_000_000;

/// A clip with an object.
#[derive(Debug, Clone)]
pub(super) struct ObjectClip {
    pub(super) recorded: Clip,
    pub(super) commands: Option<CommandTrack>,
    /// When the last pose was taken that is still where the object stood at first.
    pub(super) onset_ns: u64,
    /// When the tool has let go for good.
    pub(super) free_ns: u64,
    /// When the last pose was taken that is not yet where the object came to rest.
    pub(super) rest_ns: u64,
    /// Stamp of the last pose.
    pub(super) end_ns: u64,
    /// Measured rows of the arm that count.
    pub(super) arm_rows: Vec<usize>,
    pub(super) arm_ns: Vec<u64>,
    /// Of each of these by how much a vertical force of 1 N at the tip turns each joint [N m]; empty without an arm.
    pub(super) levers: Vec<Joints>,
}

impl ObjectClip {
    /// `None` when no pose was recorded. `noise`: one sigma of a coordinate [m].
    pub(super) fn new(recorded: Clip, (cell, arm): (&Cell, Option<&ArmModel>), noise: f64) -> Option<Self> {
        let ObjectSeries { stamps_ns, poses } = &recorded.object;
        let (end_ns, first, last) = (*stamps_ns.last()?, place(poses.first()?), place(poses.last()?));
        let away =
            |from: Vector3<f64>| move |pose: &Pose<Base, Object>| (place(pose) - from).norm() > MOVING_SIGMAS * noise;
        let onset = poses.iter().position(away(first)).map_or(0, |row| row.saturating_sub(1));
        let rest = poses.iter().rposition(away(last)).unwrap_or(0);
        let (onset_ns, rest_ns) = (stamps_ns[onset], stamps_ns[rest]);
        let free_ns = let_go(&recorded, cell, onset, rest).map_or(rest_ns, |row| stamps_ns[row]);
        let felt_ns = rest_ns.min(free_ns + AFTER_RELEASE_NS);
        let (mut arm_rows, mut arm_ns) = (Vec::new(), Vec::new());
        let mut next_ns = onset_ns.saturating_sub(BEFORE_HIT_NS);
        for (row, &stamp) in recorded.measured.stamps_ns.iter().enumerate() {
            if stamp >= next_ns && stamp <= felt_ns {
                arm_rows.push(row);
                arm_ns.push(stamp);
                next_ns = stamp + ARM_EVERY_NS;
            }
        }
        let commands = CommandTrack::of_cell(&recorded.desired, cell);
        let lever = |row: &usize| Some(vertical::lever(arm?, recorded.measured.q_row(*row)));
        let levers = arm_rows.iter().filter_map(lever).collect();
        Some(Self { recorded, commands, onset_ns, free_ns, rest_ns, end_ns, arm_rows, arm_ns, levers })
    }

    /// The poses as they were, under effects that report them elsewhere.
    pub(super) fn undistorted(&self, camera: &CameraEffects) -> ObjectSeries {
        let mut series = self.recorded.object.clone();
        if !camera.is_none() {
            for pose in &mut series.poses {
                *pose = Pose::from_isometry(camera.undistorted(&pose.isometry()));
            }
        }
        series
    }
}

/// First pose between `onset` and `rest` from which on the tool stays away from the object.
fn let_go(clip: &Clip, cell: &Cell, onset: usize, rest: usize) -> Option<usize> {
    let mut clearance = Clearance::new(cell, clip)?;
    let touching = (onset..=rest).rev().find(|row| !clearance.apart(*row))?;
    Some((touching + 1).min(rest))
}

pub(super) fn place(pose: &Pose<Base, Object>) -> Vector3<f64> {
    Vector3::from(pose.position())
}
