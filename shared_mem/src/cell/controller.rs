//! `[controller]`: the law between command and torque.

use super::ranges::Ranges;
use super::within;
use crate::msg::MAX_JOINTS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The joint controller. Vectors hold one number a joint; an empty one is "not known".
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a [controller] block")]
pub struct Controller {
    /// The law; left out where it is not known: `identify arm` and `diagnose` find which one fits.
    #[serde(default = "ControllerKind::unstated", skip_serializing_if = "ControllerKind::is_unstated")]
    pub kind: ControllerKind,
    /// Nominal stiffness [N m/rad].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness: Vec<f64>,
    /// Nominal damping [N m s/rad].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub damping: Vec<f64>,
    /// Where every stiffness may lie, or each by itself [N m/rad]; default: within 20 % of nominal, else what such a robot has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_range: Option<Ranges>,
    /// Where every damping may lie, or each by itself [N m s/rad]; default: within 20 % of nominal, else what such a robot has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_range: Option<Ranges>,
    /// Rotor inertia seen at the joint [kg m²].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rotor_inertia: Vec<f64>,
    /// Largest torque [N m].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque_limit: Vec<f64>,
    /// How fast an integral part of the law answers [1/s]: its gain over the stiffness.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub integral_rate: Vec<f64>,
    /// Largest torque at standstill of drives whose voltage is limited, as of servos with pulse-width modulation [N m].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub voltage_limit: Vec<f64>,
    /// Torque at the joint over the current of the motor, where currents were logged in place of torques [N m/A]; negative where
    /// motor or gear turn against the joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque_constant: Vec<f64>,
    /// Where logged torques are measured.
    #[serde(default, skip_serializing_if = "TorqueSensing::is_joint")]
    pub torque_sensing: TorqueSensing,
    /// What the law is given between two rows of a log of commands that is slower than its 1 kHz; left out where it is not known:
    /// `identify arm` and `diagnose` find which fits.
    #[serde(default, skip_serializing_if = "BetweenCommands::is_unstated")]
    pub between_commands: BetweenCommands,
}

/// What a controller at 1 kHz is given between two rows of a slower log of its commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BetweenCommands {
    /// Not known; simulated as `held`. Not for cell.toml: it is what a missing key means.
    #[default]
    #[serde(skip_deserializing)]
    Unstated,
    /// The newest row: commands came at the log's rate.
    Held,
    /// The straight line between both rows.
    Line,
    /// The cubic through the four nearest rows: commands came at 1 kHz and the log has some of them.
    Smooth,
}

impl BetweenCommands {
    fn is_unstated(&self) -> bool {
        *self == Self::Unstated
    }

    /// Its name in cell.toml; `None` where it is not known.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Unstated => None,
            Self::Held => Some("held"),
            Self::Line => Some("line"),
            Self::Smooth => Some("smooth"),
        }
    }
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

/// The law between command and torque, evaluated at 1 kHz and held in between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ControllerKind {
    /// `tau = k (q_d - q) + d (dq_d - dq) + gravity(q) + coriolis(q, dq)` of the nominal model.
    #[default]
    JointImpedance,
    /// `tau = k (q_d - q) - d dq + gravity(q) + coriolis(q, dq)`: PD control with compensation, whose damper knows no desired velocity.
    CompensatedPd,
    /// `tau = k (q_d - q) - d dq`: a servo, nothing compensated.
    JointPd,
    /// `joint_impedance` with `M(q) ddq_d` added: the inertia is fed forward.
    InverseDynamics,
    /// `tau = d (dq_d - dq) + k s + gravity(q) + coriolis(q, dq)`, `ds/dt = dq_d - dq`: commands are velocities, `k` sums up what
    /// the joint is off.
    JointVelocity,
    /// Not known which; simulated as `joint_impedance`. Not for cell.toml: it is what a missing `kind` means.
    #[serde(skip_deserializing)]
    Unstated,
    /// No law that a robot has: the joints go along the desired motion, by whatever torque that takes. Not for cell.toml.
    #[serde(skip_deserializing)]
    Tracking,
}

impl ControllerKind {
    fn unstated() -> Self {
        Self::Unstated
    }

    fn is_unstated(&self) -> bool {
        *self == Self::Unstated
    }

    /// Its name in cell.toml; `None` for what is no law of a robot.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::JointImpedance => Some("joint_impedance"),
            Self::CompensatedPd => Some("compensated_pd"),
            Self::JointPd => Some("joint_pd"),
            Self::InverseDynamics => Some("inverse_dynamics"),
            Self::JointVelocity => Some("joint_velocity"),
            Self::Unstated | Self::Tracking => None,
        }
    }
}

impl Controller {
    pub(super) fn check(&self, dof: Option<usize>) -> Result<(), String> {
        let blocks = [
            ("controller.stiffness", &self.stiffness),
            ("controller.damping", &self.damping),
            ("controller.rotor_inertia", &self.rotor_inertia),
            ("controller.torque_limit", &self.torque_limit),
            ("controller.integral_rate", &self.integral_rate),
            ("controller.voltage_limit", &self.voltage_limit),
            ("controller.torque_constant", &self.torque_constant),
        ];
        for (key, values) in blocks {
            // A motor that is mounted the other way round has a torque against its current.
            let least = if key == "controller.torque_constant" { -1e6 } else { 0.0 };
            within(key, values, least, 1e6)?;
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
        let ranges =
            [("controller.stiffness_range", &self.stiffness_range), ("controller.damping_range", &self.damping_range)];
        ranges
            .into_iter()
            .filter_map(|(key, range)| Some((key, range.as_ref()?)))
            .try_for_each(|(k, r)| r.check(k, dof))
    }
}
