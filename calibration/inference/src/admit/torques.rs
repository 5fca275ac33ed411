//! Measured torques against the model along the measured motion, whatever controller led the arm: for logs without commands, and
//! where the control law is not known.
//!
//! The arm of the twin is moved along what was measured, smoothed, by whatever torque that takes
//! ([`ControllerKind::Tracking`]), and this torque is held against the measured one. Effects on the way of a command do not show;
//! friction, payloads, base tilts and the like do, gains and delays or not.

pub use crate::likelihood::arm::is_tracking;
use crate::likelihood::smoothing;
use shared_mem::cell::{Cell, Controller, ControllerKind, Robot};
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;

/// What was found, without the gains of the law that kept the arm on its way: no robot has those. `given`: what was known before.
pub fn without_law(theta: Theta, given: Option<&Theta>) -> Theta {
    Theta { arm: given.and_then(|given| given.arm.clone()), ..theta }
}

/// The cell whose arm goes where it was measured; `None` where cell.toml has no controller, or only joints without bodies, of
/// which no torque can be predicted.
pub fn tracking_cell(cell: &Cell) -> Option<Cell> {
    let controller = cell.controller.as_ref()?;
    if cell.robot.as_ref().is_none_or(Robot::joints_only) {
        return None;
    }
    // Of the law nothing is left; what is known of motors and sensors stays.
    let controller = Controller {
        kind: ControllerKind::Tracking,
        stiffness: Vec::new(),
        damping: Vec::new(),
        stiffness_range: None,
        damping_range: None,
        torque_limit: Vec::new(),
        integral_rate: Vec::new(),
        voltage_limit: Vec::new(),
        ..controller.clone()
    };
    Some(Cell { controller: Some(controller), ..cell.clone() })
}

/// A clip whose command is its own measured motion, smoothed; `None` where it is too short for that. Its ends, where a fit has
/// rows on one side only, are left out.
pub fn followed(mut clip: Clip) -> Option<Clip> {
    let measured = &clip.measured;
    let (first, last) = (*measured.stamps_ns.first()?, *measured.stamps_ns.last()?);
    let half = smoothing::half_width(&measured.stamps_ns)?;
    let (from, to) = (first + half, last.checked_sub(half)?);
    if to <= from {
        return None;
    }
    let grid: Vec<u64> = (from..=to).step_by(TICK_NS as usize).collect();
    let desired = smoothing::motion(measured, &grid, half);
    let kept = measured.between(from..=to);
    let motion = smoothing::motion(measured, &kept.stamps_ns, half);
    clip.measured = JointSeries { tau: kept.tau, ..motion };
    clip.desired = desired;
    // A torque belongs to the row that it was logged with.
    clip.torques_end_at_rows = true;
    (!clip.measured.is_empty()).then_some(clip)
}

/// The cell without its robot, in which an object moves by itself.
pub fn without_robot(cell: &Cell) -> Cell {
    Cell { robot: None, controller: None, tool: None, ..cell.clone() }
}

#[cfg(test)]
mod tests {
    use super::super::test_cell::{changed, filled};
    use super::*;
    use shared_mem::theta::ArmTheta;

    #[test]
    fn a_cell_whose_arm_goes_where_it_was_measured_is_the_same_but_for_the_law() {
        let given = filled();
        let tracking = tracking_cell(&given).expect("a model");
        let law = [
            "kind",
            "stiffness",
            "damping",
            "stiffness_range",
            "damping_range",
            "torque_limit",
            "integral_rate",
            "voltage_limit",
        ];
        assert_eq!(changed(&given, &tracking), law.map(|key| format!("controller.{key}")).into());
        assert!(is_tracking(&tracking));
    }

    #[test]
    fn gains_of_the_law_that_keeps_the_arm_on_its_way_are_no_finding() {
        let found = Theta { arm: Some(ArmTheta { stiffness: vec![9e4], damping: vec![600.0] }), ..Theta::default() };
        assert_eq!(without_law(found.clone(), None).arm, None);
        let known = Theta { arm: Some(ArmTheta { stiffness: vec![500.0], damping: vec![40.0] }), ..Theta::default() };
        assert_eq!(without_law(found, Some(&known)).arm, known.arm);
    }

    #[test]
    fn a_cell_without_its_robot_is_the_same_but_for_that() {
        let cell = filled();
        let changed = changed(&cell, &without_robot(&cell));
        let of_robot = |key: &String| ["robot.", "controller.", "tool."].iter().any(|block| key.starts_with(block));
        assert!(!changed.is_empty() && changed.iter().all(of_robot), "{changed:?}");
    }
}
