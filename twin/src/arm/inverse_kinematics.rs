//! Inverse kinematics by damped least squares on the Jacobian. [`ArmModel::reach`] finds joints that bring a point of the flange
//! to a pose exactly, whatever their limits; [`ArmModel::nearest`] always has an answer, within the limits: its damping grows
//! with what is left (Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE T-RO 27, 2011),
//! so that it never leaps, out of reach and near singular poses too. Both take the smallest motion of the joints there is.
//! Base frame; m, rad. Allocates nothing.

use super::{ArmModel, Joints, Limits, MAX_JOINTS};
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

/// Corrections at most: a target a few millimetres ahead takes three.
const NEAREST_CORRECTIONS: usize = 60;
const REACH_CORRECTIONS: usize = 200;
/// A pose is out of reach if so many corrections do not halve the error.
const HALVING_CORRECTIONS: usize = 20;
/// Largest correction of a joint at once [rad].
const MAX_STEP: f64 = 0.2;
/// Damping of [`ArmModel::nearest`] where nothing is left [m²], and of [`ArmModel::reach`] [m², 1]: invisible in the working space,
/// and no leap near a singular pose.
const NEAREST_DAMPING: f64 = 1e-6;
const REACH_DAMPING: f64 = 1e-8;
/// So many metres count as much as a radian for the nearest pose.
const LEVER: f64 = 0.3;
/// Less than this is no error for the nearest pose [m, and LEVER rad], and a correction of less than this the last [rad].
const NEAREST_TOLERANCE: f64 = 1e-7;
const SMALLEST_STEP: f64 = 1e-9;
/// A pose is reached when position [m] and direction [rad] are this close: a microradian in a millisecond would already be
/// a jerk of 1000 rad/s³.
const REACHED: f64 = 1e-10;

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

/// What leads from one pose to another: a shift [m], then a rotation vector about the base axes [rad].
pub fn pose_difference(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

impl ArmModel {
    /// Joints near `from` and within [`super::JointLimits::targets`] that bring the flange to `target`, or as near to it as
    /// corrections from there lead.
    pub fn nearest(&self, limits: &Limits, from: &Joints, target: &Isometry3<f64>) -> Nearest {
        let mut q = within(limits, from);
        for _ in 0..NEAREST_CORRECTIONS {
            let flange = self.flange(&q).isometry();
            let error = weighted(&pose_difference(&flange, target));
            if error.norm_squared() < NEAREST_TOLERANCE * NEAREST_TOLERANCE {
                break;
            }
            let columns = self.jacobian(&q, flange.translation.vector.into());
            let step = within_limits(limits, &q, &columns.map(|column| weighted(&Vector6::from(column))), &error);
            if largest(&step) <= SMALLEST_STEP {
                break;
            }
            q = within(limits, &moved(&q, &step));
        }
        let error = pose_difference(&self.flange(&q).isometry(), target);
        let [off, turned] = [0, 3].map(|at| error.fixed_rows::<3>(at).norm());
        Nearest { q, off, turned }
    }

    /// Joints that bring a point of the flange and the axes there, `flange_from_point`, to `target`: the nearest ones to `from`,
    /// whatever their limits; `None` out of reach. `given`: a joint whose position is decided, and that position [rad].
    pub fn reach(
        &self,
        from: &Joints,
        flange_from_point: &Isometry3<f64>,
        target: &Isometry3<f64>,
        given: Option<(usize, f64)>,
    ) -> Option<Joints> {
        let mut q = *from;
        if let Some((joint, position)) = given {
            q[joint] = position;
        }
        let mut before = f64::INFINITY;
        for correction in 0..REACH_CORRECTIONS {
            let at = self.flange(&q).isometry() * flange_from_point;
            let error = pose_difference(&at, target);
            // Nothing reaches what is not a number, which `amax` passes over.
            if error.iter().any(|error| !error.is_finite()) {
                return None;
            }
            let size = error.amax();
            if size < REACHED {
                return Some(q);
            }
            if correction % HALVING_CORRECTIONS == 0 {
                if size > 0.5 * before {
                    return None;
                }
                before = size;
            }
            let mut columns = self.jacobian(&q, at.translation.vector.into()).map(Vector6::from);
            if let Some((joint, _)) = given {
                columns[joint] = Vector6::zeros();
            }
            q = moved(&q, &damped_step(&columns, &error, REACH_DAMPING));
        }
        None
    }

    /// Smallest motion of the joints that moves a point of the last link at `point` by `motion`: x, y, z, then a rotation
    /// vector, or the velocities of both.
    pub fn joints_for(&self, q: &Joints, point: Point3<f64>, motion: &Vector6<f64>) -> Joints {
        damped_step(&self.jacobian(q, point.coords.into()).map(Vector6::from), motion, REACH_DAMPING)
    }
}

/// The motion of the joints that brings about `motion` as nearly as `damping` allows; zeros where that is not a number.
fn damped_step(columns: &[Vector6<f64>; MAX_JOINTS], motion: &Vector6<f64>, damping: f64) -> Joints {
    let square = columns.iter().fold(Matrix6::identity() * damping, |sum, column| sum + column * column.transpose());
    let weights = square.cholesky().map(|square| square.solve(motion));
    let weights = weights.filter(|weights| weights.iter().all(|weight| weight.is_finite()));
    columns.map(|column| weights.as_ref().map_or(0.0, |weights| column.dot(weights)))
}

fn largest(step: &Joints) -> f64 {
    step.iter().fold(0.0, |largest: f64, step| largest.max(step.abs()))
}

/// The joints after a step, no joint by more than [`MAX_STEP`].
fn moved(q: &Joints, step: &Joints) -> Joints {
    let share = (MAX_STEP / largest(step)).min(1.0);
    std::array::from_fn(|i| q[i] + share * step[i])
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
fn within_limits(limits: &Limits, q: &Joints, columns: &[Vector6<f64>; MAX_JOINTS], error: &Vector6<f64>) -> Joints {
    let damping = NEAREST_DAMPING + 0.5 * error.norm_squared();
    let mut free: [Vector6<f64>; MAX_JOINTS] =
        std::array::from_fn(|i| if i < limits.dof { columns[i] } else { Vector6::zeros() });
    let mut step = [0.0; MAX_JOINTS];
    for _ in 0..=limits.dof {
        step = damped_step(&free, error, damping);
        // A joint that is held has no column, so no step either.
        let pushed = limits.counted().enumerate().position(|(i, joint)| {
            let [low, high] = joint.targets();
            q[i] <= low && step[i] < 0.0 || q[i] >= high && step[i] > 0.0
        });
        let Some(pushed) = pushed else { break };
        free[pushed] = Vector6::zeros();
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
            let cost = |q: &Joints| weighted(&pose_difference(&model.flange(q).isometry(), &target)).norm();
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

    #[test]
    fn a_pose_is_reached_with_a_joint_where_it_is_given() {
        let model = ArmModel::fr3();
        let from = *model.ready();
        let mut there = from;
        (there[0], there[2], there[5]) = (there[0] + 0.1, 0.05, there[5] - 0.1);
        let target = model.flange(&there).isometry() * Isometry3::translation(0.0, 0.0, 0.1);
        let tip = Isometry3::translation(0.0, 0.0, 0.1);
        let found = model.reach(&from, &tip, &target, Some((2, 0.05))).expect("within reach");
        assert!(found.iter().zip(&there).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {there:?}");
        let far = Isometry3::translation(3.0, 0.0, 0.0);
        assert_eq!(model.reach(&from, &tip, &far, None), None);
        assert_eq!(model.reach(&from, &tip, &Isometry3::translation(f64::NAN, 0.0, 0.5), None), None);
    }
}
