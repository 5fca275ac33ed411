//! How a motion is handed to the bridge: batches of set points, one per control cycle, queued ahead of time.
//!
//! The sender keeps a few hundred milliseconds queued and reads progress from [`super::arm::ArmState`]. Because the
//! control thread plays the queue by its own clock, a late sender cannot make the arm jerk, and a dead one lets the
//! queue run dry: then the arm is braked within its limits and held.

use super::check::{self, Wrong};
use super::wire::{codes, plain_fields, wire};
use super::{Joints, MAX_JOINTS};
use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// Set points in one [`MotionChunk`]: 50 ms at 1 kHz.
pub const CHUNK_LENGTH: usize = 50;

/// How long nobody may have sent a chunk or a target after a [`MotionKind::Stop`] before anything begins again [ns].
pub const STOP_SILENCE_NS: u64 = 500_000_000;

/// Desired state of one control cycle.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable)]
#[type_name("twinalign/SetPoint/1")]
#[repr(C)]
pub struct SetPoint {
    /// Desired joint positions [rad].
    pub q_d: Joints,
    /// Desired joint velocities [rad/s].
    pub dq_d: Joints,
}

impl Default for SetPoint {
    fn default() -> Self {
        Self { q_d: [0.0; MAX_JOINTS], dq_d: [0.0; MAX_JOINTS] }
    }
}

/// A batch of consecutive set points of one motion. Topic `/arm/motion`.
///
/// Chunks of a motion are numbered from 0 without gaps. The first set point must lie where the arm is commanded to be
/// already, at rest; the last one must be at rest too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionChunk {
    /// When the chunk was sent: monotonic clock [ns].
    pub stamp_ns: u64,
    /// Chosen by the sender, not 0, different from its earlier motions.
    pub motion_id: u64,
    /// What the chunk is for.
    pub kind: MotionKind,
    /// Number of this chunk within its motion, from 0.
    pub index: u32,
    /// Set points that count, at most [`CHUNK_LENGTH`].
    pub length: u32,
    /// Number of joints that count.
    pub dof: u32,
    /// The set points, one per control cycle.
    pub set_points: [SetPoint; CHUNK_LENGTH],
}

impl Default for MotionChunk {
    fn default() -> Self {
        Self {
            stamp_ns: 0,
            motion_id: 0,
            kind: MotionKind::Play,
            index: 0,
            length: 0,
            dof: 0,
            set_points: [SetPoint::default(); CHUNK_LENGTH],
        }
    }
}

impl MotionChunk {
    /// Set points of the joints that count are left to the bridge's limits, which refuse a motion by its number: its sender
    /// learns of it. Of the others nobody else would: what they hold ends in the bridge's own messages.
    fn check(&self) -> Result<(), Wrong> {
        check::running("stamp_ns", self.stamp_ns)?;
        check::count("length", self.length, 0, CHUNK_LENGTH as u64)?;
        check::dof(self.dof)?;
        self.set_points.iter().take(self.length as usize).try_for_each(|point| {
            check::unused("q_d", &point.q_d, self.dof)?;
            check::unused("dq_d", &point.dq_d, self.dof)
        })
    }
}

plain_fields!([] [SetPoint; CHUNK_LENGTH]);

wire!("twinalign/MotionChunk/3" MotionChunkWire: MotionChunk {
    stamp_ns: u64,
    motion_id: u64,
    kind: MotionKind,
    index: u32,
    length: u32,
    dof: u32,
    set_points: [SetPoint; CHUNK_LENGTH],
});

/// What a [`MotionChunk`] is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MotionKind {
    /// More follows.
    #[default]
    Play = 0,
    /// The last chunk of its motion.
    Last = 1,
    /// Brake now, whatever is queued and whoever sent it: chunks that the bridge received before are dropped, and so is what
    /// still comes of the motion that was braked. Nothing begins before nobody has sent chunks or targets for
    /// [`STOP_SILENCE_NS`], also where nothing moved: who was sending at the stop has not asked since. The set points do
    /// not count.
    Stop = 2,
    /// Clear the reflex that ended commanding and hold the arm where it stands; the set points do not count. Nothing
    /// happens unless the arm is in a reflex: a stop that a person pressed is a person's to release.
    Recover = 3,
}

codes!(MotionKind: Play, Last, Stop, Recover);
