//! `[controller]`: the law between command and torque.

use super::within;
use crate::msg::MAX_JOINTS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The joint controller. Vectors hold one number a joint; an empty one is "not known".
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [controller] block")]
pub struct Controller {
    /// The law.
    pub kind: ControllerKind,
    /// Nominal stiffness [N m/rad].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness: Vec<f64>,
    /// Nominal damping [N m s/rad].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub damping: Vec<f64>,
    /// Where every stiffness may lie [N m/rad]; default: within 20 % of nominal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_range: Option<Range>,
    /// Where every damping may lie [N m s/rad]; default: within 20 % of nominal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_range: Option<Range>,
    /// Rotor inertia seen at the joint [kg m²].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rotor_inertia: Vec<f64>,
    /// Largest torque [N m].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque_limit: Vec<f64>,
    /// Where logged torques are measured.
    #[serde(default, skip_serializing_if = "TorqueSensing::is_joint")]
    pub torque_sensing: TorqueSensing,
}

/// Where the torques of a log are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TorqueSensing {
    /// Behind the gear, as in a Franka: what turns the rotor is not in them.
    #[default]
    Joint,
    /// In the motor, as where a current was logged times its torque constant: the rotor is in them.
    Motor,
}

impl TorqueSensing {
    fn is_joint(&self) -> bool {
        *self == Self::Joint
    }
}

/// Lower and upper bound.
pub type Range = [f64; 2];

/// The law between command and torque, evaluated at 1 kHz and held in between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ControllerKind {
    /// `tau = k (q_d - q) + d (dq_d - dq) + gravity(q) + coriolis(q, dq)` of the nominal model.
    #[default]
    JointImpedance,
    /// `tau = k (q_d - q) - d dq`: a servo, nothing compensated.
    JointPd,
    /// No law that a robot has: the joints go along the desired motion, by whatever torque that takes. Not for cell.toml.
    #[serde(skip_deserializing)]
    Tracking,
}

impl Controller {
    pub(super) fn check(&self, dof: Option<usize>) -> Result<(), String> {
        let blocks = [
            ("controller.stiffness", &self.stiffness),
            ("controller.damping", &self.damping),
            ("controller.rotor_inertia", &self.rotor_inertia),
            ("controller.torque_limit", &self.torque_limit),
        ];
        for (key, values) in blocks {
            within(key, values, 0.0, 1e6)?;
            if values.len() > MAX_JOINTS {
                return Err(format!(
                    "`{key}` holds {} numbers; at most {MAX_JOINTS} joints are supported",
                    values.len()
                ));
            }
            if let (Some(dof), false) = (dof, values.is_empty())
                && values.len() != dof
            {
                return Err(format!(
                    "`{key}` holds {} numbers; this arm has {dof} joints: give one for each",
                    values.len()
                ));
            }
        }
        for (key, range) in
            [("controller.stiffness_range", self.stiffness_range), ("controller.damping_range", self.damping_range)]
        {
            if let Some([lo, hi]) = range
                && !(lo >= 0.0 && hi > lo)
            {
                return Err(format!("`{key}` must be [low, high] with 0 <= low < high"));
            }
        }
        Ok(())
    }
}
