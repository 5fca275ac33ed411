//! `[simulation]`: where the simulated cell starts. A real cell ignores it.

use super::within;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Start of the simulated cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a [simulation] block")]
pub struct Simulation {
    /// Joint positions at the start [rad]; empty: the model's ready pose.
    pub q: Vec<f64>,
    /// The object's geometric centre at the start, on the table: x, y in the base frame [m].
    pub object_position: [f64; 2],
    /// Its rotation about z [rad].
    pub object_yaw: f64,
    /// Noise of a measured joint position, one sigma [rad].
    pub q_noise: f64,
    /// Noise of a measured joint velocity, one sigma [rad/s].
    pub dq_noise: f64,
    /// Step of a measured joint position [rad]: what one count of the encoder amounts to; 0: none.
    pub q_step: f64,
    /// Step of a measured joint velocity [rad/s]; 0: none.
    pub dq_step: f64,
    /// Seed of all noise.
    pub seed: u64,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            q: Vec::new(),
            object_position: [0.5, 0.0],
            object_yaw: 0.0,
            q_noise: 0.0,
            dq_noise: 0.0,
            q_step: 0.0,
            dq_step: 0.0,
            seed: 0,
        }
    }
}

impl Simulation {
    pub(super) fn check(&self) -> Result<(), String> {
        within("simulation.q", &self.q, -10.0, 10.0)?;
        within("simulation.object_position", &self.object_position, -10.0, 10.0)?;
        within("simulation.object_yaw", &[self.object_yaw], -10.0, 10.0)?;
        let noises = [
            ("q_noise", self.q_noise),
            ("dq_noise", self.dq_noise),
            ("q_step", self.q_step),
            ("dq_step", self.dq_step),
        ];
        noises.into_iter().try_for_each(|(key, size)| within(&format!("simulation.{key}"), &[size], 0.0, 1.0))
    }

    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
