//! Numbers that every clip with an object has of its own: how its friction, its start, its clock and what its hit left
//! behind differ from what all clips share. Read by [`super::ObjectClips`].

use crate::estimate::Random;
use shared_mem::cell::{Cell, ClipKind};

/// A number of a clip's own, zero where the clip is like all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Own {
    /// Logarithm of this clip's friction over the shared one, once the tool has let go.
    LnFriction,
    /// How much later than the arm's clock says the poses were taken [s].
    Clock,
    /// True place of the object before the hit less where the rest frames put it [m]; x or y.
    Start(Axis),
    /// The same about the vertical [rad].
    StartYaw,
    /// Place of the object when the tool lets go less the simulated one [m]; x or y.
    Release(Axis),
    /// The same about the vertical [rad].
    ReleaseYaw,
    /// Velocity of the object there less the simulated one [m/s]; x or y.
    ReleaseVelocity(Axis),
    /// The same about the vertical [rad/s].
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
    Z,
}

/// All, in the order of [`Values`].
pub const ALL: [Own; 17] = [
    Own::LnFriction,
    Own::Clock,
    Own::Start(Axis::X),
    Own::Start(Axis::Y),
    Own::StartYaw,
    Own::Release(Axis::X),
    Own::Release(Axis::Y),
    Own::ReleaseYaw,
    Own::ReleaseVelocity(Axis::X),
    Own::ReleaseVelocity(Axis::Y),
    Own::ReleaseSpin,
    Own::Velocity(Axis::X),
    Own::Velocity(Axis::Y),
    Own::Velocity(Axis::Z),
    Own::Spin(Axis::X),
    Own::Spin(Axis::Y),
    Own::Spin(Axis::Z),
];

/// Scatter of friction from clip to clip where cell.toml does not tell it, one sigma of ln(mu).
const FRICTION_SCATTER: f64 = 0.03;

impl Own {
    /// Name in reports.
    pub fn name(self) -> String {
        let axis = |axis| match axis {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
        };
        match self {
            Self::LnFriction => "ln friction".into(),
            Self::Clock => "clock".into(),
            Self::Start(a) => format!("start {}", axis(a)),
            Self::StartYaw => "start yaw".into(),
            Self::Release(a) => format!("release {}", axis(a)),
            Self::ReleaseYaw => "release yaw".into(),
            Self::ReleaseVelocity(a) => format!("release velocity {}", axis(a)),
            Self::ReleaseSpin => "release spin".into(),
            Self::Velocity(a) => format!("first velocity {}", axis(a)),
            Self::Spin(a) => format!("first spin {}", axis(a)),
        }
    }

    /// Whether it means anything in a clip of this kind.
    pub fn acts_in(self, kind: ClipKind) -> bool {
        match self {
            Self::LnFriction | Self::Start(_) | Self::StartYaw => true,
            Self::Clock | Self::Release(_) | Self::ReleaseYaw | Self::ReleaseVelocity(_) | Self::ReleaseSpin => {
                kind == ClipKind::ControlHitSlide
            }
            Self::Velocity(_) | Self::Spin(_) => kind == ClipKind::FreeMotion,
        }
    }

    /// One sigma of its scatter that is assumed until it is estimated.
    ///
    /// The start is held where many rest frames put it: what is left of its error shows at the release, and there it has
    /// its place.
    pub fn sigma(self, cell: &Cell, kind: ClipKind) -> f64 {
        let noise = super::noise_of(cell);
        let alone = kind == ClipKind::FreeMotion;
        match self {
            Self::LnFriction => cell.object().and_then(|object| object.friction_scatter).unwrap_or(FRICTION_SCATTER),
            Self::Clock => 1e-3,
            Self::Start(_) => {
                if alone {
                    3.0 * noise.position
                } else {
                    0.0
                }
            }
            Self::StartYaw => {
                if alone {
                    3.0 * noise.rotation
                } else {
                    0.0
                }
            }
            Self::Release(_) => 3e-3,
            Self::ReleaseYaw => 0.03,
            Self::ReleaseVelocity(_) => 0.03,
            Self::ReleaseSpin => 0.3,
            Self::Velocity(_) => 0.05,
            Self::Spin(_) => 0.5,
        }
    }

    /// Name and difference step; held at zero.
    pub fn random(self) -> Random {
        let step = match self {
            Self::Start(_) | Self::Release(_) => 1e-4,
            Self::StartYaw | Self::ReleaseYaw | Self::Clock | Self::ReleaseVelocity(_) | Self::Velocity(_) => 1e-3,
            Self::LnFriction => 2e-3,
            Self::Spin(_) | Self::ReleaseSpin => 2e-2,
        };
        Random { name: self.name(), sigma: 0.0, step }
    }
}

/// The own numbers of one clip.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Values([f64; ALL.len()]);

impl Values {
    /// From the list that goes with [`ALL`]; what is missing is zero, and so is what means nothing in the clip.
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
    pub fn of(&self, own: Own) -> f64 {
        ALL.iter().position(|other| *other == own).map_or(0.0, |i| self.0[i])
    }

    /// Those that a simulation feels: all but the clock, which only says when it is looked at.
    pub(super) fn felt(&self) -> Self {
        let mut felt = *self;
        ALL.iter().zip(&mut felt.0).filter(|(own, _)| **own == Own::Clock).for_each(|(_, value)| *value = 0.0);
        felt
    }

    /// Those that say where the object stands before anything moves it.
    pub(super) fn standing(&self) -> Self {
        let mut standing = *self;
        let stands = |own: &Own| matches!(own, Own::Start(_) | Own::StartYaw);
        ALL.iter().zip(&mut standing.0).filter(|(own, _)| !stands(own)).for_each(|(_, value)| *value = 0.0);
        standing
    }

    /// Those along an axis, as a vector.
    pub(super) fn vector(&self, own: impl Fn(Axis) -> Own) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::from([Axis::X, Axis::Y, Axis::Z].map(|axis| self.of(own(axis))))
    }
}
