//! What is asked of an excitation clip: which kind of motion, around which pose, how large and how long. Units: rad, s, m.

use shared_mem::msg::{Joints, MAX_JOINTS};
use std::fmt;

/// A kind of motion with what is its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Sums of sines, 0.2 to 1.6 Hz.
    Multisine,
    /// Swings of growing frequency.
    Chirp {
        /// First and last frequency [Hz].
        frequency: [f64; 2],
    },
    /// Triangles of growing speed.
    Ramp {
        /// First and last speed [rad/s].
        speeds: [f64; 2],
    },
    /// Rests in several poses.
    Hold { poses: usize },
}

impl Kind {
    /// Length [s] and amplitude [rad] where nothing else is asked for.
    pub fn usual(self) -> (f64, f64) {
        match self {
            Self::Multisine => (8.0, 0.25),
            Self::Chirp { .. } => (20.0, 0.25),
            Self::Ramp { .. } => (40.0, 0.25),
            Self::Hold { .. } => (40.0, 0.4),
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Multisine => f.write_str("multisine"),
            Self::Chirp { frequency: [lo, hi] } => write!(f, "chirp from {lo} to {hi} Hz"),
            Self::Ramp { speeds: [lo, hi] } => write!(f, "ramps from {lo} to {hi} rad/s"),
            Self::Hold { poses } => write!(f, "holds in {poses} poses"),
        }
    }
}

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Request {
    /// Pose to start, move around and end in [rad].
    pub start: Joints,
    /// What kind of motion.
    pub kind: Kind,
    /// Joints that move; the others hold.
    pub moving: [bool; MAX_JOINTS],
    /// Largest excursion of each joint [rad].
    pub amplitude: f64,
    /// Length [s].
    pub duration: f64,
    /// Draws what the kind leaves open: amplitudes, phases, directions, poses.
    pub seed: u64,
    /// Height in the base frame that flange and tool stay above [m].
    pub floor: f64,
}
