//! How an arm follows commanded positions under springs and dampers on its joints, which feed no acceleration forward:
//! `M(q) ddq = k (q_d - q) + d (f dq_d - dq)`, gravity and Coriolis torques compensated; `f` is 1 where the law damps the
//! difference of velocities, 0 where it damps the joint's own. The arm trails while it is sped up and runs ahead while it is
//! braked, by about `M ddq / k`.
//!
//! Integrated by the mean acceleration of each step (Newmark, A Method of Computation for Structural Dynamics, 1959), in which
//! stiff joints stay steady at any length; the mass matrix is that of a pose nearby. Allocates nothing once it is made.

use super::kernel::{factor, solve};
use super::{ArmModel, ControlLaw, JointState, Joints, MAX_JOINTS};
use shared_mem::cell::ControllerKind;

/// The mass matrix is computed anew when all joints together have turned by so much [rad]. Half of it, half the step's mean,
/// changes the largest entries by about a per cent.
const NEARBY: f64 = 0.06;

/// An arm and what draws it after its commands.
#[derive(Debug, Clone)]
pub struct Trailing {
    model: ArmModel,
    /// k [N m/rad].
    stiffness: Joints,
    /// d [N m s/rad].
    damping: Joints,
    follow: f64,
}

/// The arm on its way.
#[derive(Debug, Clone, Copy)]
pub struct Trail {
    /// Positions and velocities of the joints.
    pub state: JointState,
    acceleration: Joints,
    mass: [Joints; MAX_JOINTS],
    /// Where the mass matrix was computed.
    mass_at: Joints,
    /// Factors of `M + h/2 d + h²/4 k`, and the length h for which they are; 0: for none.
    factors: [Joints; MAX_JOINTS],
    length: f64,
}

impl Trailing {
    /// `model` under `law`, as a robot's own controller runs it. `None` where the law is none of a spring and a damper on
    /// each joint, or feeds the acceleration forward.
    pub fn new(model: &ArmModel, law: &ControlLaw) -> Option<Self> {
        let follow = match law.kind {
            ControllerKind::JointImpedance | ControllerKind::JointVelocity | ControllerKind::Unstated => 1.0,
            ControllerKind::CompensatedPd | ControllerKind::JointPd => 0.0,
            ControllerKind::InverseDynamics | ControllerKind::Tracking => return None,
        };
        Self::with_gains(model, &law.stiffness, &law.damping, follow)
    }

    /// The same with the gains of a law that damps the difference of velocities. `None` where a joint has no spring.
    pub fn impedance(model: &ArmModel, stiffness: &Joints, damping: &Joints) -> Option<Self> {
        Self::with_gains(model, stiffness, damping, 1.0)
    }

    fn with_gains(model: &ArmModel, stiffness: &Joints, damping: &Joints, follow: f64) -> Option<Self> {
        let drawn = stiffness.iter().take(model.dof()).all(|k| *k > 0.0);
        drawn.then(|| Self { model: model.clone(), stiffness: *stiffness, damping: *damping, follow })
    }

    /// From `state` on, commanded `command` (positions and velocities).
    pub fn from(&self, state: &JointState, command: &JointState) -> Trail {
        let mass = self.mass(&state.q);
        let mut factors = mass;
        factor(&mut factors);
        let pull = self.each(|i| {
            self.stiffness[i] * (command.q[i] - state.q[i])
                + self.damping[i] * (self.follow * command.dq[i] - state.dq[i])
        });
        Trail {
            state: *state,
            acceleration: solve(&factors, &pull),
            mass,
            mass_at: state.q,
            factors: [[0.0; MAX_JOINTS]; MAX_JOINTS],
            length: 0.0,
        }
    }

    /// `length` seconds on, at whose end the arm is commanded `command`.
    pub fn step(&self, trail: &mut Trail, command: &JointState, length: f64) {
        let turned: f64 = trail.state.q.iter().zip(&trail.mass_at).map(|(q, at)| (q - at).abs()).sum();
        if turned > NEARBY {
            (trail.mass, trail.mass_at, trail.length) = (self.mass(&trail.state.q), trail.state.q, 0.0);
        }
        if trail.length != length {
            (trail.factors, trail.length) = (trail.mass, length);
            for i in 0..self.model.dof() {
                trail.factors[i][i] += 0.5 * length * (self.damping[i] + 0.5 * length * self.stiffness[i]);
            }
            factor(&mut trail.factors);
        }
        let JointState { q, dq } = trail.state;
        let half = 0.5 * length;
        let (mut way, mut speed) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for i in 0..MAX_JOINTS {
            speed[i] = dq[i] + half * trail.acceleration[i];
            way[i] = length * dq[i] + half * half * trail.acceleration[i];
        }
        let pull = self.each(|i| {
            self.stiffness[i] * (command.q[i] - q[i] - way[i])
                + self.damping[i] * (self.follow * command.dq[i] - speed[i])
        });
        trail.acceleration = solve(&trail.factors, &pull);
        for i in 0..MAX_JOINTS {
            trail.state.q[i] = q[i] + way[i] + half * half * trail.acceleration[i];
            trail.state.dq[i] = speed[i] + half * trail.acceleration[i];
        }
    }

    /// How far each joint may get from its command at most, however damped, while the commanded velocities change by no more
    /// than `change` in all [rad/s]; [rad], infinite where the law damps the joint's own velocity.
    ///
    /// The energy `E` of the gap `e` and its rate, `e' k e + de' M de`, is fed by the commanded acceleration alone:
    /// `d sqrt(E) <= |ddq_d|_M dt`, which sums up to `sqrt(M_ii) change_i` a joint; and `k_i e_i² <= E`.
    pub fn swing(&self, trail: &Trail, command: &JointState, change: &Joints) -> Joints {
        if self.follow == 0.0 {
            return self.each(|_| f64::INFINITY);
        }
        let gap: Joints = self.each(|i| command.q[i] - trail.state.q[i]);
        let rate: Joints = self.each(|i| command.dq[i] - trail.state.dq[i]);
        let (mut energy, mut fed) = (0.0, 0.0);
        for i in 0..self.model.dof() {
            let momentum: f64 = trail.mass[i].iter().zip(&rate).map(|(m, rate)| m * rate).sum();
            energy += self.stiffness[i] * gap[i] * gap[i] + rate[i] * momentum;
            fed += trail.mass[i][i].sqrt() * change[i];
        }
        let root = energy.sqrt() + fed;
        self.each(|i| root / self.stiffness[i].sqrt())
    }

    /// The mass matrix, with ones on the diagonal for joints that are not there.
    fn mass(&self, q: &Joints) -> [Joints; MAX_JOINTS] {
        let mut mass = self.model.mass_matrix(q);
        for (i, row) in mass.iter_mut().enumerate().skip(self.model.dof()) {
            row[i] = 1.0;
        }
        mass
    }

    /// A number for each joint that is there, 0 for the others.
    fn each(&self, of: impl Fn(usize) -> f64) -> Joints {
        std::array::from_fn(|i| if i < self.model.dof() { of(i) } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shared_mem::cell::Cell;

    fn shipped() -> (ArmModel, ControlLaw) {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = Cell::parse(text, "cell.toml".as_ref()).expect("the shipped cell");
        let model = ArmModel::from_cell(&cell).expect("an FR3");
        let law = ControlLaw::new(cell.controller.as_ref(), None, &model).expect("gains");
        (model, law)
    }

    /// A stop from `v` by a constant deceleration of 10 rad/s², `t` seconds after it began.
    fn stopping(from: &Joints, v: &Joints, t: f64) -> JointState {
        let mut command = JointState::at_rest(*from);
        for (i, v) in v.iter().enumerate() {
            let braked = t.min(v.abs() / 10.0);
            command.q[i] += v.signum() * (v.abs() * braked - 5.0 * braked * braked);
            command.dq[i] = v.signum() * (v.abs() - 10.0 * braked);
        }
        command
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// Against the arm's own equations of motion at 1 kHz, under a torque that holds for a millisecond.
        #[test]
        fn steps_of_ten_milliseconds_tell_where_a_braked_arm_gets(
            q in prop::array::uniform7(-0.6..0.6_f64), v in prop::array::uniform7(-1.2..1.2_f64),
        ) {
            let (model, law) = shipped();
            let from: Joints = std::array::from_fn(|i| model.ready()[i] + q.get(i).unwrap_or(&0.0));
            let v: Joints = std::array::from_fn(|i| v.get(i).copied().unwrap_or(0.0));
            let start = JointState { q: from, dq: v };
            let trailing = Trailing::new(&model, &law).expect("springs");
            let mut trail = trailing.from(&start, &stopping(&from, &v, 0.0));
            let swing = trailing.swing(&trail, &stopping(&from, &v, 0.0), &v.map(f64::abs));
            let (mut arm, mut worst) = (start, 0.0_f64);
            for step in 0..40 {
                for k in 0..10 {
                    let JointState { q, dq } = stopping(&from, &v, f64::from(step) * 1e-2 + f64::from(k) * 1e-3);
                    let torque = law.torque(&model, &arm, &q, &dq);
                    model.step(&mut arm, &torque, 1e-3);
                }
                let command = stopping(&from, &v, f64::from(step + 1) * 1e-2);
                trailing.step(&mut trail, &command, 1e-2);
                for (i, swing) in swing.iter().enumerate().take(7) {
                    worst = worst.max((trail.state.q[i] - arm.q[i]).abs());
                    prop_assert!((arm.q[i] - command.q[i]).abs() <= swing + 1e-3, "joint {i}: beyond {swing}");
                }
            }
            prop_assert!(worst < 2.5e-3, "{worst} rad");
        }
    }

    #[test]
    fn an_arm_at_rest_where_it_is_told_to_be_stays_and_one_beside_comes_back() {
        let (model, law) = shipped();
        let trailing = Trailing::new(&model, &law).expect("springs");
        let still = JointState::at_rest(*model.ready());
        let mut trail = trailing.from(&still, &still);
        trailing.step(&mut trail, &still, 1e-2);
        assert_eq!(trail.state, still);
        assert_eq!(trailing.swing(&trail, &still, &[0.0; MAX_JOINTS]), [0.0; MAX_JOINTS]);
        let mut trail = trailing.from(&JointState::at_rest(model.ready().map(|q| q + 0.02)), &still);
        (0..300).for_each(|_| trailing.step(&mut trail, &still, 1e-2));
        assert!(trail.state.q.iter().zip(&still.q).take(7).all(|(a, b)| (a - b).abs() < 1e-4));
    }

    #[test]
    fn laws_that_are_no_springs_are_none_and_one_that_damps_the_joints_own_velocity_trails_by_it() {
        let (model, mut law) = shipped();
        law.kind = ControllerKind::Tracking;
        assert!(Trailing::new(&model, &law).is_none());
        law.kind = ControllerKind::CompensatedPd;
        let trailing = Trailing::new(&model, &law).expect("springs");
        let moving = |t: f64| {
            let mut command = JointState::at_rest(*model.ready());
            (command.q[0], command.dq[0]) = (0.5 * t, 0.5);
            command
        };
        let mut trail = trailing.from(&JointState::at_rest(*model.ready()), &moving(0.0));
        (1..=100).for_each(|k| trailing.step(&mut trail, &moving(f64::from(k) * 1e-2), 1e-2));
        let behind = moving(1.0).q[0] - trail.state.q[0];
        assert!((behind - 0.5 * 50.0 / 600.0).abs() < 1e-3, "{behind}");
        law.stiffness[2] = 0.0;
        assert!(Trailing::new(&model, &law).is_none());
    }
}
