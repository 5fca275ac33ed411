//! The kinds of motion that a capture of the arm alone can play, each as excursions of the joints over time. Pure; rad, s.

use super::body::Body;
use super::chirp::Chirp;
use super::excess::Excess;
use super::hold::{self, Hold};
use super::jet::Jet;
use super::multisine::Multisine;
use super::plan::Request;
use super::ramp::Ramp;
use std::fmt;
use twin::arm::JointLimits;

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
    Hold {
        /// How many.
        poses: usize,
    },
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

/// Excursions of the joints as asked for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// With its amplitude [rad].
    Multisine(Multisine, f64, f64),
    Chirp(Chirp, f64),
    Ramp(Ramp),
    Hold(Hold),
}

impl Shape {
    /// Draws it. `refuse` says which limit a pose at rest breaks.
    pub(super) fn draw(
        request: &Request,
        limits: &[JointLimits],
        body: &Body,
        refuse: impl Fn(&shared_mem::msg::Joints) -> Option<Excess>,
    ) -> Result<Self, Excess> {
        let Request { start, kind, moving, amplitude, duration, seed, .. } = *request;
        let dof = limits.len();
        Ok(match kind {
            Kind::Multisine => Self::Multisine(Multisine::draw(dof, duration, seed), amplitude, duration),
            Kind::Chirp { frequency } => {
                Self::Chirp(Chirp::draw(frequency, amplitude, duration, seed, limits), duration)
            }
            Kind::Ramp { speeds } => Self::Ramp(Ramp::draw(speeds, amplitude, duration, dof, seed)),
            Kind::Hold { poses } => {
                let wanted = hold::Wanted { start, amplitude, moving, poses, duration, seed };
                Self::Hold(Hold::draw(&wanted, limits, body, refuse)?)
            }
        })
    }

    /// Length [s].
    pub(super) fn duration(&self) -> f64 {
        match self {
            Self::Multisine(_, _, duration) | Self::Chirp(_, duration) => *duration,
            Self::Ramp(ramp) => ramp.duration(),
            Self::Hold(hold) => hold.duration(),
        }
    }

    /// Excursion of `joint` at `t` [s] and its derivatives [rad].
    pub(super) fn at(&self, joint: usize, t: f64) -> Jet {
        match self {
            Self::Multisine(sines, amplitude, _) => sines.at(joint, t).map(|x| amplitude * x),
            Self::Chirp(chirp, _) => chirp.at(joint, t),
            Self::Ramp(ramp) => ramp.at(joint, t),
            Self::Hold(hold) => hold.at(joint, t),
        }
    }
}
