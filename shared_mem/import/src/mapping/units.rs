//! Units by their names in import.toml, and what one of them is in SI.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Unit of stamps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "their names are all there is to say")]
pub enum TimeUnit {
    #[default]
    #[serde(rename = "s")]
    Second,
    #[serde(rename = "ms")]
    Millisecond,
    #[serde(rename = "us")]
    Microsecond,
    #[serde(rename = "ns")]
    Nanosecond,
}

/// Unit of positions of a joint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "their names are all there is to say")]
pub enum AngleUnit {
    #[default]
    #[serde(rename = "rad")]
    Radian,
    #[serde(rename = "deg")]
    Degree,
    #[serde(rename = "turn")]
    Turn,
    /// A joint that slides.
    #[serde(rename = "m")]
    Metre,
    /// A joint that slides.
    #[serde(rename = "mm")]
    Millimetre,
    /// To be proposed from the numbers, or to be asked for.
    #[serde(rename = "not_known")]
    NotKnown,
}

/// Unit of velocities of a joint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "their names are all there is to say")]
pub enum RateUnit {
    #[default]
    #[serde(rename = "rad/s")]
    RadianPerSecond,
    #[serde(rename = "deg/s")]
    DegreePerSecond,
    #[serde(rename = "rpm")]
    TurnPerMinute,
    /// A joint that slides.
    #[serde(rename = "m/s")]
    MetrePerSecond,
    /// A joint that slides.
    #[serde(rename = "mm/s")]
    MillimetrePerSecond,
}

/// Unit of positions of an object.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "their names are all there is to say")]
pub enum LengthUnit {
    #[default]
    #[serde(rename = "m")]
    Metre,
    #[serde(rename = "cm")]
    Centimetre,
    #[serde(rename = "mm")]
    Millimetre,
}

/// Which torque a column holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Torque {
    /// What the joint's motor gives behind the gear, gravity among it: `tau_J`.
    WithGravity,
    /// Gravity was taken off.
    WithoutGravity,
    /// Nobody knows: the column is not imported.
    #[default]
    NotKnown,
}

/// In which control period the torques of a row acted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TorquesAct {
    /// In the one that ends at its stamp, as in the states of an arm.
    UntilStamp,
    /// In the one that begins there, as where a controller logs what it calculated.
    #[default]
    FromStamp,
}

impl TimeUnit {
    /// One of it [s].
    pub const fn seconds(self) -> f64 {
        match self {
            Self::Second => 1.0,
            Self::Millisecond => 1e-3,
            Self::Microsecond => 1e-6,
            Self::Nanosecond => 1e-9,
        }
    }

    /// One of it [ns].
    pub const fn nanoseconds(self) -> f64 {
        match self {
            Self::Second => 1e9,
            Self::Millisecond => 1e6,
            Self::Microsecond => 1e3,
            Self::Nanosecond => 1.0,
        }
    }
}

impl AngleUnit {
    /// That of a block that does not say it.
    pub(crate) const fn not_known() -> Self {
        Self::NotKnown
    }

    /// One of it [rad], or [m].
    pub const fn si(self) -> f64 {
        match self {
            Self::Radian | Self::Metre | Self::NotKnown => 1.0,
            Self::Degree => TAU / 360.0,
            Self::Turn => TAU,
            Self::Millimetre => 1e-3,
        }
    }

    /// The unit of velocities that goes with it.
    pub const fn per_second(self) -> RateUnit {
        match self {
            Self::Radian | Self::Turn | Self::NotKnown => RateUnit::RadianPerSecond,
            Self::Degree => RateUnit::DegreePerSecond,
            Self::Metre => RateUnit::MetrePerSecond,
            Self::Millimetre => RateUnit::MillimetrePerSecond,
        }
    }
}

impl RateUnit {
    /// One of it [rad/s], or [m/s].
    pub const fn si(self) -> f64 {
        match self {
            Self::RadianPerSecond | Self::MetrePerSecond => 1.0,
            Self::DegreePerSecond => TAU / 360.0,
            Self::TurnPerMinute => TAU / 60.0,
            Self::MillimetrePerSecond => 1e-3,
        }
    }
}

impl LengthUnit {
    /// One of it [m].
    pub const fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 1e-2,
            Self::Millimetre => 1e-3,
        }
    }
}
