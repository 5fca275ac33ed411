//! `[simulation]`: where the simulated cell starts. A real cell ignores it.

use serde::{Deserialize, Serialize};

/// Start of the simulated cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
