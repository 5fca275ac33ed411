//! What a signal is multiplied with: one number for all joints, or one a joint.

use serde::{Deserialize, Serialize};

/// A factor of a signal; negative: it counts the other way round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, or a list with one number a joint")]
pub enum Factor {
    /// The same for all joints.
    All(f64),
    /// One a joint.
    Each(Vec<f64>),
}

impl Default for Factor {
    fn default() -> Self {
        Self::All(1.0)
    }
}

impl Factor {
    /// That of a joint; 1 beyond a list's end.
    pub fn of(&self, joint: usize) -> f64 {
        match self {
            Self::All(factor) => *factor,
            Self::Each(factors) => factors.get(joint).copied().unwrap_or(1.0),
        }
    }

    pub(crate) fn is_one(&self) -> bool {
        *self == Self::default()
    }

    /// Why it is no factor of so many joints.
    pub(crate) fn refused(&self, dof: usize) -> Option<String> {
        let numbers = match self {
            Self::All(factor) => std::slice::from_ref(factor),
            Self::Each(factors) => factors,
        };
        if matches!(self, Self::Each(_)) && numbers.len() != dof {
            return Some(format!("has {} numbers for {dof} joints: give one a joint, or one for all", numbers.len()));
        }
        let bad = numbers.iter().find(|factor| !factor.is_finite() || **factor == 0.0)?;
        Some(format!("holds {bad}: nothing is left of a signal times that"))
    }
}
