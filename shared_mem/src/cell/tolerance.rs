//! `[tolerance]`: gaps that matter to nobody.

use super::within;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Root mean squares below which a gap is of no interest to the laboratory; absent ones are 0, and every gap beyond the noise
/// counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [tolerance] block")]
pub struct Tolerance {
    /// Of joint positions [rad].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<f64>,
    /// Of torques along a measured motion [N m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
    /// Of an object's points, as mean ADD [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<f64>,
}

impl Tolerance {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    pub(super) fn check(&self) -> Result<(), String> {
        within("tolerance.joint", self.joint.as_slice(), 0.0, 1.0)?;
        within("tolerance.torque", self.torque.as_slice(), 0.0, 1e3)?;
        within("tolerance.position", self.position.as_slice(), 0.0, 1.0)
    }
}
