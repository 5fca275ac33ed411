//! Where gains may lie: one range for all joints, or one a joint.

use crate::msg::MAX_JOINTS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Lower and upper bound.
pub type Range = [f64; 2];

/// Lower and upper bounds of a quantity of every joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "[low, high], or one such pair for each joint")]
pub enum Ranges {
    /// The same for all joints.
    All(Range),
    /// One a joint, from the base on.
    Each(Vec<Range>),
}

impl Ranges {
    /// That of a joint, from 0; `None` beyond the last one.
    pub fn of(&self, joint: usize) -> Option<Range> {
        match self {
            Self::All(range) => Some(*range),
            Self::Each(ranges) => ranges.get(joint).copied(),
        }
    }

    pub(super) fn check(&self, key: &str, dof: Option<usize>) -> Result<(), String> {
        let (ranges, wanted) = match self {
            Self::All(range) => (std::slice::from_ref(range), None),
            Self::Each(ranges) => (&ranges[..], dof.or(Some(ranges.len().clamp(1, MAX_JOINTS)))),
        };
        if wanted.is_some_and(|wanted| wanted != ranges.len()) {
            return Err(format!(
                "`{key}` holds {} ranges; give one for each joint, or a single [low, high]",
                ranges.len()
            ));
        }
        match ranges.iter().all(|[lo, hi]| *lo >= 0.0 && hi > lo && hi.is_finite()) {
            true => Ok(()),
            false => Err(format!("`{key}` must be [low, high] with 0 <= low < high, or one such pair for each joint")),
        }
    }
}

impl From<Range> for Ranges {
    fn from(range: Range) -> Self {
        Self::All(range)
    }
}
