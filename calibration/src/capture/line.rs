//! Joint motions that lead the tool's end along a straight line, the tool's direction held. Base frame; m, s, rad.
//!
//! Pure kinematics of the nominal arm, by damped least squares on its Jacobian; called by the stroke planner.

use super::body::Body;
use nalgebra::{DMatrix, DVector, Isometry3, Vector3, Vector6};
use shared_mem::msg::{Joints, MAX_JOINTS};

/// Damping of the inverse, in metres and radians alike: invisible in the working space, and no leap near a singular pose.
const DAMPING: f64 = 1e-4;
/// Corrections until a pose counts as out of reach.
const CORRECTIONS: usize = 200;
/// A pose is reached when position [m] and direction [rad] are this close.
const REACHED: f64 = 1e-6;
/// Largest correction of a joint at once [rad].
const LARGEST: f64 = 0.2;

/// Joints that bring the tool's end to `target`, the nearest ones to `from`; `None` out of reach.
#[must_use]
pub fn reach(body: &Body, from: &Joints, target: &Isometry3<f64>) -> Option<Joints> {
    let mut q = *from;
    for _ in 0..CORRECTIONS {
        let error = error(body, &q, target);
        if error.amax() < REACHED {
            return Some(q);
        }
        let step = joints_for(body, &q, &error);
        let largest = step.iter().fold(0.0_f64, |largest, step| largest.max(step.abs()));
        let share = (LARGEST / largest).min(1.0);
        q.iter_mut().zip(&step).for_each(|(q, step)| *q += share * step);
    }
    None
}

/// Joint velocities that move the tool's end with `velocity` [m/s] and turn it nowhere.
#[must_use]
pub fn joint_velocity(body: &Body, q: &Joints, velocity: &Vector3<f64>) -> Joints {
    joints_for(body, q, &Vector6::new(velocity.x, velocity.y, velocity.z, 0.0, 0.0, 0.0))
}

/// From where the tool's end is to `target`: translation, then rotation vector.
fn error(body: &Body, q: &Joints, target: &Isometry3<f64>) -> Vector6<f64> {
    let tip = body.model().tip(q).isometry();
    let shift = target.translation.vector - tip.translation.vector;
    let turn = (target.rotation * tip.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Smallest joint motion that moves the tool's end by `motion`.
fn joints_for(body: &Body, q: &Joints, motion: &Vector6<f64>) -> Joints {
    let tip = body.model().tip(q).isometry().translation.vector;
    let columns = body.model().jacobian(q, tip.into());
    let dof = body.model().dof();
    let jacobian = DMatrix::from_fn(6, dof, |row, joint| columns[joint][row]);
    let mut gram = &jacobian * jacobian.transpose();
    for i in 0..6 {
        gram[(i, i)] += DAMPING * DAMPING;
    }
    let weights = gram.cholesky().map(|gram| gram.solve(&DVector::from_column_slice(motion.as_slice())));
    let step = weights.map_or_else(|| DVector::zeros(dof), |weights| jacobian.tr_mul(&weights));
    let mut out = [0.0; MAX_JOINTS];
    out.iter_mut().zip(step.iter()).for_each(|(out, step)| *out = *step);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};
    use shared_mem::cell::{Cell, Robot};

    fn fr3() -> Body {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        Body::of(&Cell { robot: Some(robot), ..Cell::default() }).expect("an FR3")
    }

    fn pointing_down(x: f64, y: f64, z: f64) -> Isometry3<f64> {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts(Translation3::new(x, y, z), down)
    }

    #[test]
    fn a_pose_in_the_working_space_is_reached() {
        let body = fr3();
        let target = pointing_down(0.45, 0.2, 0.15);
        let q = reach(&body, body.model().ready(), &target).expect("in reach");
        let tip = body.model().tip(&q).isometry();
        assert!((tip.translation.vector - target.translation.vector).norm() < 2e-6);
        assert!(tip.rotation.angle_to(&target.rotation) < 2e-6);
    }

    #[test]
    fn a_pose_two_metres_away_is_out_of_reach() {
        let body = fr3();
        assert_eq!(reach(&body, body.model().ready(), &pointing_down(2.0, 0.0, 0.2)), None);
    }

    #[test]
    fn joint_velocities_move_the_tool_as_asked() {
        let body = fr3();
        let (q, asked) = (*body.model().ready(), Vector3::new(0.3, -0.2, 0.0));
        let dq = joint_velocity(&body, &q, &asked);
        let later: Joints = std::array::from_fn(|i| q[i] + dq[i] * 1e-5);
        let place = |q: &Joints| body.model().tip(q).isometry();
        let moved = (place(&later).translation.vector - place(&q).translation.vector) / 1e-5;
        assert!((moved - asked).norm() < 1e-4, "{moved}");
    }
}
