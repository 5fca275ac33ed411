//! Where the gains of a joint may lie: as cell.toml says, joint by joint; else as the robot itself says. A joint's drive holds it with
//! its largest torque when it is off by somewhere between a fraction of a milliradian and most of a turn, and leaves it neither
//! ringing without end nor creeping.

use super::ArmModel;
use shared_mem::cell::{Controller, Range};

/// Stiffness over the largest torque [1/rad]: servos with soft firmware gains have 0.06, an FR3 up to 40, stiff drives thousands.
const STIFFNESS: Range = [0.05, 5e3];
/// Damping over that at which the joint would not ring.
const DAMPING: Range = [0.02, 5.0];

/// Stiffness of a joint, from 0 [N m/rad]; `None` where neither cell.toml nor the robot tells.
pub fn stiffness_range(controller: &Controller, arm: &ArmModel, joint: usize) -> Option<Range> {
    if let Some(ranges) = &controller.stiffness_range {
        return ranges.of(joint);
    }
    let limit = arm.torque_limit()[joint];
    let known = controller.stiffness.is_empty() && limit.is_finite() && limit > 0.0;
    known.then(|| STIFFNESS.map(|share| share * limit))
}

/// Damping of a joint of such a stiffness [N m s/rad]; `None` where neither cell.toml nor the robot tells.
pub fn damping_range(controller: &Controller, arm: &ArmModel, joint: usize) -> Option<Range> {
    if let Some(ranges) = &controller.damping_range {
        return ranges.of(joint);
    }
    if !controller.damping.is_empty() {
        return None;
    }
    let stated = controller.stiffness.get(joint).map(|k| [*k, *k]);
    let [soft, stiff] = stated.or_else(|| stiffness_range(controller, arm, joint))?;
    let inertia = arm.mass_matrix(arm.ready())[joint][joint];
    let critical = |k: f64| 2.0 * (k * inertia).sqrt();
    Some([DAMPING[0] * critical(soft), DAMPING[1] * critical(stiff)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::{Cell, Ranges};
    use std::path::Path;

    fn servo(more: &str) -> (Cell, ArmModel) {
        let text = format!(
            "[robot]\njoints = [\"a\", \"b\"]\n[controller]\nkind = \"joint_pd\"\nrotor_inertia = [0.004, 0.001]\n{more}"
        );
        let cell = Cell::parse(&text, Path::new("cell.toml")).expect("a cell");
        let arm = ArmModel::from_cell(&cell).expect("a servo");
        (cell, arm)
    }

    #[test]
    fn a_robot_says_where_its_gains_lie_joint_by_joint_and_cell_toml_overrules_it() {
        let (cell, arm) = servo("torque_limit = [3.0, 0.6]\n");
        let controller = cell.controller.expect("a controller");
        let of = |joint| stiffness_range(&controller, &arm, joint).expect("a range");
        assert_eq!(of(0)[1], 5.0 * of(1)[1], "as the torque limits");
        let [lo, hi] = damping_range(&controller, &arm, 1).expect("a range");
        assert!((lo - 0.04 * (of(1)[0] * 0.001).sqrt()).abs() < 1e-12 && hi > 100.0 * lo, "{lo} {hi}");
        let (cell, arm) = servo("stiffness_range = [[1.0, 2.0], [3.0, 4.0]]\ntorque_limit = [3.0, 0.6]\n");
        let controller = cell.controller.expect("a controller");
        assert_eq!(controller.stiffness_range, Some(Ranges::Each(vec![[1.0, 2.0], [3.0, 4.0]])));
        assert_eq!(stiffness_range(&controller, &arm, 1), Some([3.0, 4.0]));
        let (cell, arm) = servo("stiffness = [2.0, 2.0]\n");
        assert_eq!(stiffness_range(cell.controller.as_ref().expect("a controller"), &arm, 0), None, "it is known");
        let (cell, arm) = servo("");
        assert_eq!(stiffness_range(cell.controller.as_ref().expect("a controller"), &arm, 0), None, "nothing tells");
    }

    #[test]
    fn ranges_that_are_not_one_a_joint_are_refused() {
        for wrong in ["[[1.0, 2.0]]", "[[1.0, 2.0], [2.0, 1.0]]", "[2.0, 1.0]"] {
            let text = format!("[robot]\njoints = [\"a\", \"b\"]\n[controller]\nstiffness_range = {wrong}\n");
            let error = Cell::parse(&text, Path::new("cell.toml")).expect_err(wrong).to_string();
            assert!(error.contains("stiffness_range") && error.contains("[low, high]"), "{error}");
        }
    }
}
