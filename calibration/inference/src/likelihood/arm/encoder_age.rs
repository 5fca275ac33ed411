//! How old encoder readings are when controller and log get them: some microseconds that nobody states, and that a
//! simulator with another time step has too. A heavily damped wrist follows its command within 2 ms, so that 10 us are
//! 0.5 % of its gains: it is a nuisance parameter of each clip, or the gains look surer than they are.

use crate::estimate::Random;
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::recording::JointSeries;
use shared_mem::theta::Theta;
use twin::control::{CommandTrack, Reading};

/// One sigma of what is known beforehand [s]: a twentieth of a control period.
const AGE_SIGMA: f64 = 5e-5;
/// Joints that come later than this come late for other reasons [s].
const MAX_AGE: f64 = 1e-4;

/// The nuisance parameter.
pub(super) fn random() -> Random {
    Random { name: "encoder age".into(), sigma: AGE_SIGMA, step: 1e-6 }
}

/// The age that a nuisance parameter stands for [s].
pub(super) fn of(own: Option<&f64>) -> f64 {
    own.map_or(0.0, |own| MAX_AGE * (own / MAX_AGE).tanh())
}

/// Gains and commands under which fresh readings give the torque that old ones give under `theta` and `desired`:
/// `k (q_d - q + age dq) + d (dq_d - dq)` is `k (q_d - q) + e (dq_d d / e - dq)` with `e = d - k age`. `None` where nothing changes.
pub(super) fn controlled(cell: &Cell, desired: &JointSeries, theta: &Theta, age: f64) -> Option<(Theta, CommandTrack)> {
    let kind = cell.controller.as_ref().map(|controller| controller.kind);
    let follows = matches!(kind, Some(ControllerKind::JointImpedance | ControllerKind::JointVelocity));
    if age == 0.0 || !follows || desired.dq.is_empty() {
        return None;
    }
    let (mut theta, mut desired) = (theta.clone(), desired.clone());
    let gains = theta.arm.as_mut()?;
    for (joint, (damping, stiffness)) in gains.damping.iter_mut().zip(&gains.stiffness).enumerate() {
        let seen = *damping - stiffness * age;
        if seen > 0.0 {
            let share = *damping / seen;
            desired.dq.iter_mut().skip(joint).step_by(desired.dof).for_each(|dq| *dq *= share);
            *damping = seen;
        }
    }
    Some((theta, CommandTrack::of_cell(&desired, cell)?))
}

/// What is read `age` later than it was.
pub(super) fn shift(age: f64, readings: &mut [Reading]) {
    if age != 0.0 {
        for state in readings.iter_mut().map(|reading| &mut reading.state) {
            state.q.iter_mut().zip(&state.dq).for_each(|(q, dq)| *q -= age * dq);
        }
    }
}
