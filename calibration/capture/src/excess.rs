//! A value beyond its limit, in the words of an error message. Joints are counted from 1 in text, from 0 in code.

use std::fmt;

/// What is limited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Joint position [rad].
    Position,
    /// Position of a joint that slides [m].
    Travel,
    /// Joint speed, which falls towards the stops [rad/s].
    Speed,
    /// Joint acceleration [rad/s²].
    Acceleration,
    /// Joint jerk [rad/s³].
    Jerk,
    /// Joint torque, gravity included [N m].
    Torque,
    /// Height of flange and tool [m].
    Height,
}

impl Quantity {
    /// Whether the same way, taken more slowly, comes with less of it.
    pub fn eases(self) -> bool {
        !matches!(self, Self::Position | Self::Travel | Self::Height)
    }

    pub fn unit(self) -> &'static str {
        match self {
            Self::Position => "rad",
            Self::Speed => "rad/s",
            Self::Acceleration => "rad/s²",
            Self::Jerk => "rad/s³",
            Self::Torque => "N m",
            Self::Travel | Self::Height => "m",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Position | Self::Travel => "position",
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::Torque => "torque",
            Self::Height => "height",
        })
    }
}

/// A value beyond its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excess {
    /// Joint, from 0; `None` where flange or tool is meant.
    pub joint: Option<usize>,
    /// What is too large or too low.
    pub quantity: Quantity,
    pub value: f64,
    /// What it may be at most (position and height: or at least).
    pub limit: f64,
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { joint, quantity, value, limit } = self;
        match joint {
            Some(joint) => write!(f, "joint {}", joint + 1)?,
            None => write!(f, "the tool")?,
        }
        write!(f, ": {quantity} {value:.4} {unit}, limit {limit:.4} {unit}", unit = quantity.unit())
    }
}
