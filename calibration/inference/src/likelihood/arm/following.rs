//! What the control law had to work with while an arm followed its command, and what that took of the model: the terms of the equation
//! of motion along the measured motion (equation error; Khalil and Dombre 2002, "Modeling, Identification and Control of Robots",
//! chapter 12). Nothing is simulated, so that none of it depends on a parameter that is searched.

use crate::likelihood::smoothing;
use shared_mem::cell::ControllerKind;
use shared_mem::recording::JointSeries;
use twin::arm::{ArmModel, JointState, Joints, MAX_JOINTS};
use twin::control::CommandTrack;

/// A moment of a clip. `stiffness * behind - damping * dq` is what the law asks for, `load` what of it the model takes; what is left
/// between them is friction and weight that the model lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Measured positions [rad] and velocities [rad/s], smoothed.
    pub state: JointState,
    /// Desired less measured positions [rad].
    pub behind: Joints,
    /// Torque of the model along that motion, less what the law adds to its spring and damper [N m].
    pub load: Joints,
}

/// Moments of a clip at stamps [ns]; `None` where the law is no spring to the command with a damper to the ground, or the clip is too
/// short to be smoothed. A damper that gets the desired velocity imitates no friction.
pub fn moments(
    (model, law): (&ArmModel, ControllerKind),
    (measured, commands): (&JointSeries, &CommandTrack),
    at_ns: &[u64],
) -> Option<Vec<Moment>> {
    let compensates = match law {
        ControllerKind::JointPd => false,
        ControllerKind::CompensatedPd => true,
        _ => return None,
    };
    let (dof, half) = (measured.dof, smoothing::half_width(&measured.stamps_ns)?);
    let logged = (&measured.stamps_ns[..], &measured.q[..], dof);
    let [q, dq, ddq] = smoothing::derivatives(logged, at_ns, half);
    let moment = |(row, now_ns): (usize, &u64)| {
        let of =
            |values: &[f64]| -> Joints { std::array::from_fn(|i| if i < dof { values[row * dof + i] } else { 0.0 }) };
        let (state, ddq) = (JointState { q: of(&q), dq: of(&dq) }, of(&ddq));
        let command = commands.at(*now_ns);
        let q_d = commands.q_d(command);
        let mass = model.mass_matrix(&state.q);
        let bias = if compensates { [0.0; MAX_JOINTS] } else { model.bias(&state) };
        Moment {
            state,
            behind: std::array::from_fn(|i| q_d[i] - state.q[i]),
            load: std::array::from_fn(|i| bias[i] + mass[i].iter().zip(&ddq).map(|(m, a)| m * a).sum::<f64>()),
        }
    };
    Some(at_ns.iter().enumerate().map(moment).collect())
}
