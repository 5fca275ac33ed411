//! One step of the arm in time under constant joint torques, as between two ticks of a zero-order-hold controller.

use super::kernel::{filled, first, with_dof};
use super::{ArmModel, JointState, Joints};

impl ArmModel {
    /// Moves `state` on by `dt` seconds under constant torques: classic fourth-order Runge-Kutta.
    pub fn step(&self, state: &mut JointState, tau: &Joints, dt: f64) {
        with_dof!(self, N => self.runge_kutta::<N>(state, first(tau), dt));
    }

    fn runge_kutta<const N: usize>(&self, state: &mut JointState, tau: &[f64; N], dt: f64) {
        let (q, dq) = (*first::<N, _>(&state.q), *first::<N, _>(&state.dq));
        let along = |from: &[f64; N], rate: &[f64; N], h: f64| {
            let mut out = *from;
            for i in 0..N {
                out[i] += h * rate[i];
            }
            out
        };
        let v1 = dq;
        let a1 = self.solve_for(&q, &v1, tau);
        let v2 = along(&dq, &a1, 0.5 * dt);
        let a2 = self.solve_for(&along(&q, &v1, 0.5 * dt), &v2, tau);
        let v3 = along(&dq, &a2, 0.5 * dt);
        let a3 = self.solve_for(&along(&q, &v2, 0.5 * dt), &v3, tau);
        let v4 = along(&dq, &a3, dt);
        let a4 = self.solve_for(&along(&q, &v3, dt), &v4, tau);
        let (mut q_new, mut dq_new) = (q, dq);
        for i in 0..N {
            q_new[i] += dt / 6.0 * (v1[i] + 2.0 * (v2[i] + v3[i]) + v4[i]);
            dq_new[i] += dt / 6.0 * (a1[i] + 2.0 * (a2[i] + a3[i]) + a4[i]);
        }
        *state = JointState { q: filled(&q_new), dq: filled(&dq_new) };
    }
}
