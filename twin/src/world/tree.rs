//! Bodies on their joints: where they are, how they move, and how freedoms answer to impulses. World frame, SI.
//!
//! A free body has six freedoms (velocity of its centre of mass, angular velocity), one on a joint has one, or that of the
//! joint it follows. All bodies that hang on one root make a tree with one dense mass matrix, so that joints hold exactly
//! and cost the solver nothing.

use super::arm::Arm;
use super::freedom::{Dense, MOST_FREEDOMS, Screw};
use super::patch::{Patch, motion_in};
use super::plan::{BodyPlan, Hold, JointKind};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// What connects a body to the one that carries it, or to the world.
#[derive(Debug, Clone)]
pub(super) enum Link {
    Held,
    /// By which of the arms.
    Arm(usize),
    Free {
        first: usize,
    },
    Joint {
        freedom: usize,
        ratio: f64,
        kind: JointKind,
        axis: Unit<Vector3<f64>>,
        at: Isometry3<f64>,
        parent: Option<usize>,
    },
}

#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) link: Link,
    pub(super) tree: usize,
    pub(super) mass: f64,
    pub(super) centre: Point3<f64>,
    pub(super) inertia: Matrix3<f64>,
    pub(super) lightness: Matrix3<f64>,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub(super) pose: Isometry3<f64>,
    /// Centre of mass.
    pub(super) centre: Point3<f64>,
    pub(super) inertia: Matrix3<f64>,
    /// Of the centre of mass.
    pub(super) velocity: Vector3<f64>,
    pub(super) spin: Vector3<f64>,
    /// What velocities alone make of both, without any acceleration of a freedom.
    pub(super) acceleration: Vector3<f64>,
    pub(super) turning: Vector3<f64>,
    /// Velocity and angular velocity in the step before, of a body that is moved from outside.
    before: [Vector3<f64>; 2],
}

/// Freedoms of the bodies on one root.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub(super) first: usize,
    pub(super) count: usize,
    pub(super) root: usize,
    /// Bodies of the tree.
    pub(super) bodies: usize,
}

#[derive(Debug, Clone)]
pub(super) struct Trees {
    pub(super) nodes: Vec<Node>,
    pub(super) motions: Vec<Motion>,
    pub(super) spans: Vec<Span>,
    pub(super) inverses: Vec<Dense>,
    /// Of joints; those of free bodies are not used.
    pub(super) positions: Vec<f64>,
    pub(super) velocities: Vec<f64>,
    pub(super) damping: Vec<f64>,
    pub(super) arms: Vec<Arm>,
}

impl Trees {
    /// Of bodies that were checked; `Err` with the body that gives its tree too many freedoms.
    pub(super) fn new(bodies: &[BodyPlan]) -> Result<Self, usize> {
        let mut trees = Self {
            nodes: Vec::new(),
            motions: Vec::new(),
            spans: Vec::new(),
            inverses: Vec::new(),
            positions: Vec::new(),
            velocities: Vec::new(),
            damping: Vec::new(),
            arms: Vec::new(),
        };
        // A tree's freedoms lie side by side: numbered root by root.
        let mut root_of = Vec::new();
        for (i, body) in bodies.iter().enumerate() {
            let carrier = if let Hold::Joint(joint) = &body.hold { joint.parent } else { None };
            let leader = if let Hold::Joint(joint) = &body.hold { joint.follows.map(|(other, _)| other) } else { None };
            root_of.push(carrier.or(leader).map_or(i, |other| root_of[other]));
        }
        let mut links: Vec<Option<Link>> = vec![None; bodies.len()];
        let mut tree_of = vec![0; bodies.len()];
        for root in (0..bodies.len()).filter(|i| root_of[*i] == *i) {
            let first = trees.positions.len();
            for i in (root..bodies.len()).filter(|i| root_of[*i] == root) {
                links[i] = Some(trees.link(&bodies[i].hold, &links));
                tree_of[i] = trees.spans.len();
                if trees.positions.len() - first > MOST_FREEDOMS {
                    return Err(i);
                }
            }
            let members = root_of.iter().filter(|other| **other == root).count();
            trees.spans.push(Span { first, count: trees.positions.len() - first, root, bodies: members });
            trees.inverses.push([[0.0; MOST_FREEDOMS]; MOST_FREEDOMS]);
        }
        for ((body, link), tree) in bodies.iter().zip(links).zip(tree_of) {
            let pose = match &body.hold {
                Hold::Fixed(pose) | Hold::Moved(pose) | Hold::Free(pose) => *pose,
                Hold::Arm(_) | Hold::Joint(_) => Isometry3::identity(),
            };
            let Some(link) = link else { continue };
            let centre = Point3::from(body.centre_of_mass);
            let lightness = body.inertia.try_inverse().unwrap_or_else(Matrix3::zeros);
            trees.nodes.push(Node { link, tree, mass: body.mass, centre, inertia: body.inertia, lightness });
            trees.motions.push(Motion::at(pose));
        }
        trees.place();
        Ok(trees)
    }

    fn link(&mut self, hold: &Hold, links: &[Option<Link>]) -> Link {
        let first = self.positions.len();
        let mut add = |position: f64, damping: f64| {
            self.positions.push(position);
            self.velocities.push(0.0);
            self.damping.push(damping);
        };
        match hold {
            Hold::Fixed(_) | Hold::Moved(_) => Link::Held,
            Hold::Arm(plan) => {
                // Its controller's damping is its own.
                (0..plan.model.dof()).for_each(|i| add(plan.start[i], 0.0));
                self.arms.push(Arm::new((**plan).clone(), first));
                Link::Arm(self.arms.len() - 1)
            }
            Hold::Free(_) => {
                (0..6).for_each(|_| add(0.0, 0.0));
                Link::Free { first }
            }
            Hold::Joint(joint) => {
                let led = joint.follows.and_then(|(other, ratio)| match links[other] {
                    Some(Link::Joint { freedom, .. }) => Some((freedom, ratio)),
                    _ => None,
                });
                let (freedom, ratio) = led.unwrap_or_else(|| {
                    add(joint.start, joint.damping);
                    (first, 1.0)
                });
                Link::Joint { freedom, ratio, kind: joint.kind, axis: joint.axis, at: joint.at, parent: joint.parent }
            }
        }
    }

    /// Pose of a body.
    pub(super) fn pose(&self, body: usize) -> &Isometry3<f64> {
        &self.motions[body].pose
    }

    /// Moves a free or a held body; what hangs on it follows with [`Trees::place`].
    pub(super) fn set_pose(&mut self, body: usize, pose: Isometry3<f64>) {
        self.motions[body].pose = pose;
    }

    /// Velocity of the origin of a body that is moved from outside [m/s], and its angular velocity [rad/s], for one step.
    pub(super) fn set_moved(&mut self, body: usize, velocity: Vector3<f64>, spin: Vector3<f64>, dt: f64) {
        let motion = &mut self.motions[body];
        let [velocity_before, spin_before] = motion.before;
        (motion.acceleration, motion.turning) = ((velocity - velocity_before) / dt, (spin - spin_before) / dt);
        (motion.velocity, motion.spin) = (velocity, spin);
    }

    /// Whether contacts do not move a body.
    pub(super) fn is_held(&self, body: usize) -> bool {
        matches!(self.nodes[body].link, Link::Held)
    }

    /// After a step: bodies that are moved from outside stand still unless they are moved again.
    pub(super) fn halt(&mut self, dt: f64) {
        self.arms.iter_mut().for_each(Arm::halt);
        for (node, motion) in self.nodes.iter().zip(&mut self.motions) {
            if matches!(node.link, Link::Held) {
                motion.before = [motion.velocity, motion.spin];
                (motion.velocity, motion.spin) = (Vector3::zeros(), Vector3::zeros());
                (motion.acceleration, motion.turning) = (-motion.before[0] / dt, -motion.before[1] / dt);
            }
        }
    }

    /// The tree's freedoms of a body.
    pub(super) fn span(&self, body: usize) -> Span {
        self.spans[self.nodes[body].tree]
    }

    pub(super) fn tree(&self, body: usize) -> usize {
        self.nodes[body].tree
    }

    /// The arm that carries a body.
    pub(super) fn arm(&self, body: usize) -> Option<&Arm> {
        match self.nodes[body].link {
            Link::Arm(arm) => Some(&self.arms[arm]),
            _ => None,
        }
    }

    /// The same, to command it.
    pub(super) fn arm_mut(&mut self, body: usize) -> Option<&mut Arm> {
        match self.nodes[body].link {
            Link::Arm(arm) => Some(&mut self.arms[arm]),
            _ => None,
        }
    }

    /// Index of the freedom of a body's joint.
    pub(super) fn freedom(&self, body: usize) -> Option<(usize, f64)> {
        match self.nodes[body].link {
            Link::Joint { freedom, ratio, .. } => Some((freedom, ratio)),
            _ => None,
        }
    }

    /// Lets positions run for `dt` at the velocities there are.
    pub(super) fn drift(&mut self, dt: f64) {
        for (node, motion) in self.nodes.iter().zip(&mut self.motions) {
            match node.link {
                Link::Held => {
                    let turn = UnitQuaternion::from_scaled_axis(motion.spin * dt);
                    motion.pose.translation.vector += motion.velocity * dt;
                    motion.pose.rotation = turn * motion.pose.rotation;
                }
                Link::Free { first } => {
                    let v = &self.velocities[first..first + 6];
                    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(v[3], v[4], v[5]) * dt);
                    let centre = motion.pose * node.centre + Vector3::new(v[0], v[1], v[2]) * dt;
                    let mut rotation = turn * motion.pose.rotation;
                    rotation.renormalize_fast();
                    let origin = centre.coords - rotation * node.centre.coords;
                    motion.pose = Isometry3::from_parts(origin.into(), rotation);
                }
                Link::Arm(_) | Link::Joint { .. } => {}
            }
        }
        // Those of free bodies run along, and say nothing.
        self.positions.iter_mut().zip(&self.velocities).for_each(|(position, velocity)| *position += velocity * dt);
        self.place();
    }

    /// Puts every body where its joint holds it.
    pub(super) fn place(&mut self) {
        for i in 0..self.nodes.len() {
            if let Link::Arm(arm) = self.nodes[i].link {
                self.motions[i].pose = self.arms[arm].place(&self.positions);
            }
            if let Link::Joint { freedom, ratio, kind, axis, at, parent } = &self.nodes[i].link {
                let position = ratio * self.positions[*freedom];
                let moved = match kind {
                    JointKind::Revolute => {
                        Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(axis, position))
                    }
                    JointKind::Prismatic => {
                        Isometry3::from_parts((axis.into_inner() * position).into(), UnitQuaternion::identity())
                    }
                };
                let carrier = parent.map_or_else(Isometry3::identity, |parent| self.motions[parent].pose);
                self.motions[i].pose = carrier * at * moved;
            }
            let (node, motion) = (&self.nodes[i], &mut self.motions[i]);
            motion.centre = motion.pose * node.centre;
            if !matches!(node.link, Link::Held) {
                let turn = motion.pose.rotation.to_rotation_matrix().into_inner();
                motion.inertia = turn * node.inertia * turn.transpose();
            }
        }
    }

    /// Each freedom that moves a body, with how it moves the point `at` of it.
    pub(super) fn screws(&self, body: usize, at: Point3<f64>, mut each: impl FnMut(usize, Screw)) {
        let mut body = body;
        loop {
            match &self.nodes[body].link {
                Link::Held => return,
                Link::Arm(arm) => return self.arms[*arm].screws(&at, each),
                Link::Free { first } => {
                    let lever = at - self.motions[body].centre;
                    for k in 0..3 {
                        let axis = Vector3::ith(k, 1.0);
                        each(first + k, Screw { velocity: axis, spin: Vector3::zeros() });
                        each(first + 3 + k, Screw { velocity: axis.cross(&lever), spin: axis });
                    }
                    return;
                }
                Link::Joint { freedom, ratio, kind, axis, parent, .. } => {
                    let pose = &self.motions[body].pose;
                    let along = pose.rotation * axis.into_inner() * *ratio;
                    let screw = match kind {
                        JointKind::Revolute => {
                            Screw { velocity: along.cross(&(at.coords - pose.translation.vector)), spin: along }
                        }
                        JointKind::Prismatic => Screw { velocity: along, spin: Vector3::zeros() },
                    };
                    each(*freedom, screw);
                    let Some(parent) = parent else { return };
                    body = *parent;
                }
            }
        }
    }

    /// Tells a patch between two bodies which freedoms move it, and how they answer.
    pub(super) fn connect(&self, patch: &mut Patch, first: usize, second: usize) {
        let trees = [self.nodes[first].tree, self.nodes[second].tree];
        let (origin, mut offsets) = (patch.origin, [0, 0]);
        let spans = trees.map(|tree| self.spans[tree]);
        (0..spans[0].count).for_each(|i| patch.push(spans[0].first + i));
        if trees[0] != trees[1] {
            offsets[1] = spans[0].count;
            (0..spans[1].count).for_each(|i| patch.push(spans[1].first + i));
        }
        for (side, body, sign) in [(0, first, -1.0), (1, second, 1.0)] {
            let axes = patch.axes;
            let columns = patch.columns_mut();
            self.screws(body, origin, |freedom, screw| {
                let column = &mut columns[offsets[side] + freedom - spans[side].first];
                column.motion += motion_in(&axes, &screw.velocity, &screw.spin) * sign;
            });
            let root = &self.motions[spans[side].root];
            if matches!(self.nodes[spans[side].root].link, Link::Held) {
                let velocity = root.velocity + root.spin.cross(&(origin.coords - root.pose.translation.vector));
                patch.add_moved(motion_in(&axes, &velocity, &root.spin) * sign);
            }
        }
        let blocks = if trees[0] == trees[1] { 1 } else { 2 };
        for side in 0..blocks {
            let (inverse, count) = (&self.inverses[trees[side]], spans[side].count);
            let columns = &mut patch.columns_mut()[offsets[side]..offsets[side] + count];
            for i in 0..count {
                columns[i].answer = (0..count).map(|j| columns[j].motion * inverse[i][j]).sum();
            }
        }
    }

    /// Velocity of one freedom for an impulse on it.
    pub(super) fn answer(&self, tree: usize, freedom: usize) -> f64 {
        let i = freedom - self.spans[tree].first;
        self.inverses[tree][i][i]
    }

    /// Gives an impulse to one freedom.
    pub(super) fn push(&mut self, tree: usize, freedom: usize, impulse: f64) {
        let Span { first, count, .. } = self.spans[tree];
        for i in 0..count {
            self.velocities[first + i] += self.inverses[tree][i][freedom - first] * impulse;
        }
    }

    /// Velocity of a body's centre of mass [m/s], and its angular velocity [rad/s], from the freedoms' velocities.
    pub(super) fn twist(&self, body: usize) -> [Vector3<f64>; 2] {
        let centre = self.motions[body].centre;
        let root = &self.motions[self.span(body).root];
        let mut twist = [Vector3::zeros(); 2];
        if matches!(self.nodes[self.span(body).root].link, Link::Held) {
            let lever = centre.coords - root.pose.translation.vector;
            twist = [root.velocity + root.spin.cross(&lever), root.spin];
        }
        self.screws(body, centre, |freedom, screw| {
            twist[0] += screw.velocity * self.velocities[freedom];
            twist[1] += screw.spin * self.velocities[freedom];
        });
        twist
    }

    /// Puts the freedoms of a free body into motion.
    pub(super) fn set_twist(&mut self, body: usize, velocity: &Vector3<f64>, spin: &Vector3<f64>) {
        if let Link::Free { first } = self.nodes[body].link {
            self.velocities[first..first + 3].copy_from_slice(velocity.as_slice());
            self.velocities[first + 3..first + 6].copy_from_slice(spin.as_slice());
        }
    }
}

impl Motion {
    pub(super) fn at(pose: Isometry3<f64>) -> Self {
        let zero = Vector3::zeros();
        Self {
            pose,
            centre: Point3::origin(),
            inertia: Matrix3::zeros(),
            velocity: zero,
            spin: zero,
            acceleration: zero,
            turning: zero,
            before: [zero; 2],
        }
    }
}
