//! `[gripper]`: which gripper the arm carries. Its mass belongs to `[tool]`.

use super::within;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The gripper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [gripper] block")]
pub struct Gripper {
    /// Which one.
    pub model: GripperModel,
    /// Widest opening between the fingers [m]; absent: the model's. Longer fingertips leave it, pads make it less.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stroke: Option<f64>,
    /// Position counts of a Robotiq at its widest and closed; absent: 3 and 230, which is where most of them stop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts: Option<[u8; 2]>,
}

/// Grippers that are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum GripperModel {
    /// Robotiq 2F-85.
    #[serde(rename = "robotiq_2f_85")]
    Robotiq2F85,
    /// Robotiq 2F-140.
    #[serde(rename = "robotiq_2f_140")]
    Robotiq2F140,
    /// Franka Hand.
    #[serde(rename = "franka_hand")]
    FrankaHand,
}

impl Gripper {
    /// A gripper as its maker ships it.
    pub fn new(model: GripperModel) -> Self {
        Self { model, stroke: None, counts: None }
    }

    /// Widest opening in force [m].
    pub fn widest(&self) -> f64 {
        self.stroke.unwrap_or(match self.model {
            GripperModel::Robotiq2F85 => 0.085,
            GripperModel::Robotiq2F140 => 0.140,
            GripperModel::FrankaHand => 0.080,
        })
    }

    /// Position counts in force, at the widest and closed.
    pub fn counts(&self) -> [u8; 2] {
        self.counts.unwrap_or([3, 230])
    }

    pub(super) fn check(&self) -> Result<(), String> {
        within("gripper.stroke", &[self.widest()], 0.001, 0.5)?;
        let [open, closed] = self.counts();
        if open >= closed {
            return Err(format!(
                "`gripper.counts` is [{open}, {closed}]; give the count at the widest first, it is the smaller one"
            ));
        }
        Ok(())
    }
}
