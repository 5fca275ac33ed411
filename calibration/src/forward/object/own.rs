//! Numbers that every clip with an object has of its own: how its friction, its start, its clock and its hit differ from
//! what all clips share. Read by [`super::ObjectClips`]; their scatter is estimated by [`crate::estimate::scatter`].

use crate::estimate::Random;
use shared_mem::cell::{Cell, ClipKind};

/// A number of a clip's own, zero where the clip is like all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Own {
    /// Logarithm of this clip's friction over the shared one.
    LnFriction,
    /// True start of the object less where the rest frames put it: x [m].
    StartX,
    /// The same along y [m].
    StartY,
    /// The same about the vertical [rad].
    StartYaw,
    /// How much later than the arm's clock says the poses were taken [s].
    Clock,
    /// Logarithm of the object's speed and spin when the tool lets go over what the simulated hit gives.
    ReleaseSpeed,
    /// Turn of its velocity there about the vertical [rad].
    ReleaseHeading,
    /// Spin about the vertical that the simulated hit lacks [rad/s].
    ReleaseSpin,
    /// Of an object that was let go: its first velocity less the one read off the first poses [m/s].
    Velocity(Axis),
    /// The same for its angular velocity [rad/s].
    Spin(Axis),
}

/// An axis of the base frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// To the front.
    X,
    /// To the left.
    Y,
    /// Up.
    Z,
}

/// All, in the order of [`Values`].
pub const ALL: [Own; 14] = [
    Own::LnFriction,
    Own::StartX,
    Own::StartY,
    Own::StartYaw,
    Own::Clock,
    Own::ReleaseSpeed,
    Own::ReleaseHeading,
    Own::ReleaseSpin,
    Own::Velocity(Axis::X),
    Own::Velocity(Axis::Y),
    Own::Velocity(Axis::Z),
    Own::Spin(Axis::X),
    Own::Spin(Axis::Y),
    Own::Spin(Axis::Z),
];

impl Own {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LnFriction => "ln friction",
            Self::StartX => "start x",
            Self::StartY => "start y",
            Self::StartYaw => "start yaw",
            Self::Clock => "clock",
            Self::ReleaseSpeed => "ln release speed",
            Self::ReleaseHeading => "release heading",
            Self::ReleaseSpin => "release spin",
            Self::Velocity(Axis::X) => "first velocity x",
            Self::Velocity(Axis::Y) => "first velocity y",
            Self::Velocity(Axis::Z) => "first velocity z",
            Self::Spin(Axis::X) => "first spin x",
            Self::Spin(Axis::Y) => "first spin y",
            Self::Spin(Axis::Z) => "first spin z",
        }
    }

    /// Whether it means anything in a clip of this kind.
    #[must_use]
    pub fn acts_in(self, kind: ClipKind) -> bool {
        match self {
            Self::LnFriction | Self::StartX | Self::StartY | Self::StartYaw | Self::Clock => true,
            Self::ReleaseSpeed | Self::ReleaseHeading | Self::ReleaseSpin => kind == ClipKind::ControlHitSlide,
            Self::Velocity(_) | Self::Spin(_) => kind == ClipKind::FreeMotion,
        }
    }

    /// One sigma of its scatter that is assumed until it is estimated.
    #[must_use]
    pub fn sigma(self, cell: &Cell) -> f64 {
        let noise = super::noise_of(cell);
        match self {
            Self::LnFriction => {
                cell.object.as_ref().and_then(|object| object.friction_scatter).unwrap_or(FRICTION_SCATTER)
            }
            // Wide: the rest frames are residuals too and say where the object stood.
            Self::StartX | Self::StartY => 3.0 * noise.position,
            Self::StartYaw => 3.0 * noise.rotation,
            Self::Clock => 1e-3,
            Self::ReleaseSpeed | Self::ReleaseHeading => 0.03,
            Self::ReleaseSpin => 0.3,
            Self::Velocity(_) => 0.05,
            Self::Spin(_) => 0.5,
        }
    }

    /// Name and difference step; held at zero.
    #[must_use]
    pub fn random(self) -> Random {
        let step = match self {
            Self::StartX | Self::StartY => 1e-4,
            Self::StartYaw | Self::Clock | Self::Velocity(_) => 1e-3,
            Self::LnFriction | Self::ReleaseSpeed | Self::ReleaseHeading => 2e-3,
            Self::Spin(_) | Self::ReleaseSpin => 2e-2,
        };
        Random { name: self.name().to_owned(), sigma: 0.0, step }
    }
}

/// Scatter of friction from clip to clip where cell.toml does not tell it, one sigma of ln(mu).
const FRICTION_SCATTER: f64 = 0.03;

/// The own numbers of one clip.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Values([f64; ALL.len()]);

impl Values {
    /// From the list that goes with [`ALL`]; what is missing is zero, and so is what means nothing in the clip.
    #[must_use]
    pub fn new(own: &[f64], kind: ClipKind) -> Self {
        let mut values = Self::default();
        for ((value, own), number) in values.0.iter_mut().zip(own).zip(ALL) {
            if number.acts_in(kind) {
                *value = *own;
            }
        }
        values
    }

    /// One of them.
    #[must_use]
    pub fn of(&self, own: Own) -> f64 {
        ALL.iter().position(|other| *other == own).map_or(0.0, |i| self.0[i])
    }
}
