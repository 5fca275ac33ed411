//! The arm of a log as whoever knows kinematics and dynamics tells of it: of the cell that was given, or of the description that
//! the log holds itself.

use crate::cell::{self, Rotors, is_franka};
use crate::clip::Gravity;
use crate::error::ImportError;
use crate::log::Log;
use crate::mapping::Note;
use crate::propose::{Known, Proposal, propose};
use shared_mem::cell::Cell;
use shared_mem::recording::RobotModel;
use std::path::Path;
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

/// The mapping by what is known of the arm: the one that was given, the log's own, or the one that its joints' names tell.
pub(crate) fn proposal(log: &Log, given: Option<&Cell>, arms: Arms<'_>) -> Result<Proposal, ImportError> {
    let failed = |what: String| ImportError::log(&log.file, what);
    if let Some(cell) = given {
        let named = || (cell.robot.as_ref().map_or_else(Vec::new, |robot| robot.joints.clone()), Vec::new());
        let (joints, fastest) = arms(cell, None).map_err(failed)?.map_or_else(named, |arm| (arm.joints, arm.fastest));
        let known = Known { cell: given, joints: &joints, fastest: &fastest };
        return propose(log, known, &|_| arms(cell, None).ok()??.gravity).map_err(failed);
    }
    let by_name = |joints: &[String]| {
        let cell = Cell::parse(&cell::proposed(log, joints, None), Path::new("cell.toml")).ok()?;
        arms(&cell, None).ok()??.gravity
    };
    let plain = propose(log, Known::default(), &by_name).map_err(failed)?;
    let (mut proposal, why) = match described(log, &plain.mapping.joints, arms) {
        Ok(None) => return Ok(plain),
        Ok(Some((text, Arm { joints, fastest, held, rotors, .. }))) => {
            let gravity = |_: &[String]| arms(&Cell::default(), Some(&text)).ok()??.gravity;
            let held = if held.is_empty() { String::new() } else { format!("; held where they are: {held}") };
            let rotors = rotors.map_or_else(String::new, |rotors| format!("; {}", cell::stand_in(&rotors)));
            (
                propose(log, Known { joints: &joints, fastest: &fastest, cell: None }, &gravity).map_err(failed)?,
                format!("the log's robot_description{held}{rotors}"),
            )
        }
        Err(what) => (plain, format!("the log's robot_description is not used: {what}")),
    };
    proposal.notes.insert(0, Note { line: "robot".into(), why, open: false, instead: Vec::new() });
    Ok(proposal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Column, Facts, Table};

    /// Joint states in the order of the alphabet, as ROS programs publish them.
    fn bag(description: &str) -> Log {
        let column = |name: &str, speed: f64| Column {
            name: name.into(),
            values: (0..50).map(|row| (f64::from(row) * speed).sin()).collect(),
        };
        let stamps_ns = Some((0..50).map(|row| row * 20_000_000).collect());
        let columns =
            vec![column("position[elbow]", 0.05), column("position[finger]", 0.0), column("position[shoulder]", 0.1)];
        Log {
            name: "run".into(),
            format: "ROS 2 bag",
            tables: vec![Table { name: "/joint_states".into(), stamps_ns, columns }],
            facts: Facts { description: Some(description.into()), ..Facts::default() },
            ..Log::default()
        }
    }

    fn arms(_: &Cell, urdf: Option<&str>) -> Result<Option<Arm>, String> {
        match urdf {
            Some("broken") => Err("it is no URDF".into()),
            Some(_) => Ok(Some(Arm {
                joints: vec!["shoulder".into(), "elbow".into()],
                fastest: vec![],
                held: "finger (named as a finger is)".into(),
                rotors: None,
                gravity: None,
                shown: None,
            })),
            None => Ok(None),
        }
    }

    #[test]
    fn joints_come_in_the_order_of_the_arm_that_the_log_describes() {
        let Proposal { mapping, notes } = proposal(&bag("<robot/>"), None, &arms).expect("a log");
        assert_eq!(mapping.joints, ["shoulder", "elbow"]);
        assert_eq!(mapping.measured.expect("columns").q, ["position[shoulder]", "position[elbow]"]);
        assert!(notes[0].why.contains("robot_description") && notes[0].why.contains("finger"), "{notes:?}");
    }

    #[test]
    fn a_description_of_no_use_is_said_and_the_joints_are_taken_as_they_are() {
        let Proposal { mapping, notes } = proposal(&bag("broken"), None, &arms).expect("a log");
        assert_eq!(mapping.joints, ["elbow", "shoulder"]);
        assert!(notes[0].why.contains("not used: it is no URDF"), "{notes:?}");
    }
}
