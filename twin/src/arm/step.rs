//! The arm's step in time under joint torques that a zero-order-hold controller keeps constant.
//!
//! Explicit midpoint rule: second order, two evaluations of the equations of motion. At 1 ms it stays within 1e-6 rad
//! of a converged solution on the FR3's excitation motions (a quarter of the encoder noise); the semi-implicit Euler rule that
//! simulators use needs 1/16 ms for 5e-5 rad. Called by [`crate::rollout`], the simulated cell and the shadow.

use super::control::ControlLaw;
use super::dynamics::Response;
use super::kernel::{filled, first, with_dof};
use super::{ArmModel, JointState, Joints, Yielding};

impl ArmModel {
    /// Moves `state` on by `dt` seconds under constant torques [N m].
    ///
    /// An arm whose torques hold its weight stays where it is; without them it falls:
    ///
    /// ```
    /// use twin::arm::{ArmModel, JointState, MAX_JOINTS};
    ///
    /// let arm = ArmModel::fr3();
    /// let (mut held, mut falling) = (JointState::at_rest(*arm.ready()), JointState::at_rest(*arm.ready()));
    /// for _ in 0..100 {
    ///     let tau = arm.gravity(&held.q);
    ///     arm.step(&mut held, &tau, 1e-3); // s
    ///     arm.step(&mut falling, &[0.0; MAX_JOINTS], 1e-3);
    /// }
    /// assert!((held.q[1] - arm.ready()[1]).abs() < 1e-9);
    /// assert!(falling.dq[1].abs() > 0.1); // rad/s
    /// ```
    pub fn step(&self, state: &mut JointState, tau: &Joints, dt: f64) {
        with_dof!(self, N => {
            let tau = *first::<N, _>(tau);
            self.midpoint::<N, _>(state, dt, |_| tau, |_| ());
        });
    }

    /// Evaluates the controller at `state`, moves `state` on by `dt` seconds under the torque it asks for, and returns
    /// that torque and the gravity it contains [N m].
    ///
    /// The model inside the controller is this arm itself, so its compensation costs nothing extra. Where the two
    /// differ, use [`ControlLaw::torque`] and [`ArmModel::step`].
    pub fn controlled_step(
        &self,
        state: &mut JointState,
        law: &ControlLaw,
        q_d: &Joints,
        dq_d: &Joints,
        dt: f64,
    ) -> (Joints, Joints) {
        let before = *state;
        with_dof!(self, N => {
            let torque = |bias: &[f64; N]| *first(&law.torque_with(&before, q_d, dq_d, &filled(bias)));
            self.midpoint::<N, _>(state, dt, torque, |start| (filled(&start.tau), filled(&start.gravity)))
        })
    }

    /// [`ArmModel::controlled_step`], and how the arm yields at the state in which it begins.
    pub(crate) fn yielding_step(
        &self,
        state: &mut JointState,
        law: &ControlLaw,
        (q_d, dq_d): (&Joints, &Joints),
        dt: f64,
    ) -> (Joints, Joints, Yielding) {
        let before = *state;
        with_dof!(self, N => {
            let torque = |bias: &[f64; N]| *first(&law.torque_with(&before, q_d, dq_d, &filled(bias)));
            self.midpoint::<N, _>(state, dt, torque, |start| {
                (filled(&start.tau), filled(&start.gravity), self.yielding_of(&start.chain, &start.mass))
            })
        })
    }

    /// One step under the torque that `torque` answers for the bias at the start; what `look` sees there.
    #[inline(always)]
    fn midpoint<const N: usize, T>(
        &self,
        state: &mut JointState,
        dt: f64,
        torque: impl FnOnce(&[f64; N]) -> [f64; N],
        look: impl FnOnce(&Response<N>) -> T,
    ) -> T {
        let (q, dq) = (*first::<N, _>(&state.q), *first::<N, _>(&state.dq));
        let start = self.respond(&q, &dq, torque);
        let (mut turn, mut dq_mid) = ([0.0; N], dq);
        for i in 0..N {
            turn[i] = 0.5 * dt * dq[i];
            dq_mid[i] += 0.5 * dt * start.acceleration[i];
        }
        let middle = self.respond_later(&start, (&q, &turn), &dq_mid);
        for i in 0..N {
            state.q[i] += dt * dq_mid[i];
            state.dq[i] += dt * middle[i];
        }
        look(&start)
    }
}
