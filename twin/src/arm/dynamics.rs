//! `M(q) ddq + coriolis(q, dq) + gravity(q) = tau + J' f`: the parts of the equation and its solution.
//! Called by the controllers (nominal model), the simulation (the arm itself) and the bridge.

use super::kernel::{Angles, Chain, factor, filled, first, solve, with_dof};
use super::spatial::{Spatial, cross};
use super::{ArmModel, JointState, Joints, MAX_JOINTS};

/// A force on a point of the last link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointForce {
    /// Where it acts, in the base frame [m].
    pub point: [f64; 3],
    /// The force on the arm, in the base frame [N].
    pub force: [f64; 3],
}

/// An arm under a torque.
pub(super) struct Response<const N: usize> {
    pub(super) chain: Chain<N>,
    pub(super) angles: Angles<N>,
    /// The mass matrix as [`factor`] leaves it.
    pub(super) mass: [[f64; N]; N],
    pub(super) acceleration: [f64; N],
    pub(super) tau: [f64; N],
    /// What of the torque holds the arm against gravity.
    pub(super) gravity: [f64; N],
}

impl ArmModel {
    /// Torques that hold the arm still against gravity [N m].
    pub fn gravity(&self, q: &Joints) -> Joints {
        self.holding(q, self.gravity)
    }

    /// Torques that hold the arm still against a free fall that is given in the base frame [m/s²] [N m].
    pub fn holding(&self, q: &Joints, falls: [f64; 3]) -> Joints {
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let chain = Chain::at(links, first(q));
            filled(&chain.gravity(&chain.bodies(links), falls))
        })
    }

    /// Free fall in the base frame [m/s²].
    pub fn free_fall(&self) -> [f64; 3] {
        self.gravity
    }

    /// Torques of centrifugal and Coriolis forces [N m].
    pub fn coriolis(&self, state: &JointState) -> Joints {
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let chain = Chain::at(links, first(&state.q));
            filled(&chain.bias(&chain.bodies(links), first(&state.dq), [0.0; 3]))
        })
    }

    /// `coriolis + gravity`, at the price of one of them [N m].
    pub fn bias(&self, state: &JointState) -> Joints {
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let chain = Chain::at(links, first(&state.q));
            filled(&chain.bias(&chain.bodies(links), first(&state.dq), self.gravity))
        })
    }

    /// Mass matrix with rotor inertia on its diagonal [kg m²], `[row][column]`; 0 from `dof` on.
    ///
    /// ```
    /// use twin::arm::{ArmModel, JointState};
    ///
    /// let arm = ArmModel::fr3();
    /// let mass = arm.mass_matrix(arm.ready()); // kg m²
    /// assert!((mass[1][3] - mass[3][1]).abs() < 1e-12, "it is symmetric");
    ///
    /// // tau = M ddq + bias, from rest.
    /// let state = JointState::at_rest(*arm.ready());
    /// let mut tau = arm.bias(&state);
    /// (0..7).for_each(|joint| tau[joint] += mass[joint][3]);
    /// assert!((arm.accelerations(&state, &tau)[3] - 1.0).abs() < 1e-9); // rad/s²
    /// ```
    pub fn mass_matrix(&self, q: &Joints) -> [Joints; MAX_JOINTS] {
        let mut out = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let chain = Chain::at(links, first(q));
            let lower = chain.mass_matrix(&chain.bodies(links), links);
            for i in 0..N {
                for j in 0..=i {
                    out[i][j] = lower[i][j];
                    out[j][i] = lower[i][j];
                }
            }
        });
        out
    }

    /// Joint accelerations under joint torques [rad/s²].
    pub fn accelerations(&self, state: &JointState, tau: &Joints) -> Joints {
        with_dof!(self, N => filled(&self.respond::<N>(first(&state.q), first(&state.dq), |_| *first(tau)).acceleration))
    }

    /// Joint torques that a force on the last link amounts to [N m]: add them to the motors' torques.
    pub fn torque_of(&self, q: &Joints, load: &PointForce) -> Joints {
        let wrench = Spatial { angular: cross(load.point, load.force), linear: load.force };
        let mut out = [0.0; MAX_JOINTS];
        for (o, axis) in out.iter_mut().zip(self.axes(q)).take(self.dof) {
            *o = axis.dot(wrench);
        }
        out
    }

    /// Kinetic energy, rotors included, plus potential energy (0 with all mass in the base's origin plane) [J].
    pub fn energy(&self, state: &JointState) -> f64 {
        let mass = self.mass_matrix(&state.q);
        let mut kinetic = 0.0;
        for (row, dq) in mass.iter().zip(state.dq) {
            kinetic += 0.5 * dq * row.iter().zip(state.dq).map(|(m, dq)| m * dq).sum::<f64>();
        }
        kinetic + self.potential_energy(&state.q)
    }

    fn potential_energy(&self, q: &Joints) -> f64 {
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let bodies = Chain::at(links, first(q)).bodies(links);
            -bodies.iter().map(|body| super::spatial::dot(body.moment, self.gravity)).sum::<f64>()
        })
    }

    /// What happens under the torque that `torque` answers for the bias of this state.
    #[inline(always)]
    pub(super) fn respond<const N: usize>(
        &self,
        q: &[f64; N],
        dq: &[f64; N],
        torque: impl FnOnce(&[f64; N]) -> [f64; N],
    ) -> Response<N> {
        let links = first::<N, _>(&self.links);
        let angles = Angles::of(q);
        let chain = Chain::turned(links, q, &angles);
        let bodies = chain.bodies(links);
        let bias = chain.bias(&bodies, dq, self.gravity);
        let mut mass = chain.mass_matrix(&bodies, links);
        factor(&mut mass);
        let tau = torque(&bias);
        let mut free = tau;
        for i in 0..N {
            free[i] -= bias[i];
        }
        let gravity = chain.gravity(&bodies, self.gravity);
        Response { acceleration: solve(&mass, &free), chain, angles, mass, tau, gravity }
    }

    /// Acceleration under the same torque a little later, `turn` away from `q` and at velocities `dq`.
    ///
    /// Newton-Euler tells exactly by what torque the acceleration of before is off; what that torque accelerates is
    /// given by the mass matrix of before, which is off by the turn. Over half a millisecond each is about a thousandth, so
    /// a millionth of the acceleration is what a mass matrix of its own would change.
    #[inline(always)]
    pub(super) fn respond_later<const N: usize>(
        &self,
        before: &Response<N>,
        (q, turn): (&[f64; N], &[f64; N]),
        dq: &[f64; N],
    ) -> [f64; N] {
        let links = first::<N, _>(&self.links);
        let later = std::array::from_fn(|i| q[i] + turn[i]);
        let chain = Chain::turned(links, &later, &before.angles.turned(q, turn));
        let needed = chain.torques(&chain.bodies(links), dq, &before.acceleration, self.gravity);
        let mut missing = before.tau;
        for i in 0..N {
            missing[i] -= needed[i] + links[i].rotor * before.acceleration[i];
        }
        let more = solve(&before.mass, &missing);
        std::array::from_fn(|i| before.acceleration[i] + more[i])
    }

    /// The first joint whose inertia, with all joints behind it free to move, is nothing.
    pub(super) fn first_massless_joint(&self, state: &JointState) -> Option<usize> {
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let chain = Chain::at(links, first(&state.q));
            let mut mass = chain.mass_matrix(&chain.bodies(links), links);
            factor(&mut mass);
            // The factor's diagonal is the inverse: tiny, negative or NaN inertia all fail this.
            (0..N).find(|&i| !(mass[i][i] > 0.0 && mass[i][i] < 1e12))
        })
    }
}
