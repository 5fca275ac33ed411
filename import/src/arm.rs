//! The arm of a log as whoever knows kinematics and dynamics tells of it: of the cell that was given, or of the description that
//! the log holds itself.

use crate::cell::{Rotors, is_franka};
use crate::clip::Gravity;
use crate::log::Log;
use shared_mem::cell::Cell;
use shared_mem::recording::RobotModel;
use std::sync::Arc;

/// What is known of an arm.
pub struct Arm {
    /// Its joints, from base to flange.
    pub joints: Vec<String>,
    /// The speeds that its description allows them [rad/s]; infinite where it does not say.
    pub fastest: Vec<f64>,
    /// Joints of its description that move and are none of its own, such as fingers, with why, in words; empty where there are none.
    pub held: String,
    /// What its description says nothing of, and without which it could not move.
    pub rotors: Option<Rotors>,
    /// Gravity's torques, where it has a shape.
    pub gravity: Option<Gravity>,
    /// What viewers of the clips are shown, where it has a shape.
    pub shown: Option<Arc<RobotModel>>,
}

/// Tells of the arm of a cell; with a URDF's text, of that one in place of the arm that the cell names. `None` where the cell has
/// no arm; a sentence where it cannot be used.
pub type Arms<'a> = &'a dyn Fn(&Cell, Option<&str>) -> Result<Option<Arm>, String>;

/// The URDF that a log holds, where it is the arm's whose joints the log has. `None` where there is none, or where the arm is the
/// built-in one; a sentence where it is of no use.
pub(crate) fn described(log: &Log, joints: &[String], arms: Arms<'_>) -> Result<Option<(String, Arm)>, String> {
    let Some(text) = &log.facts.description else { return Ok(None) };
    if joints.is_empty() || (is_franka(joints) && joints.iter().all(|joint| joint.contains("fr3"))) {
        return Ok(None);
    }
    let Some(arm) = arms(&Cell::default(), Some(text))? else { return Ok(None) };
    let missing: Vec<&str> = arm.joints.iter().filter(|joint| !joints.contains(joint)).map(String::as_str).collect();
    if !missing.is_empty() {
        return Err(format!("the log holds no positions of its joints {}", missing.join(", ")));
    }
    Ok(Some((text.clone(), arm)))
}
