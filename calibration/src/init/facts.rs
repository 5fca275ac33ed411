//! What a person says about the cell, by flags or answers.

use shared_mem::cell::ControllerKind;
use shared_mem::quantity::{number, numbers};
use std::path::PathBuf;

/// What a person says. Absent: nobody said so.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Facts {
    pub robot: Option<Named>,
    /// With a URDF: which of its joints are the arm's, from base to flange, or what recordings call them.
    pub joints: Vec<String>,
    /// The law between command and torque.
    pub controller: Option<ControllerKind>,
    /// Nominal stiffness, one a joint [N m/rad].
    pub stiffness: Vec<f64>,
    /// Nominal damping, one a joint [N m s/rad].
    pub damping: Vec<f64>,
    /// Mass [kg], length [m] and radius [m] of the tool.
    pub tool: Option<[f64; 3]>,
    /// Height of the table in the base frame [m].
    pub table: Option<f64>,
    /// Edge lengths of a box along its x, y, z [m].
    pub object: Option<[f64; 3]>,
}

/// The arm, as it is named.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Named {
    /// A built-in model.
    Model(String),
    /// A URDF, or a xacro file that makes one.
    Urdf(PathBuf),
    /// The names of the joints alone.
    Joints(Vec<String>),
}

impl Named {
    /// An answer to "which robot": a built-in model, the path of a URDF, or names of joints with commas between them.
    ///
    /// # Errors
    /// What may be answered.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let is_file = [".urdf", ".xacro", ".xml"].iter().any(|end| text.to_ascii_lowercase().ends_with(end));
        if text == "fr3" {
            Ok(Self::Model(text.to_owned()))
        } else if is_file {
            Ok(Self::Urdf(text.into()))
        } else if text.contains(',') {
            Ok(Self::Joints(text.split(',').map(|name| name.trim().to_owned()).collect()))
        } else {
            Err("answer with fr3, the path of a .urdf or .xacro file, or the joints' names with commas between them"
                .into())
        }
    }
}

/// Gains, one a joint, with commas between them.
///
/// # Errors
/// What is wrong with them.
pub(super) fn gains(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(|gain| number(gain, 0.0..=1e6, "")).collect()
}

/// Mass [kg], length [m] and radius [m].
///
/// # Errors
/// How the three are to be given.
pub fn tool(text: &str) -> Result<[f64; 3], String> {
    let [mass, length, radius] = numbers(text, 0.0..=50.0, "")?;
    if length <= radius || radius < 1e-4 {
        return Err(
            "give mass [kg], length to the tip [m] and radius [m], which is less than the length: 0.25,0.16,0.012"
                .into(),
        );
    }
    Ok([mass, length, radius])
}

/// Edge lengths [m].
///
/// # Errors
/// How many, and in which range they must be.
pub fn edges(text: &str) -> Result<[f64; 3], String> {
    numbers(text, 1e-3..=10.0, "m")
}

/// A height [m].
///
/// # Errors
/// In which range it must be.
pub fn height(text: &str) -> Result<f64, String> {
    number(text, -10.0..=10.0, "m")
}

/// A controller's kind by its name in cell.toml.
///
/// # Errors
/// The names.
pub fn controller(text: &str) -> Result<ControllerKind, String> {
    match text.trim() {
        "joint_impedance" => Ok(ControllerKind::JointImpedance),
        "compensated_pd" => Ok(ControllerKind::CompensatedPd),
        "joint_pd" => Ok(ControllerKind::JointPd),
        "inverse_dynamics" => Ok(ControllerKind::InverseDynamics),
        "joint_velocity" => Ok(ControllerKind::JointVelocity),
        _ => Err("give joint_impedance (gravity and velocities of the commands are compensated), inverse_dynamics (inertia as \
                  well), compensated_pd (gravity alone; the damper acts on measured velocities), joint_velocity (commands are \
                  velocities) or joint_pd (a servo)"
            .into()),
    }
}
