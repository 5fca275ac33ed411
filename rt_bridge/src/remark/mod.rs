//! What the control thread has to tell people: `Copy` values that go through a ring to the pump, which words them.

mod claim;
mod newest;

use crate::arm::ArmFault;
use crate::safety::Violation;
pub use claim::Claim;
pub use newest::Newest;
use shared_mem::msg::event::EventLevel;
use std::fmt;

/// Something worth an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remark {
    /// The loop runs without some real-time guarantee.
    LesserClock(Claim),
    Fault(ArmFault),
    /// A reflex was cleared: commanding goes on.
    Recovered,
    /// A motion was refused before it began, or its sender's chunks do not count.
    Refused {
        motion: u64,
        why: Refusal,
    },
    /// A motion began to play.
    Began {
        motion: u64,
    },
    /// A motion was played to its end.
    Done {
        motion: u64,
    },
    /// A target of a stream was passed over; the arm goes on to the one before it.
    PassedOver {
        motion: u64,
        /// What resting there would break.
        why: Violation,
    },
    /// A motion is being braked; the arm will hold where it comes to rest.
    Braked {
        motion: u64,
        why: BrakeReason,
    },
}

/// Why chunks of a motion are not played. Joints are counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Another motion is being played or braked.
    Busy { playing: u64 },
    /// The first set point is not where the arm is commanded to be.
    StartsElsewhere {
        /// First joint that differs.
        joint: u8,
    },
    /// A chunk is missing before this one.
    Gap {
        /// Index that was due.
        due: u32,
        /// Index that came.
        came: u32,
    },
    /// The chunk speaks of another number of joints.
    Dof {
        /// Joints of the chunk.
        came: u32,
        /// Joints of the arm.
        has: u32,
    },
    /// The chunk says that it holds more set points than fit.
    Length,
    /// A set point holds a number that is not finite.
    NotFinite,
    /// The motion has the id 0, which stands for "none".
    NoId,
    /// The arm is not commanded: it stopped itself or is being let go.
    NotCommanded,
    /// A stop was asked for, or the arm stopped itself, and since then senders have not been silent for long enough.
    Stopped,
}

/// Why a motion is braked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BrakeReason {
    /// Set points ran out.
    Underrun,
    /// No target came for as long as a stream may be silent.
    Silent,
    /// No way to the target was found.
    NoWay,
    /// A `Stop` was received.
    Asked,
    /// The run ends.
    RunEnds,
    /// The next set point, or holding after the last one, breaks a limit.
    Limit(Violation),
    /// The last set point is not at rest.
    EndsMoving,
    /// A later chunk of the motion cannot be played.
    Chunk(Refusal),
    /// The arm stopped itself, or was lost.
    ArmStopped,
}

impl Remark {
    /// How serious it is.
    pub fn level(&self) -> EventLevel {
        match self {
            Self::Fault(_) => EventLevel::Error,
            Self::Refused { .. } | Self::PassedOver { .. } | Self::LesserClock(_) => EventLevel::Warning,
            Self::Braked { why: BrakeReason::Asked | BrakeReason::RunEnds, .. } => EventLevel::Info,
            Self::Braked { .. } => EventLevel::Warning,
            Self::Recovered | Self::Began { .. } | Self::Done { .. } => EventLevel::Info,
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LesserClock(claim) => write!(f, "running without real-time guarantees: {claim}"),
            Self::Fault(fault) => fault.fmt(f),
            Self::Recovered => f.write_str("recovered from the reflex; the arm holds where it stands"),
            Self::Refused { motion, why } => write!(f, "motion {motion} refused: {why}"),
            Self::Began { motion } => write!(f, "motion {motion} began"),
            Self::Done { motion } => write!(f, "motion {motion} done"),
            Self::PassedOver { motion, why } => {
                write!(f, "a target of motion {motion} is passed over: {why}; the arm stays with the one before")
            }
            Self::Braked { motion, why } => write!(f, "motion {motion} braked: {why}"),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Busy { playing } => {
                write!(f, "motion {playing} is under way; wait for it, or send Stop")
            }
            Self::StartsElsewhere { joint } => write!(
                f,
                "joint {joint} of its first set point is not where the arm is commanded to be; plan from q_d of /arm/state"
            ),
            Self::Gap { due, came } => write!(f, "chunk {came} came where {due} was due; send all chunks, in order"),
            Self::Dof { came, has } => write!(f, "it speaks of {came} joints, the arm has {has}"),
            Self::Length => f.write_str("a chunk says that it holds more set points than fit"),
            Self::NotFinite => f.write_str("a set point holds a number that is not finite"),
            Self::NoId => f.write_str("its id is 0; choose another"),
            Self::NotCommanded => f.write_str("the arm is not under command; see the fault before this"),
            Self::Stopped => f.write_str(
                "the arm was stopped, and nothing begins before nobody has sent targets or motions for 0.5 s; end what \
                 sends, then ask again under a new id",
            ),
        }
    }
}

impl fmt::Display for BrakeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Underrun => {
                f.write_str("its set points ran out before the chunk marked Last; keep a few hundred ms queued")
            }
            Self::Silent => f.write_str(
                "no target came for 0.2 s; send one at least twenty times a second, under a new id to go on",
            ),
            Self::NoWay => f.write_str("no way to its target was found; send another, under a new id"),
            Self::Asked => f.write_str("a stop was asked for"),
            Self::RunEnds => f.write_str("the run ends"),
            Self::Limit(violation) => write!(f, "{violation}"),
            Self::EndsMoving => f.write_str("its last set point is not at rest"),
            Self::Chunk(refusal) => refusal.fmt(f),
            Self::ArmStopped => f.write_str("the arm is no longer under command"),
        }
    }
}
