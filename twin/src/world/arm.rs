//! An arm under joint impedance control that carries a body: what touches the body moves the arm. Its joints are freedoms of
//! the body's tree, so that a contact meets the arm's inertia at the tool, `(J M⁻¹ Jᵀ)⁻¹` (Khatib 1987), the controller's
//! springs, and nothing that a model of both would have to guess.
//!
//! `M q̈ = k (q_d - q) + d (dq_d - dq) + Jᵀ f`: the controller takes off gravity and Coriolis torques of the arm and the weight of
//! what hangs on its flange, as a robot does that knows its tool. Limits of joints and torques are not in it.

use super::freedom::{Dense, MOST_FREEDOMS, Screw};
use crate::arm::{ArmModel, Joints, MAX_JOINTS};
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// The arm that carries a body.
#[derive(Debug, Clone)]
pub struct ArmPlan {
    /// Its kinematics and masses, without what is a body of the world.
    pub model: Arc<ArmModel>,
    /// Its base in the world.
    pub base: Isometry3<f64>,
    /// The body in the flange.
    pub flange_from_body: Isometry3<f64>,
    /// Where its joints start, at rest and commanded to stay [rad].
    pub start: Joints,
    /// Of the controller [N m/rad].
    pub stiffness: Joints,
    /// Of the controller [N m s/rad].
    pub damping: Joints,
}

impl ArmPlan {
    /// Where the carried body starts, in the world.
    pub fn body_at_start(&self) -> Isometry3<f64> {
        self.base * self.model.flange(&self.start).isometry() * self.flange_from_body
    }
}

/// The arm within a world.
#[derive(Debug, Clone)]
pub(super) struct Arm {
    pub(super) plan: ArmPlan,
    /// Its first freedom.
    pub(super) first: usize,
    /// The command of the controller [rad, rad/s].
    q_d: Joints,
    dq_d: Joints,
    /// How each joint moves the point of the carried body that is at the world's origin.
    columns: [Screw; MAX_JOINTS],
}

/// How a body moves, and what its velocities alone make of that.
pub(super) struct Carried {
    pub(super) velocity: Vector3<f64>,
    pub(super) spin: Vector3<f64>,
    pub(super) acceleration: Vector3<f64>,
    pub(super) turning: Vector3<f64>,
}

impl Arm {
    pub(super) fn new(plan: ArmPlan, first: usize) -> Self {
        let (q_d, still) = (plan.start, Screw { velocity: Vector3::zeros(), spin: Vector3::zeros() });
        Self { plan, first, q_d, dq_d: [0.0; MAX_JOINTS], columns: [still; MAX_JOINTS] }
    }

    pub(super) fn dof(&self) -> usize {
        self.plan.model.dof()
    }

    /// Positions or velocities of its joints out of those of all freedoms.
    pub(super) fn joints(&self, of_all: &[f64]) -> Joints {
        let mut joints = [0.0; MAX_JOINTS];
        joints[..self.dof()].copy_from_slice(&of_all[self.first..self.first + self.dof()]);
        joints
    }

    /// Tells the controller where the joints are to be now, and how fast.
    pub(super) fn aim(&mut self, q_d: Joints, dq_d: Joints) {
        (self.q_d, self.dq_d) = (q_d, dq_d);
    }

    /// The same by the pose that the body is to have within a step; `false` where the arm does not reach it.
    pub(super) fn aim_at(&mut self, body: &Isometry3<f64>, dt: f64) -> bool {
        let target = self.plan.base.inverse() * body;
        let Some(q) = self.plan.model.reach(&self.q_d, &self.plan.flange_from_body, &target, None) else {
            return false;
        };
        let mut dq = [0.0; MAX_JOINTS];
        (0..self.dof()).for_each(|i| dq[i] = (q[i] - self.q_d[i]) / dt);
        self.aim(q, dq);
        true
    }

    /// After a step: the joints are to stay unless they are commanded to go on.
    pub(super) fn halt(&mut self) {
        self.dq_d = [0.0; MAX_JOINTS];
    }

    /// Takes up where its joints are; the pose of the body.
    pub(super) fn place(&mut self, positions: &[f64]) -> Isometry3<f64> {
        let (q, base) = (self.joints(positions), self.plan.base);
        let jacobian = self.plan.model.jacobian(&q, [0.0; 3]);
        for (column, [vx, vy, vz, wx, wy, wz]) in self.columns.iter_mut().zip(jacobian) {
            let (velocity, spin) = (base.rotation * Vector3::new(vx, vy, vz), base.rotation * Vector3::new(wx, wy, wz));
            // Of the base's origin in the Jacobian, of the world's here.
            *column = Screw { velocity: velocity - spin.cross(&base.translation.vector), spin };
        }
        base * self.plan.model.flange(&q).isometry() * self.plan.flange_from_body
    }

    /// How its joints move the point `at` of the body.
    pub(super) fn screws(&self, at: &Point3<f64>, mut each: impl FnMut(usize, Screw)) {
        for (i, column) in self.columns[..self.dof()].iter().enumerate() {
            let velocity = column.velocity + column.spin.cross(&at.coords);
            each(self.first + i, Screw { velocity, spin: column.spin });
        }
    }

    /// The motion of the body's point `at`: velocity products along the chain (Featherstone 2008, 5.1).
    pub(super) fn carried(&self, at: &Point3<f64>, velocities: &[f64]) -> Carried {
        let zero = Vector3::zeros();
        let (mut velocity, mut spin, mut acceleration, mut turning) = (zero, zero, zero, zero);
        for (column, rate) in self.columns[..self.dof()].iter().zip(&velocities[self.first..]) {
            acceleration += (spin.cross(&column.velocity) + velocity.cross(&column.spin)) * *rate;
            turning += spin.cross(&column.spin) * *rate;
            velocity += column.velocity * *rate;
            spin += column.spin * *rate;
        }
        let there = velocity + spin.cross(&at.coords);
        Carried {
            velocity: there,
            spin,
            acceleration: acceleration + turning.cross(&at.coords) + spin.cross(&there),
            turning,
        }
    }

    /// Adds the arm's own inertia and what its controller does; `tree` is the first freedom of the tree.
    pub(super) fn act(
        &self,
        tree: usize,
        [positions, velocities]: [&[f64]; 2],
        masses: &mut Dense,
        forces: &mut [f64; MOST_FREEDOMS],
        dt: f64,
    ) {
        let (q, dq, from) = (self.joints(positions), self.joints(velocities), self.first - tree);
        let own = self.plan.model.mass_matrix(&q);
        for i in 0..self.dof() {
            for j in 0..self.dof() {
                masses[from + i][from + j] += own[i][j];
            }
            let damping = self.plan.damping[i];
            // Damping by the mean of the velocities before and after.
            masses[from + i][from + i] += 0.5 * damping * dt;
            forces[from + i] += self.plan.stiffness[i] * (self.q_d[i] - q[i]) + damping * (self.dq_d[i] - dq[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::JointState;
    use crate::world::{BodyPlan, Hold, Piece, STEP, World, box_hull};
    use nalgebra::{DMatrix, DVector, Translation3};

    const GAINS: [Joints; 2] =
        [[600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0, 0.0], [50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0, 0.0]];

    fn block(name: &str, size: [f64; 3], mass: f64, hold: Hold) -> BodyPlan {
        let piece = Piece::new(box_hull(size).expect("a box"), Isometry3::identity());
        BodyPlan::homogeneous(name, vec![piece], mass, hold)
    }

    /// An FR3 in its ready pose with a plate without a mass of its own below its flange.
    fn plate([stiffness, damping]: [Joints; 2]) -> ArmPlan {
        let model = Arc::new(ArmModel::fr3());
        let start = *model.ready();
        let base = Isometry3::from_parts(Translation3::new(0.1, -0.2, 0.05), nalgebra::one());
        let flange_from_body = Isometry3::translation(0.0, 0.0, 0.05);
        ArmPlan { model, base, flange_from_body, start, stiffness, damping }
    }

    /// What a force at the plate's middle asks of the joints, and the arm's inertia.
    fn jacobian(plan: &ArmPlan, q: &Joints) -> (DMatrix<f64>, DMatrix<f64>) {
        let middle = plan.model.flange(q).isometry() * Point3::from(plan.flange_from_body.translation.vector);
        let columns = plan.model.jacobian(q, middle.coords.into());
        let masses = plan.model.mass_matrix(q);
        (DMatrix::from_fn(6, 7, |i, j| columns[j][i]), DMatrix::from_fn(7, 7, |i, j| masses[i][j]))
    }

    #[test]
    fn what_hits_the_tool_meets_the_arms_inertia_there() {
        let plan = plate([[0.0; MAX_JOINTS]; 2]);
        let (jacobian, masses) = jacobian(&plan, &plan.start);
        let tool = plan.base * plan.model.flange(&plan.start).isometry() * plan.flange_from_body;
        for mass in [0.1, 1.0, 10.0] {
            // A needle of a box that hits with a face as small as a point, through its own middle: no turn of it counts.
            let at = Isometry3::from_parts(
                (tool.translation.vector + Vector3::new(0.0, 0.0, 0.0601)).into(),
                nalgebra::one(),
            );
            let bodies = [
                block("plate", [0.1, 0.1, 0.02], 0.0, Hold::Arm(Box::new(plan.clone()))),
                block("hammer", [1e-4, 1e-4, 0.1], mass, Hold::Free(at)),
            ];
            let mut world = World::new(&bodies).expect("a world");
            let speed = 0.5;
            world.trees.set_twist(1, &Vector3::new(0.0, 0.0, -speed), &Vector3::zeros());
            for _ in 0..2 {
                world.step();
            }
            let [hammer, _] = world.trees.twist(1);
            let along = DVector::from_vec(vec![0.0, 0.0, -1.0, 0.0, 0.0, 0.0]);
            let torque = jacobian.transpose() * &along;
            let answer = masses.clone().try_inverse().expect("positive definite") * &torque;
            let inertia = 1.0 / torque.dot(&answer);
            // What the hammer has lost, gravity of two steps added, the arm has got. It stays on the plate, but for what takes
            // the two out of each other again.
            let impulse = mass * (speed + 2.0 * 9.81 * STEP + hammer.z);
            let [plate, _] = world.trees.twist(0);
            let expected = impulse / inertia;
            assert!((-plate.z / expected - 1.0).abs() < 0.01, "{mass} kg on {inertia} kg: {} for {expected}", -plate.z);
            assert!((hammer.z - plate.z).abs() < 0.05 * speed, "{mass} kg: {} and {}", hammer.z, plate.z);
            let dq = world.arm(0).expect("an arm").dq;
            for (joint, answer) in answer.iter().enumerate() {
                assert!((dq[joint] - answer * impulse).abs() < 0.02 * expected, "joint {joint}: {}", dq[joint]);
            }
        }
    }

    #[test]
    fn an_arm_at_rest_gives_way_to_a_weight_by_its_controllers_springs_and_holds_without_one() {
        for mass in [0.0, 0.5, 3.0] {
            let plan = plate(GAINS);
            let tool = plan.base * plan.model.flange(&plan.start).isometry() * plan.flange_from_body;
            let at = Isometry3::from_parts((tool.translation.vector + Vector3::z() * 0.0301).into(), nalgebra::one());
            let mut bodies =
                vec![block("plate", [0.1, 0.1, 0.02], 0.4, Hold::Arm(Box::new(plan.clone()))).with_friction(0.8)];
            if mass > 0.0 {
                bodies.push(block("weight", [0.04, 0.04, 0.04], mass, Hold::Free(at)));
            }
            let mut world = World::new(&bodies).expect("a world");
            for _ in 0..4000 {
                world.step();
            }
            let JointState { q, dq } = world.arm(0).expect("an arm");
            assert!(dq.iter().all(|dq| dq.abs() < 1e-6), "{dq:?}");
            let (jacobian, _) = jacobian(&plan, &q);
            let lever = if mass > 0.0 {
                let from = plan.model.flange(&q).isometry() * plan.flange_from_body;
                (plan.base.inverse() * world.pose(1)).translation.vector - from.translation.vector
            } else {
                Vector3::zeros()
            };
            let force = Vector3::new(0.0, 0.0, -9.81 * mass);
            let turn = lever.cross(&force);
            let load = DVector::from_iterator(6, force.iter().chain(turn.iter()).copied());
            let torque = jacobian.transpose() * load;
            for joint in 0..7 {
                let (found, asked) = (q[joint] - plan.start[joint], torque[joint] / plan.stiffness[joint]);
                assert!(
                    (found - asked).abs() < 1e-5 + 2e-3 * asked.abs(),
                    "{mass} kg, joint {joint}: {found} for {asked}"
                );
            }
        }
    }

    #[test]
    fn without_contact_the_joints_move_as_the_arm_alone_does() {
        let plan = plate(GAINS);
        let bodies = [block("plate", [0.1, 0.1, 0.02], 0.0, Hold::Arm(Box::new(plan.clone())))];
        let mut world = World::new(&bodies).expect("a world");
        let (mut state, zero) = (JointState { q: plan.start, dq: [0.0; MAX_JOINTS] }, [0.0; MAX_JOINTS]);
        let mut q_d = plan.start;
        (0..7).for_each(|i| q_d[i] += 0.1);
        for _ in 0..500 {
            world.aim(0, &q_d, &zero);
            world.step();
            // The same law, its step ten times as fine.
            for _ in 0..10 {
                let bias = plan.model.bias(&state);
                let torque = std::array::from_fn(|i| {
                    plan.stiffness[i] * (q_d[i] - state.q[i]) - plan.damping[i] * state.dq[i] + bias[i]
                });
                plan.model.step(&mut state, &torque, 0.1 * STEP);
            }
        }
        let found = world.arm(0).expect("an arm");
        for joint in 0..7 {
            assert!(
                (found.q[joint] - state.q[joint]).abs() < 2e-4,
                "joint {joint}: {} {}",
                found.q[joint],
                state.q[joint]
            );
        }
    }
}
