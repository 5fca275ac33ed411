//! The joint positions of a pose, near to where the joints are: Newton's method on the pose error. A seventh joint leaves
//! one freedom: the client's elbow (joint 3) decides it, else the joints move as little as they can.
//!
//! Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics (2009), 3.7.

use crate::serve::kinematics::{ELBOW, Frame, Jacobian, difference};
use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Vector6};
use twin::arm::Joints;

/// Iterations before a pose counts as out of reach. Within a millisecond's way three are enough.
const PATIENCE: usize = 20;
/// Pose error that is none [m, rad]: four orders below what the jerk limit would notice.
const EXACT: f64 = 1e-12;
/// Pose error that is good enough when rounding stops progress [m, rad].
const GOOD: f64 = 1e-10;
/// Kept from dividing by nothing at a singular pose [m², 1].
const DAMPING: f64 = 1e-9;
/// Joint positions near `start` with the frame `ee` at `target` and, where given, joint 3 at `elbow` [rad].
/// `None` where there are none.
pub(super) fn solve(ee: &Frame, start: &Joints, target: &Isometry3<f64>, elbow: Option<f64>) -> Option<Joints> {
    let mut q = *start;
    let mut error = f64::INFINITY;
    for _ in 0..PATIENCE {
        let miss = difference(&ee.pose(&q), target);
        let off = elbow.map_or(0.0, |elbow| elbow - q[ELBOW]);
        error = miss.norm() + off.abs();
        if error < EXACT {
            break;
        }
        let step = step(&ee.jacobian(&q), &miss, elbow.map(|_| off))?;
        for (q, step) in q.iter_mut().zip(step.iter()) {
            *q += step;
        }
    }
    // Not a number is no answer either.
    (error < GOOD).then_some(q)
}

fn step(jacobian: &Jacobian, miss: &Vector6<f64>, elbow: Option<f64>) -> Option<SVector<f64, 7>> {
    match elbow {
        None => {
            let square: Matrix6<f64> = jacobian * jacobian.transpose() + Matrix6::identity() * DAMPING;
            Some(jacobian.transpose() * square.cholesky()?.solve(miss))
        }
        Some(off) => {
            let mut all = SMatrix::<f64, 7, 7>::zeros();
            all.fixed_view_mut::<6, 7>(0, 0).copy_from(jacobian);
            all[(6, ELBOW)] = 1.0;
            let mut wanted = SVector::<f64, 7>::zeros();
            wanted.fixed_rows_mut::<6>(0).copy_from(miss);
            wanted[6] = off;
            all.lu().solve(&wanted)
        }
    }
}
