//! Joints that bring the arm's flange or tip to a pose, by damped least squares on the Jacobian. Base frame; m, rad.

use super::{ArmModel, Joints, MAX_JOINTS};
use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector6};

/// Damping of the inverse, in metres and radians alike: invisible in the working space, and no leap near a singular pose.
const DAMPING: f64 = 1e-4;
/// Corrections until a pose counts as out of reach.
const CORRECTIONS: usize = 200;
/// A pose is reached when position [m] and direction [rad] are this close: a microradian in a millisecond would already be
/// a jerk of 1000 rad/s³.
const REACHED: f64 = 1e-10;
/// Largest correction of a joint at once [rad].
const LARGEST: f64 = 0.2;

impl ArmModel {
    /// Joints that bring a point of the flange and the axes there, `flange_from_point`, to `target`: the nearest ones to `from`,
    /// whatever their limits; `None` out of reach.
    pub fn reach(&self, from: &Joints, flange_from_point: &Isometry3<f64>, target: &Isometry3<f64>) -> Option<Joints> {
        let mut q = *from;
        for _ in 0..CORRECTIONS {
            let at = self.flange(&q).isometry() * flange_from_point;
            let shift = target.translation.vector - at.translation.vector;
            let turn = (target.rotation * at.rotation.inverse()).scaled_axis();
            let error = Vector6::from_iterator(shift.iter().chain(turn.iter()).copied());
            if error.amax() < REACHED {
                return Some(q);
            }
            let step = self.joints_for(&q, at.translation.vector.into(), &error);
            let largest = step.iter().fold(0.0_f64, |largest, step| largest.max(step.abs()));
            let share = (LARGEST / largest).min(1.0);
            q.iter_mut().zip(&step).for_each(|(q, step)| *q += share * step);
        }
        None
    }

    /// Smallest motion of the joints that moves a point of the last link at `point` by `motion`: x, y, z, then a rotation
    /// vector, or the velocities of both.
    pub fn joints_for(&self, q: &Joints, point: Point3<f64>, motion: &Vector6<f64>) -> Joints {
        let columns = self.jacobian(q, point.coords.into());
        let jacobian = DMatrix::from_fn(6, self.dof(), |row, joint| columns[joint][row]);
        let mut gram = &jacobian * jacobian.transpose();
        for i in 0..6 {
            gram[(i, i)] += DAMPING * DAMPING;
        }
        let weights = gram.cholesky().map(|gram| gram.solve(&DVector::from_column_slice(motion.as_slice())));
        let mut out = [0.0; MAX_JOINTS];
        if let Some(weights) = weights {
            out.iter_mut().zip(jacobian.tr_mul(&weights).iter()).for_each(|(out, step)| *out = *step);
        }
        out
    }
}
