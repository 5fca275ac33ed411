//! Joints within their limits that bring the flange as near to a pose as they can: damped least squares, with a damping
//! that grows with what is left, so that poses out of reach and singular ones have an answer too, and it never leaps. Base
//! frame; m, rad.
//!
//! Source: Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE T-RO 27 (2011).

use super::{ArmModel, Joints, Limits, MAX_JOINTS};
use nalgebra::{Isometry3, SMatrix, SVector, Vector6};

type Square = SMatrix<f64, MAX_JOINTS, MAX_JOINTS>;
type Column = SVector<f64, MAX_JOINTS>;

/// Damping where nothing is left, as a share of square metres.
const DAMPING: f64 = 1e-6;
/// So many metres count as much as a radian.
const LEVER: f64 = 0.3;
/// Corrections at most: a target a few millimetres ahead takes three.
const CORRECTIONS: usize = 60;
/// Less than this is no miss [m, and LEVER rad].
const EXACT: f64 = 1e-7;
/// A correction that moves no joint further is the last [rad].
const STILL: f64 = 1e-9;
/// Largest correction of a joint at once [rad].
const LARGEST: f64 = 0.2;

/// Joints, and how far they miss the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Where the joints are to be [rad].
    pub q: Joints,
    /// From the flange's origin there to that of the pose [m].
    pub off: f64,
    /// Between the axes [rad].
    pub turned: f64,
}

impl ArmModel {
    /// Joints near `from` and within [`super::JointLimits::targets`] that bring the flange to `target`, or as near to it as
    /// corrections from there lead. Allocates nothing.
    pub fn nearest(&self, limits: &Limits, from: &Joints, target: &Isometry3<f64>) -> Nearest {
        let mut q = within(limits, from);
        for _ in 0..CORRECTIONS {
            let error = self.miss(&q, target);
            let square = weighted(&error).norm_squared();
            if square < EXACT * EXACT {
                break;
            }
            let columns = self.jacobian(&q, self.flange(&q).isometry().translation.vector.into());
            let step =
                correction(limits, &q, &columns.map(|column| weighted(&Vector6::from(column))), &weighted(&error));
            let largest = step.amax();
            // What is no number is no correction.
            if largest.is_nan() || largest <= STILL {
                break;
            }
            let share = (LARGEST / largest).min(1.0);
            let next: Joints = std::array::from_fn(|i| q[i] + share * step[i]);
            q = within(limits, &next);
        }
        let error = self.miss(&q, target);
        let [off, turned] = [0, 3].map(|at| error.fixed_rows::<3>(at).norm());
        Nearest { q, off, turned }
    }

    /// What brings the flange from where it is to a pose: x, y, z, then a rotation vector.
    fn miss(&self, q: &Joints, target: &Isometry3<f64>) -> Vector6<f64> {
        let at = self.flange(q).isometry();
        let shift = target.translation.vector - at.translation.vector;
        let turn = (target.rotation * at.rotation.inverse()).scaled_axis();
        Vector6::from_iterator(shift.iter().chain(turn.iter()).copied())
    }
}

fn weighted(motion: &Vector6<f64>) -> Vector6<f64> {
    let mut out = *motion;
    out.fixed_rows_mut::<3>(3).scale_mut(LEVER);
    out
}

fn within(limits: &Limits, q: &Joints) -> Joints {
    let mut out = [0.0; MAX_JOINTS];
    for (i, joint) in limits.counted().enumerate() {
        let [low, high] = joint.targets();
        out[i] = if q[i].is_finite() { q[i].max(low).min(high) } else { 0.5 * (low + high) };
    }
    out
}

/// The damped correction; joints that it would push beyond an end stay there and the others make up for them.
fn correction(limits: &Limits, q: &Joints, columns: &[Vector6<f64>; MAX_JOINTS], error: &Vector6<f64>) -> Column {
    let damping = DAMPING + 0.5 * error.norm_squared();
    let mut held = [false; MAX_JOINTS];
    let mut step = Column::zeros();
    for _ in 0..=limits.dof {
        let of = |i: usize| if i < limits.dof && !held[i] { columns[i] } else { Vector6::zeros() };
        let square = Square::from_fn(|i, j| of(i).dot(&of(j)) + if i == j { damping } else { 0.0 });
        let gradient = Column::from_fn(|i, _| of(i).dot(error));
        step = square.cholesky().map_or_else(Column::zeros, |square| square.solve(&gradient));
        let pushed = limits.counted().enumerate().position(|(i, joint)| {
            let [low, high] = joint.targets();
            !held[i] && (q[i] <= low && step[i] < 0.0 || q[i] >= high && step[i] > 0.0)
        });
        let Some(pushed) = pushed else { break };
        held[pushed] = true;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn places(places: [f64; 7]) -> Joints {
        let limits = Limits::fr3();
        std::array::from_fn(|i| {
            places.get(i).map_or(0.0, |place| {
                let [low, high] = limits.joints[i].targets();
                low + place * (high - low)
            })
        })
    }

    proptest! {
        #[test]
        fn a_pose_a_little_on_is_reached_exactly(at in prop::array::uniform7(0.2..0.8_f64), by in prop::array::uniform7(-0.02..0.02_f64)) {
            let (model, limits) = (ArmModel::fr3(), Limits::fr3());
            let from = places(at);
            let there: Joints = std::array::from_fn(|i| from[i] + by.get(i).copied().unwrap_or(0.0));
            let found = model.nearest(&limits, &from, &model.flange(&there).isometry());
            prop_assert!(found.off < 1e-5 && found.turned < 1e-4, "{found:?}");
        }

        #[test]
        fn whatever_the_pose_the_joints_are_within_their_limits_and_nearer_to_it(
            at in prop::array::uniform7(0.0..1.0_f64),
            place in prop::array::uniform3(-2.0..2.0_f64),
            turn in prop::array::uniform3(-3.0..3.0_f64),
        ) {
            let (model, limits) = (ArmModel::fr3(), Limits::fr3());
            let target = Isometry3::new(place.into(), turn.into());
            let from = places(at);
            let found = model.nearest(&limits, &from, &target);
            for (q, joint) in found.q.iter().zip(limits.counted()) {
                prop_assert!((joint.q_min..=joint.q_max).contains(q));
            }
            let cost = |q: &Joints| weighted(&model.miss(q, &target)).norm();
            prop_assert!(cost(&found.q) <= cost(&from) + 1e-6, "{} from {}", cost(&found.q), cost(&from));
        }
    }

    #[test]
    fn at_a_singular_pose_the_joints_do_not_leap() {
        let (model, limits) = (ArmModel::fr3(), Limits::fr3());
        // Nearly stretched, and then pulled further out, millimetre by millimetre, beyond what the arm has.
        let mut q = places([0.5; 7]);
        (q[1], q[3], q[5]) = (0.6, -0.3, 1.0);
        let start = model.flange(&q).isometry();
        let outward = start.translation.vector.normalize();
        let mut largest = 0.0_f64;
        for k in 1..200 {
            let mut target = start;
            target.translation.vector += outward * (1e-3 * f64::from(k));
            let found = model.nearest(&limits, &q, &target);
            largest = q.iter().zip(&found.q).map(|(a, b)| (a - b).abs()).fold(largest, f64::max);
            q = found.q;
        }
        assert!(largest < 0.3, "{largest} rad for a millimetre");
        let off =
            (model.flange(&q).isometry().translation.vector - (start.translation.vector + outward * 0.199)).norm();
        assert!(off > 0.01, "it was pulled out of reach: {off}");
    }

    #[test]
    fn numbers_that_are_none_give_joints_all_the_same() {
        let (model, limits) = (ArmModel::fr3(), Limits::fr3());
        let target = Isometry3::translation(f64::NAN, 0.0, 0.5);
        let found = model.nearest(&limits, &[f64::NAN; MAX_JOINTS], &target);
        assert!(found.q.iter().all(|q| q.is_finite()), "{found:?}");
    }
}
