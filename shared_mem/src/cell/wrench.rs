//! `[wrench]`: the force/torque sensor between flange and tool, its axes along the flange's.

use super::within;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a [wrench] block")]
pub struct WrenchSensor {
    /// Base identifier on the CAN bus: the upper seven bits of the eleven.
    pub can_id: u8,
    /// Samples a second.
    pub rate: f64,
    /// Forces beyond this are not measured [N].
    pub force_range: f64,
    /// Torques beyond this are not measured [N m].
    pub torque_range: f64,
    /// Noise of the simulated sensor.
    pub noise: WrenchNoise,
}

/// Noise of one sample, one sigma.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table of force [N] and torque [N m]")]
pub struct WrenchNoise {
    /// Of each force [N].
    pub force: f64,
    /// Of each torque [N m].
    pub torque: f64,
}

impl Default for WrenchSensor {
    /// A sensor for an arm of this size, at its maker's identifier.
    fn default() -> Self {
        Self { can_id: 0x20, rate: 500.0, force_range: 580.0, torque_range: 20.0, noise: WrenchNoise::default() }
    }
}

impl WrenchSensor {
    pub(super) fn check(&self) -> Result<(), String> {
        within("wrench.can_id", &[f64::from(self.can_id)], 0.0, 127.0)?;
        within("wrench.rate", &[self.rate], 1.0, 1000.0)?;
        within("wrench.force_range", &[self.force_range], 0.1, 1e5)?;
        within("wrench.torque_range", &[self.torque_range], 1e-3, 1e4)?;
        within("wrench.noise.force", &[self.noise.force], 0.0, self.force_range)?;
        within("wrench.noise.torque", &[self.noise.torque], 0.0, self.torque_range)
    }
}
