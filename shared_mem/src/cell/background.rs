//! `[background]`: what stands around the robot, as pictures of the twin show it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What stands around the robot and never moves, for pictures alone; nothing collides with it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [background] block")]
pub struct Background {
    /// Gaussian splats in the base frame (3DGS PLY, or SuperSplat's compressed PLY), relative to cell.toml. They are drawn in place
    /// of the table top.
    pub splats: PathBuf,
}
