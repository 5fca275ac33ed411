//! The robot's own Cartesian impedance controller: a spring and a damper between the stiffness frame and where it should
//! be, along and about the frame's axes, and a weak spring that keeps the one free joint motion near the desired one.
//!
//! `tau = J' (K e + D de) + N (k_n (q_d - q) - d_n dq) + coriolis`; gravity is added by the arm. The robot's damping is
//! not published: `D = 2 sqrt(K)`, as libfranka's example of such a controller has it. Base frame, SI.
//!
//! Source: Albu-Schaeffer, Ott, Hirzinger, A Unified Passivity-based Control Framework, IJRR 26 (2007).

use super::kinematics::{Frame, Jacobian, seven, turned};
use nalgebra::{Matrix6, SMatrix, Vector6};
use shared_mem::msg::{MAX_JOINTS, joints_from};
use twin::arm::{JointState, Joints, pose_difference};

/// Stiffness of the free joint motion [N m/rad]; its damping is `2 sqrt` of it. Weak beside any Cartesian stiffness.
const NULLSPACE: f64 = 10.0;
/// Kept from dividing by nothing at a singular pose.
const DAMPING: f64 = 1e-6;

/// Torque without gravity for an arm in `state` that should be as `desired` [N m]. `stiffness` is that of the frame's own
/// axes [N/m, N m/rad].
pub(super) fn torque(frame: &Frame, stiffness: &[f64; 6], state: &JointState, desired: &JointState) -> Joints {
    let jacobian = frame.jacobian(&state.q);
    let (pose, wanted) = (frame.pose(&state.q), frame.pose(&desired.q));
    let error = turned(&pose.rotation.inverse(), &pose_difference(&pose, &wanted));
    let rate = turned(&pose.rotation.inverse(), &(frame.twist(desired) - jacobian * seven(&state.dq)));
    let k = Vector6::from(*stiffness);
    let wrench = k.component_mul(&error) + k.map(|k| 2.0 * k.sqrt()).component_mul(&rate);
    let spring = jacobian.transpose() * turned(&pose.rotation, &wrench);
    let free = (seven(&desired.q) - seven(&state.q)) * NULLSPACE - seven(&state.dq) * (2.0 * NULLSPACE.sqrt());
    let torque = joints_from((spring + nullspace(&jacobian) * free).as_slice());
    let coriolis = frame.model.coriolis(state);
    let mut out = [0.0; MAX_JOINTS];
    for i in 0..frame.model.dof() {
        out[i] = torque[i] + coriolis[i];
    }
    out
}

/// Joint torques that do not move the frame, out of any.
fn nullspace(jacobian: &Jacobian) -> SMatrix<f64, 7, 7> {
    let square: Matrix6<f64> = jacobian * jacobian.transpose() + Matrix6::identity() * DAMPING;
    let inverse = square.cholesky().map_or_else(Matrix6::zeros, |c| c.inverse());
    SMatrix::<f64, 7, 7>::identity() - jacobian.transpose() * inverse * jacobian
}
