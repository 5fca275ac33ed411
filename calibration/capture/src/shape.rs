//! The kinds of motion that a capture of the arm alone can play, each as excursions of the joints over time. Pure; rad, s.

use super::body::Body;
use super::chirp::Chirp;
use super::excess::Excess;
use super::hold::{self, Hold};
use super::jet::Jet;
use super::multisine::Multisine;
use super::ramp::Ramp;
use super::request::{Kind, Request};
use twin::arm::JointLimits;

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
