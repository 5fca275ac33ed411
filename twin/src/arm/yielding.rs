//! How the flange moves and how it gives way to a push: what a contact needs to know about the arm behind the tool,
//! without solving the arm's equations in each of its short steps. Base frame, SI. Called by [`crate::sim`].

use super::kernel::{Chain, Frame, factor, filled, first, solve, with_dof};
use super::kinematics::isometry;
use super::spatial::{Spatial, add, cross};
use super::{ArmModel, JointState, Joints, MAX_JOINTS};
use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

/// Inertia of a link that weighs nothing, where its rotor lies behind a spring [kg m²].
const LEAST_INERTIA: f64 = 1e-6;

/// Where the flange is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlangeMotion {
    /// The flange in the base frame.
    pub pose: Isometry3<f64>,
    /// Velocity of its origin [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector3<f64>,
}

/// Accelerations per wrench on the last link. Wrenches: force, then moment about the flange's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yielding {
    /// Of the flange: linear, then angular.
    pub flange: Matrix6<f64>,
    /// Of the joints, one array for each component of the wrench.
    pub joints: [Joints; 6],
    /// Joint torques per wrench, likewise.
    pub torques: [Joints; 6],
}

impl ArmModel {
    /// Pose and velocity of the flange.
    pub fn flange_motion(&self, state: &JointState) -> FlangeMotion {
        with_dof!(self, N => {
            let chain = Chain::<N>::at(first(&self.links), first(&state.q));
            let pose = self.flange_of(&chain.frames[N - 1]);
            let mut twist = Spatial::default();
            for i in 0..N {
                twist = twist.plus(chain.axes[i].times(state.dq[i]));
            }
            let velocity = add(twist.linear, cross(twist.angular, pose.translation.vector.into()));
            FlangeMotion { pose, velocity: velocity.into(), angular_velocity: twist.angular.into() }
        })
    }

    /// How the arm yields at `q`. A joint that `springs` says lies behind a gear that yields leaves its rotor behind; `grip`
    /// is what joints resist besides [kg m²].
    pub fn yielding(&self, q: &Joints, springs: impl Fn(usize) -> bool, grip: &Joints) -> Yielding {
        with_dof!(self, N => {
            let links = first::<N, _>(&self.links);
            let chain = Chain::at(links, first(q));
            let mut mass = chain.mass_matrix(&chain.bodies(links), links);
            for i in (0..N).filter(|i| springs(*i)) {
                mass[i][i] = (mass[i][i] - links[i].rotor).max(LEAST_INERTIA);
            }
            for i in 0..N {
                mass[i][i] += grip[i];
            }
            factor(&mut mass);
            self.yielding_of(&chain, &mass)
        })
    }

    /// How it yields where the chain is known and its mass matrix factored.
    pub(super) fn yielding_of<const N: usize>(&self, chain: &Chain<N>, mass: &[[f64; N]; N]) -> Yielding {
        let origin = self.flange_of(&chain.frames[N - 1]).translation.vector.into();
        let columns = chain.axes.map(|axis| {
            let linear = add(axis.linear, cross(axis.angular, origin));
            [linear[0], linear[1], linear[2], axis.angular[0], axis.angular[1], axis.angular[2]]
        });
        Yielding::of(&columns, |torque| solve(mass, torque))
    }

    fn flange_of(&self, last: &Frame) -> Isometry3<f64> {
        isometry(last) * self.flange
    }
}

impl Yielding {
    /// From the Jacobian's columns, one a joint, and the joints' answer to torques.
    fn of<const N: usize>(columns: &[[f64; 6]; N], answer: impl Fn(&[f64; N]) -> [f64; N]) -> Self {
        let mut out =
            Self { flange: Matrix6::zeros(), joints: [[0.0; MAX_JOINTS]; 6], torques: [[0.0; MAX_JOINTS]; 6] };
        for component in 0..6 {
            let torque: [f64; N] = std::array::from_fn(|i| columns[i][component]);
            let acceleration = answer(&torque);
            out.torques[component] = filled(&torque);
            out.joints[component] = filled(&acceleration);
            for (column, acceleration) in columns.iter().zip(&acceleration) {
                for (row, moved) in column.iter().enumerate() {
                    out.flange[(row, component)] += moved * acceleration;
                }
            }
        }
        out
    }

    /// Joint accelerations under a wrench (or what follows from its integrals).
    pub fn joints_under(&self, wrench: &Vector6<f64>) -> Joints {
        combined(&self.joints, wrench)
    }

    /// Joint torques of a wrench [N m].
    pub fn torques_under(&self, wrench: &Vector6<f64>) -> Joints {
        combined(&self.torques, wrench)
    }
}

fn combined(columns: &[Joints; 6], wrench: &Vector6<f64>) -> Joints {
    std::array::from_fn(|i| (0..6).map(|component| columns[component][i] * wrench[component]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::{PointForce, Presliding, Slip, Spring, Transmission};

    fn moving() -> JointState {
        let q = *ArmModel::fr3().ready();
        JointState { q, dq: [0.3, -0.2, 0.5, 0.1, -0.4, 0.2, 0.6, 0.0] }
    }

    #[test]
    fn the_flange_moves_as_its_pose_changes() {
        let (arm, state) = (ArmModel::fr3(), moving());
        let dt = 1e-6;
        let later = std::array::from_fn(|i| state.q[i] + dt * state.dq[i]);
        let motion = arm.flange_motion(&state);
        let (a, b) = (arm.flange(&state.q).isometry(), arm.flange(&later).isometry());
        assert_eq!(motion.pose, a);
        let velocity = (b.translation.vector - a.translation.vector) / dt;
        let spin = (b.rotation * a.rotation.inverse()).scaled_axis() / dt;
        assert!((motion.velocity - velocity).norm() < 1e-6 && (motion.angular_velocity - spin).norm() < 1e-5);
    }

    #[test]
    fn a_push_accelerates_the_joints_as_the_equations_of_motion_say() {
        let (arm, state) = (ArmModel::fr3(), moving());
        let flange = arm.flange(&state.q).isometry().translation.vector;
        let (lever, force) = (Vector3::new(0.02, -0.03, 0.15), Vector3::new(3.0, -7.0, 2.0));
        let load = PointForce { point: (flange + lever).into(), force: force.into() };
        let [without, with] = [[0.0; 8], arm.torque_of(&state.q, &load)].map(|tau| arm.accelerations(&state, &tau));
        let moment = lever.cross(&force);
        let wrench = Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
        let yielding = arm.yielding(&state.q, |_| false, &[0.0; 8]);
        let (joints, torques) = (yielding.joints_under(&wrench), yielding.torques_under(&wrench));
        for i in 0..7 {
            assert!((joints[i] - (with[i] - without[i])).abs() < 1e-9);
            assert!((torques[i] - arm.torque_of(&state.q, &load)[i]).abs() < 1e-12);
        }
        assert!((yielding.flange - yielding.flange.transpose()).amax() < 1e-9, "Maxwell's reciprocity");
    }

    /// The same dry friction in every joint.
    struct Dry {
        bound: f64,
        creep: f64,
        presliding: Option<Presliding>,
    }

    impl Transmission for Dry {
        fn spring(&self, _joint: usize) -> Option<Spring> {
            None
        }

        fn dry_friction(&self, _joint: usize, _slip: Slip) -> f64 {
            self.bound
        }

        fn creep(&self, _joint: usize) -> f64 {
            self.creep
        }

        fn presliding(&self, _joint: usize) -> Option<Presliding> {
            self.presliding
        }

        fn drag(&self, _joint: usize, _q: f64, _dq: f64) -> f64 {
            0.0
        }
    }

    #[test]
    fn a_small_push_moves_joints_with_friction_as_far_as_their_grip_lets_it() {
        let arm = ArmModel::fr3();
        let slow = JointState { q: *arm.ready(), dq: [1e-3, -2e-3, 5e-3, 0.0, -1e-3, 0.3, 4e-3, 0.0] };
        let still = JointState { dq: [0.0; 8], ..slow };
        let (gravity, dt) = (arm.gravity(&slow.q), 1e-3);
        let wrench = Vector6::new(0.05, -0.08, 0.03, 0.0, 0.0, 0.0);
        let bristles = Some(Presliding { displacement: 2e-6, damping: 0.3 });
        for (state, creep, presliding) in
            [(slow, 4e-3, None), (slow, 1e-4, None), (still, 0.0, None), (slow, 0.0, bristles), (still, 0.0, bristles)]
        {
            let dry = Dry { bound: 0.6, creep, presliding };
            let step = |external: &Joints| {
                let (mut link, mut motor) = (state, state);
                let passed =
                    arm.step_through(&dry, (&mut link, &mut motor, &mut [0.0; 8]), (&gravity, external), (dt, 1));
                (link.dq, passed.grip)
            };
            let (alone, grip) = step(&[0.0; 8]);
            let yielding = arm.yielding(&state.q, |_| false, &grip);
            let (pushed, _) = step(&yielding.torques_under(&wrench));
            let expected = yielding.joints_under(&wrench);
            let ideal = arm.yielding(&state.q, |_| false, &[0.0; 8]).joints_under(&wrench);
            let scale = ideal.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            for i in 0..7 {
                let change = (pushed[i] - alone[i]) / dt;
                assert!((change - expected[i]).abs() < 0.02 * scale, "creep {creep}: {change} {}", expected[i]);
            }
            assert!((0..7).any(|i| (expected[i] - ideal[i]).abs() > 0.1 * scale), "friction makes a difference");
        }
    }
}
