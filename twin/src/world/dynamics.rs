//! What gravity and velocities do to the trees, and how freedoms answer to impulses: velocity products by the Newton-Euler
//! recursion, masses summed over the bodies (Featherstone 2008, chapters 5 and 6). World frame, SI.

use super::freedom::{Dense, MOST_FREEDOMS, Screw};
use super::plan::JointKind;
use super::tree::{Link, Motion, Span, Trees};
use nalgebra::{Isometry3, Point3, Vector3};

impl Trees {
    /// Velocities of all bodies and what they make of accelerations.
    fn recur(&mut self) {
        for i in 0..self.nodes.len() {
            match &self.nodes[i].link {
                // Those of its origin, where [`Trees::set_moved`] has put them.
                Link::Held => {}
                Link::Arm(arm) => {
                    let motion = &mut self.motions[i];
                    let found = self.arms[*arm].carried(&motion.centre, &self.velocities);
                    (motion.velocity, motion.spin) = (found.velocity, found.spin);
                    (motion.acceleration, motion.turning) = (found.acceleration, found.turning);
                }
                Link::Free { first } => {
                    let v = &self.velocities[*first..first + 6];
                    let motion = &mut self.motions[i];
                    (motion.velocity, motion.spin) = (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]));
                    (motion.acceleration, motion.turning) = (Vector3::zeros(), Vector3::zeros());
                }
                Link::Joint { freedom, ratio, kind, axis, parent, .. } => {
                    let rate = ratio * self.velocities[*freedom];
                    let carrier =
                        parent.map_or_else(|| Motion::at(Isometry3::identity()), |parent| self.motions[parent]);
                    let is_held = parent.is_none_or(|parent| matches!(self.nodes[parent].link, Link::Held));
                    let own = self.motions[i];
                    let known = if is_held { carrier.pose.translation.vector.into() } else { carrier.centre };
                    let along = own.pose.rotation * axis.into_inner() * rate;
                    let carried = |at: &Point3<f64>| {
                        let lever = at - known;
                        let velocity = carrier.velocity + carrier.spin.cross(&lever);
                        let inwards = carrier.spin.cross(&carrier.spin.cross(&lever));
                        (velocity, carrier.acceleration + carrier.turning.cross(&lever) + inwards)
                    };
                    let motion = &mut self.motions[i];
                    match kind {
                        JointKind::Revolute => {
                            let origin = Point3::from(own.pose.translation.vector);
                            let (velocity, acceleration) = carried(&origin);
                            let lever = own.centre - origin;
                            motion.spin = carrier.spin + along;
                            motion.turning = carrier.turning + carrier.spin.cross(&along);
                            motion.velocity = velocity + motion.spin.cross(&lever);
                            motion.acceleration = acceleration
                                + motion.turning.cross(&lever)
                                + motion.spin.cross(&motion.spin.cross(&lever));
                        }
                        JointKind::Prismatic => {
                            let (velocity, acceleration) = carried(&own.centre);
                            (motion.spin, motion.turning) = (carrier.spin, carrier.turning);
                            motion.velocity = velocity + along;
                            motion.acceleration = acceleration + carrier.spin.cross(&along) * 2.0;
                        }
                    }
                }
            }
        }
    }

    /// The same of a body by itself, whose masses are those of its centre and of its turns.
    fn accelerate_free(&mut self, tree: usize, body: usize, first: usize, gravity: &Vector3<f64>, dt: f64) {
        let (mass, motion) = (self.nodes[body].mass, &self.motions[body]);
        let turn = motion.pose.rotation.to_rotation_matrix().into_inner();
        let lightness = turn * self.nodes[body].lightness * turn.transpose();
        let spin = lightness * motion.spin.cross(&(motion.inertia * motion.spin));
        let inverse = &mut self.inverses[tree];
        for i in 0..3 {
            inverse[i][i] = 1.0 / mass;
            for j in 0..3 {
                inverse[3 + i][3 + j] = lightness[(i, j)];
            }
            self.velocities[first + i] += gravity[i] * dt;
            self.velocities[first + 3 + i] -= spin[i] * dt;
        }
    }

    /// Lets gravity and velocity products act for `dt`; afterwards the trees answer to impulses where they are now.
    pub(super) fn accelerate(&mut self, gravity: &Vector3<f64>, dt: f64) {
        self.recur();
        for tree in 0..self.spans.len() {
            let Span { first, count, root, bodies } = self.spans[tree];
            if bodies == 1 && matches!(self.nodes[root].link, Link::Free { .. }) {
                self.accelerate_free(tree, root, first, gravity, dt);
                continue;
            }
            let mut masses: Dense = [[0.0; MOST_FREEDOMS]; MOST_FREEDOMS];
            let mut forces = [0.0; MOST_FREEDOMS];
            let arm = match self.nodes[root].link {
                Link::Arm(arm) => Some(&self.arms[arm]),
                _ => None,
            };
            // The freedoms whose controller takes the weight off.
            let weightless = arm.map_or(0..0, |arm| arm.first - first..arm.first - first + arm.dof());
            for body in (0..self.nodes.len()).filter(|i| self.nodes[*i].tree == tree) {
                let (node, motion) = (&self.nodes[body], self.motions[body]);
                let (push, weight) = (-motion.acceleration * node.mass, gravity * node.mass);
                let turn = -(motion.inertia * motion.turning + motion.spin.cross(&(motion.inertia * motion.spin)));
                let mut chain = [(0, Screw { velocity: Vector3::zeros(), spin: Vector3::zeros() }); MOST_FREEDOMS];
                let mut length = 0;
                self.screws(body, motion.centre, |freedom, screw| {
                    chain[length] = (freedom - first, screw);
                    length += 1;
                });
                for (i, screw) in &chain[..length] {
                    let weight = if weightless.contains(i) { 0.0 } else { screw.velocity.dot(&weight) };
                    forces[*i] += screw.velocity.dot(&push) + screw.spin.dot(&turn) + weight;
                    let (momentum, spin) = (screw.velocity * node.mass, motion.inertia * screw.spin);
                    for (j, other) in &chain[..length] {
                        masses[*i][*j] += other.velocity.dot(&momentum) + other.spin.dot(&spin);
                    }
                }
            }
            if let Some(arm) = arm {
                arm.act(first, [&self.positions, &self.velocities], &mut masses, &mut forces, dt);
            }
            for i in 0..count {
                // Damping by the mean of the velocities before and after.
                masses[i][i] += 0.5 * self.damping[first + i] * dt;
                forces[i] -= self.damping[first + i] * self.velocities[first + i];
            }
            self.inverses[tree] = inverse(&masses, count);
            for i in 0..count {
                let row = &self.inverses[tree][i];
                self.velocities[first + i] += dt * (0..count).map(|j| row[j] * forces[j]).sum::<f64>();
            }
        }
    }
}

/// Of a symmetric positive definite matrix (Gauss-Jordan without pivots, which such a matrix does not need).
fn inverse(matrix: &Dense, count: usize) -> Dense {
    let mut left = *matrix;
    let mut right: Dense = [[0.0; MOST_FREEDOMS]; MOST_FREEDOMS];
    (0..count).for_each(|i| right[i][i] = 1.0);
    for pivot in 0..count {
        let scale = 1.0 / left[pivot][pivot];
        for column in 0..count {
            left[pivot][column] *= scale;
            right[pivot][column] *= scale;
        }
        for row in (0..count).filter(|row| *row != pivot) {
            let factor = left[row][pivot];
            if factor == 0.0 {
                continue;
            }
            for column in 0..count {
                left[row][column] -= factor * left[pivot][column];
                right[row][column] -= factor * right[pivot][column];
            }
        }
    }
    right
}
