//! Stiffness out of logged torques, where cell.toml knows it by a wide range alone.
//!
//! A control law ties the torque to what a joint is off, whatever the arm carries. So along the measured motion, for each joint,
//! least squares over all clips of
//!
//! ```text
//! q_d - q = (tau - compensation) / k - d / k (dq_d - dq) + a dq + b sign(dq) [+ c]
//! ```
//!
//! where `tau` is the motor's torque and `compensation` what the law adds of the nominal model; `a` takes delays of the command and
//! viscous friction, `b` dry friction, and `c`, in a second fit, a wrong zero of the sensors. A fit of the motion alone begins
//! without knowing what acts, and makes joints stiff against a load that the twin lacks.
//! What is fitted afterwards is searched around what these fits say with and without `c`, and without each clip in turn.

use crate::likelihood::setting::complete;
use crate::likelihood::smoothing::{derivatives, half_width};
use nalgebra::{DMatrix, DVector};
use shared_mem::cell::{Cell, ControllerKind, Ranges, Robot, TorqueSensing};
use shared_mem::recording::Clip;
use twin::arm::{ArmModel, JointState, Joints, stiffness_range};

/// Rows that count are so far apart [ns]: smoothed over 80 ms to either side, those between say the same.
const ROWS_APART_NS: u64 = 10_000_000;
/// Speed at which dry friction is full [rad/s] (a choice).
const DRY_FRICTION_FULL_AT: f64 = 0.02;
/// Fits that differ by more than this factor do not identify the stiffness (a choice).
const LARGEST_SPREAD: f64 = 4.0;
/// The search goes this factor beyond what the fits say (a choice): torques are of a nominal model.
const SEARCHED_BEYOND: f64 = 2.0;
/// Fewer clips cannot be left out in turn.
const FEWEST_CLIPS: usize = 3;
/// Columns of a fit: torque, error of velocity, velocity, its sign, one.
const COLUMNS: usize = 5;

/// One clip's part of the normal equations of every joint: `X'X` and `X'y`.
type Sums = Vec<(DMatrix<f64>, DVector<f64>)>;

/// The cell with the stiffness that its clips' torques say, joint by joint, as nominal values and ranges, and a sentence about it;
/// `None` where cell.toml states the stiffness, clips hold no torques, or those of no joint tell.
pub(super) fn found(cell: &Cell, clips: &[Clip]) -> Option<(Cell, String)> {
    let controller = cell.controller.as_ref()?;
    let ranged = controller.stiffness_range.is_some() || controller.stiffness.is_empty();
    let led = !matches!(controller.kind, ControllerKind::Tracking | ControllerKind::Unstated);
    if !ranged || !led || cell.robot.as_ref().is_none_or(Robot::joints_only) {
        return None;
    }
    let arm = ArmModel::from_cell(cell).ok()?;
    let sums: Vec<Sums> = clips.iter().filter_map(|clip| of_clip(cell, &arm, clip)).collect();
    if sums.len() < FEWEST_CLIPS {
        return None;
    }
    let begun = complete(cell, None).ok()?.arm?.stiffness;
    let fitted: Vec<Option<[f64; 3]>> = (0..arm.dof()).map(|joint| stiffness(&sums, joint)).collect();
    let mut words = Vec::new();
    let (mut nominal, mut ranges) = (Vec::new(), Vec::new());
    for (joint, begun) in begun.iter().enumerate() {
        let stated = stiffness_range(controller, &arm, joint)?;
        let narrowed = fitted[joint].and_then(|[least, middle, most]| {
            let range = [stated[0].max(least / SEARCHED_BEYOND), stated[1].min(most * SEARCHED_BEYOND)];
            (range[0] < range[1]).then(|| (middle.clamp(range[0], range[1]), range))
        });
        if let Some((middle, range)) = narrowed {
            words.push(format!("joint {} {middle:.0} ({:.0} to {:.0})", joint + 1, range[0], range[1]));
        }
        let (middle, range) = narrowed.unwrap_or((*begun, stated));
        nominal.push(middle);
        ranges.push(range);
    }
    if words.is_empty() {
        return None;
    }
    let mut cell = cell.clone();
    let controller = cell.controller.as_mut()?;
    (controller.stiffness, controller.stiffness_range) = (nominal, Some(Ranges::Each(ranges)));
    let sentence = format!(
        "the logged torques over what the joints are off say the stiffness [N m/rad], which is searched around that: {}",
        words.join(", ")
    );
    Some((cell, sentence))
}

/// Normal equations of a clip; `None` where it lacks commands or torques, or is too short to be smoothed.
fn of_clip(cell: &Cell, arm: &ArmModel, clip: &Clip) -> Option<Sums> {
    let controller = cell.controller.as_ref()?;
    let (measured, desired, dof) = (&clip.measured, &clip.desired, arm.dof());
    if measured.tau.is_empty() || measured.dof != dof || desired.dof != dof {
        return None;
    }
    // One width for both, so that commands and measurements are smoothed alike.
    let half = half_width(&measured.stamps_ns)?.max(half_width(&desired.stamps_ns)?);
    let from = (*measured.stamps_ns.first()?).max(*desired.stamps_ns.first()?) + half;
    let to = (*measured.stamps_ns.last()?).min(*desired.stamps_ns.last()?).checked_sub(half)?;
    let at: Vec<u64> = (from..=to).step_by(ROWS_APART_NS as usize).collect();
    let [q, dq, ddq] = derivatives((&measured.stamps_ns, &measured.q, dof), &at, half);
    let [tau, ..] = derivatives((&measured.stamps_ns, &measured.tau, dof), &at, half);
    let [q_d, dq_d, ddq_d] = derivatives((&desired.stamps_ns, &desired.q, dof), &at, half);
    let rotor = match controller.torque_sensing {
        TorqueSensing::Joint => arm.rotor_inertia(),
        TorqueSensing::Motor => Joints::default(),
    };
    let mut sums: Sums = vec![(DMatrix::zeros(COLUMNS, COLUMNS), DVector::zeros(COLUMNS)); dof];
    for row in 0..at.len() {
        let of = |values: &[f64]| -> Joints {
            std::array::from_fn(|joint| if joint < dof { values[row * dof + joint] } else { 0.0 })
        };
        let state = JointState { q: of(&q), dq: of(&dq) };
        let added = compensation(controller.kind, arm, &state, &of(&ddq_d));
        for (joint, (normal, right)) in sums.iter_mut().enumerate() {
            let k = row * dof + joint;
            // Behind the gears nothing is felt of the torque that turns the rotor itself.
            let torque = tau[k] + rotor[joint] * ddq[k] - added[joint];
            let x = DVector::from_vec(vec![torque, dq_d[k] - dq[k], dq[k], (dq[k] / DRY_FRICTION_FULL_AT).tanh(), 1.0]);
            *right += (q_d[k] - q[k]) * &x;
            *normal += &x * x.transpose();
        }
    }
    (!at.is_empty()).then_some(sums)
}

/// What a law adds of the nominal model [N m].
fn compensation(kind: ControllerKind, arm: &ArmModel, state: &JointState, ddq_d: &Joints) -> Joints {
    match kind {
        ControllerKind::JointPd => Joints::default(),
        ControllerKind::InverseDynamics => {
            let (bias, mass) = (arm.bias(state), arm.mass_matrix(&state.q));
            std::array::from_fn(|i| bias[i] + mass[i].iter().zip(ddq_d).map(|(m, a)| m * a).sum::<f64>())
        }
        _ => arm.bias(state),
    }
}

/// Least, middle and largest stiffness of a joint [N m/rad] over the fits with and without a wrong zero, and without each clip;
/// `None` where a fit has none, or they are too far apart.
fn stiffness(sums: &[Sums], joint: usize) -> Option<[f64; 3]> {
    let mut all = Vec::new();
    // Without the last column, which takes a wrong zero, and with it.
    for columns in [COLUMNS - 1, COLUMNS] {
        let left_out = std::iter::once(None).chain((0..sums.len()).map(Some));
        for left_out in left_out {
            let kept = sums.iter().enumerate().filter(|(clip, _)| Some(*clip) != left_out);
            let mut normal = DMatrix::zeros(columns, columns);
            let mut right = DVector::zeros(columns);
            for (_, clip) in kept {
                normal += clip[joint].0.view((0, 0), (columns, columns));
                right += clip[joint].1.rows(0, columns);
            }
            // What gives way against the torque is no spring: then something else acts, and no fit of this joint counts.
            all.push(compliance(normal, right).filter(|compliance| *compliance > 0.0)?.recip());
        }
    }
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    let most = all.iter().copied().fold(0.0, f64::max);
    // Known by its order of magnitude: the mean of logarithms.
    let middle = (all.iter().map(|k| k.ln()).sum::<f64>() / all.len() as f64).exp();
    (most < LARGEST_SPREAD * least).then_some([least, middle, most])
}

/// The first coefficient, columns that never change being left out.
fn compliance(mut normal: DMatrix<f64>, mut right: DVector<f64>) -> Option<f64> {
    let scales: Vec<f64> = (0..right.len()).map(|k| normal[(k, k)].sqrt()).collect();
    // Columns have units of their own: scaled, so that one bound of eigenvalues serves all of them.
    for (i, scale) in scales.iter().enumerate() {
        if *scale > 0.0 {
            right[i] /= scale;
            for j in 0..scales.len() {
                normal[(i, j)] /= scale;
                normal[(j, i)] /= scale;
            }
        }
    }
    // The search for eigenvalues of what is not finite has no end.
    if !normal.iter().all(|value| value.is_finite()) {
        return None;
    }
    let solved = normal.symmetric_eigen();
    let least = 1e-9 * solved.eigenvalues.max();
    let along = solved.eigenvectors.transpose() * right;
    let along = DVector::from_fn(along.len(), |k, _| {
        let value = solved.eigenvalues[k];
        if value > least { along[k] / value } else { 0.0 }
    });
    let answer = (solved.eigenvectors * along)[0] / scales[0];
    (scales[0] > 0.0 && answer.is_finite()).then_some(answer)
}
