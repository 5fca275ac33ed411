//! A world of many bodies: free ones, on joints, held fast or moved, made of convex pieces, with gravity, contact that rests
//! and slides, and grippers that hold by friction. What [`crate::sim`] has for one object on a table, exact to a millimetre
//! over a stroke, stands apart from this and stays as fast.
//!
//! In every millisecond all positions run for half of it at the velocities there are; gravity and joints act there; each
//! pair of pieces that touches gets one patch; sweeps over patches and joints find all impulses, beginning with those of the
//! step before; and positions run for the other half (leapfrog). A body at rest stays exactly where it is.
//!
//! | file | owns |
//! |---|---|
//! | `plan` | what a world is made of, and what cannot be |
//! | `freedom` | how one freedom moves a point, and room for all of a tree |
//! | `tree` | bodies on their joints: where they are, how freedoms move them |
//! | `dynamics` | what gravity and velocities do, mass matrices |
//! | `arm` | an arm that carries a body and gives way to what touches it |
//! | `touch` | where two convex pieces touch |
//! | `patch` | the impulses of one patch: load, friction, torsion |
//! | `rail` | the impulses of one joint: dry friction, limits, drive |
//! | `outside` | what is put in from outside and read back in every step |
//! | `lone_joint` | one part on its joint while nothing touches it, fast enough to be fitted |
//!
//! World frame with z up, SI. There is no restitution: what hits stays. Not rapier: its friction turns a spinning box
//! 32 % too far, and its joints report no forces. The step asks nothing of the allocator.

mod arm;
mod dynamics;
mod freedom;
mod lone_joint;
mod outside;
mod patch;
mod plan;
mod rail;
#[cfg(test)]
mod tests;
mod touch;
mod tree;

pub use arm::ArmPlan;
pub use lone_joint::LoneJoint;
pub use outside::{BodyMotion, Load};
pub use plan::{BodyPlan, Drive, Hold, JointKind, JointPlan, Piece, PlanError, box_hull, cylinder_hull};

use crate::arm::{FREE_FALL, JointState, Joints};
use crate::physics::Hull;
use freedom::MOST_FREEDOMS;
use nalgebra::{Isometry3, Point3, Vector3};
use patch::{Memory, Patch};
use rail::Rail;
use shared_mem::time::TICK;
use std::sync::Arc;
use touch::{Located, Search, Touching};
use tree::Trees;

/// Length of a step [s]: one of the control loop, since that is how often hands and drives are commanded anew.
pub const STEP: f64 = TICK;
/// Sweeps over all patches and joints, and the change of velocity [m/s] below which they end early.
const SWEEPS: usize = 60;
const CONVERGED: f64 = 1e-7;
/// Pieces nearer than this are looked at [m], and as much more as they may come nearer in a step.
const NEAR_PIECES: f64 = 5e-4;
/// Bodies that overlap by more than this cannot start there [m].
const OVERLAP: f64 = 1e-4;

/// Bodies and their state.
#[derive(Debug, Clone)]
pub struct World {
    bodies: Vec<Shaped>,
    trees: Trees,
    rails: Vec<Rail>,
    pairs: Vec<PiecePair>,
    patches: Vec<(usize, Patch)>,
    pieces: Vec<PieceNow>,
}

#[derive(Debug, Clone)]
struct Shaped {
    pad_radius: f64,
    radius: f64,
    is_fixed: bool,
    /// Of its fastest point [m/s], when contacts were last looked for.
    speed: f64,
}

#[derive(Debug, Clone)]
struct PieceNow {
    hull: Arc<Hull>,
    body: usize,
    in_body: Isometry3<f64>,
    at: Isometry3<f64>,
    /// Least and largest corner of a box along the world's axes that holds it.
    bounds: [Vector3<f64>; 2],
}

#[derive(Debug, Clone)]
struct PiecePair {
    pieces: [usize; 2],
    friction: f64,
    found_by: Search,
    memory: Memory,
}

impl World {
    /// All bodies where they start, at rest.
    ///
    /// # Errors
    /// [`PlanError`] with the first body that cannot be.
    pub fn new(plans: &[BodyPlan]) -> Result<Self, PlanError> {
        for (i, body) in plans.iter().enumerate() {
            body.check(i, plans)?;
        }
        let trees = Trees::new(plans).map_err(|i| PlanError {
            body: plans[i].name.clone(),
            key: "parent",
            what: format!("more than {} freedoms hang on one root; hang it on another one", MOST_FREEDOMS),
        })?;
        let (mut bodies, mut pieces) = (Vec::new(), Vec::new());
        for (i, plan) in plans.iter().enumerate() {
            let now = |piece: &Piece| PieceNow {
                hull: Arc::clone(&piece.hull),
                body: i,
                in_body: piece.at,
                at: piece.at,
                bounds: [Vector3::zeros(); 2],
            };
            pieces.extend(plan.pieces.iter().map(now));
            let reach = |piece: &Piece| piece.at.translation.vector.norm() + piece.hull.radius;
            bodies.push(Shaped {
                pad_radius: plan.pad_radius,
                radius: plan.pieces.iter().map(reach).fold(0.0, f64::max),
                is_fixed: matches!(plan.hold, Hold::Fixed(_)),
                speed: 0.0,
            });
        }
        let rails = plans.iter().enumerate().filter_map(|(i, plan)| match &plan.hold {
            Hold::Joint(joint) if joint.follows.is_none() => {
                let (freedom, _) = trees.freedom(i)?;
                Some(Rail::new(i, joint, freedom, trees.tree(i)))
            }
            _ => None,
        });
        let rails = rails.collect();
        let pairs = pairs(plans, &pieces, &trees);
        let mut world = Self { bodies, trees, rails, patches: Vec::with_capacity(pairs.len()), pairs, pieces };
        world.locate();
        Ok(world)
    }

    /// Lets [`STEP`] pass.
    pub fn step(&mut self) {
        self.trees.drift(0.5 * STEP);
        self.trees.accelerate(&FREE_FALL.into(), STEP);
        self.locate();
        self.find_patches();
        let Self { trees, rails, patches, pairs, .. } = self;
        for rail in rails.iter_mut() {
            rail.begin(trees, STEP);
        }
        for _ in 0..SWEEPS {
            let mut largest = 0.0_f64;
            for (_, patch) in patches.iter_mut() {
                largest = largest.max(patch.relax(&mut trees.velocities));
            }
            for rail in rails.iter_mut() {
                largest = largest.max(rail.relax(trees, STEP));
            }
            if largest < CONVERGED {
                break;
            }
        }
        for (pair, patch) in patches.iter() {
            pairs[*pair].memory = patch.remember();
        }
        trees.drift(0.5 * STEP);
        trees.halt(STEP);
    }

    /// Lets a body that is [`Hold::Moved`] go to a pose within the next step; an arm that carries it is commanded to bring it
    /// there, and keeps the command of before where it cannot.
    pub fn move_to(&mut self, body: usize, pose: &Isometry3<f64>) {
        if let Some(arm) = self.trees.arm_mut(body) {
            arm.aim_at(pose, STEP);
            return;
        }
        let from = self.trees.pose(body);
        let velocity = (pose.translation.vector - from.translation.vector) / STEP;
        let spin = (pose.rotation * from.rotation.inverse()).scaled_axis() / STEP;
        self.trees.set_moved(body, velocity, spin, STEP);
    }

    /// Tells the arm that carries a body where its joints are to be [rad], and how fast [rad/s], for the next step; nothing happens
    /// to a body that no arm carries.
    pub fn aim(&mut self, body: usize, q_d: &Joints, dq_d: &Joints) {
        if let Some(arm) = self.trees.arm_mut(body) {
            arm.aim(*q_d, *dq_d);
        }
    }

    /// Where the joints of the arm that carries a body are [rad], and how fast [rad/s]; `None` where no arm does.
    pub fn arm(&self, body: usize) -> Option<JointState> {
        let arm = self.trees.arm(body)?;
        Some(JointState { q: arm.joints(&self.trees.positions), dq: arm.joints(&self.trees.velocities) })
    }

    /// Puts a body that is on no joint somewhere, at rest.
    pub fn put(&mut self, body: usize, pose: Isometry3<f64>) {
        self.trees.set_pose(body, pose);
        self.trees.set_twist(body, &Vector3::zeros(), &Vector3::zeros());
        self.trees.place();
        self.locate();
    }

    /// Gives two bodies a Coulomb friction of their own, in place of the larger one of theirs.
    pub fn set_friction(&mut self, bodies: [usize; 2], friction: f64) {
        let Self { pairs, pieces, .. } = self;
        for pair in pairs {
            let between = pair.pieces.map(|piece| pieces[piece].body);
            if between == bodies || between == [bodies[1], bodies[0]] {
                pair.friction = friction;
            }
        }
    }

    /// Pose of a body's origin.
    pub fn pose(&self, body: usize) -> Isometry3<f64> {
        *self.trees.pose(body)
    }

    /// Position of a body's joint [rad or m].
    pub fn joint(&self, body: usize) -> Option<f64> {
        self.trees.freedom(body).map(|(freedom, ratio)| ratio * self.trees.positions[freedom])
    }

    /// What moves a body's joint; nothing happens to a body without a drive.
    pub fn drive(&mut self, body: usize, target: f64, force: f64) {
        let driven = self.rails.iter_mut().filter(|rail| rail.body == body).filter_map(|rail| rail.drive.as_mut());
        driven.for_each(|drive| (drive.target, drive.force) = (target, force));
    }

    /// Where a body's joint is commanded to go [rad or m]; `None` for one without a drive.
    pub fn driven_to(&self, body: usize) -> Option<f64> {
        let rail = self.rails.iter().find(|rail| rail.body == body)?;
        rail.drive.map(|drive| drive.target)
    }

    /// Whether two bodies press on each other.
    pub fn touch(&self, first: usize, second: usize) -> bool {
        self.pairs.iter().any(|pair| {
            let [a, b] = pair.pieces.map(|piece| self.pieces[piece].body);
            ([a, b] == [first, second] || [b, a] == [first, second]) && pair.memory.load() > 0.0
        })
    }

    /// How fast the fastest point of a body moves, at most [m/s].
    pub fn speed(&self, body: usize) -> f64 {
        let [velocity, spin] = self.trees.twist(body);
        velocity.norm() + spin.norm() * self.bodies[body].radius
    }

    /// Two bodies that overlap now, where no joint connects them.
    pub fn overlap(&self) -> Option<[usize; 2]> {
        let overlapping = |pair: &&PiecePair| {
            let mut found_by = Search::NONE;
            let found = self.touching(pair.pieces, -OVERLAP, &mut found_by);
            found.is_some_and(|touching| touching.places().iter().any(|place| place.gap < -OVERLAP))
        };
        self.pairs.iter().find(overlapping).map(|pair| pair.pieces.map(|piece| self.pieces[piece].body))
    }

    /// How deep these bodies are in any that is held fast, at most [m]; 0 where they are in none.
    pub fn enters_fixed(&self, bodies: &[usize]) -> f64 {
        let of = |carried: bool| {
            let wanted = move |piece: &usize| {
                let body = self.pieces[*piece].body;
                if carried { bodies.contains(&body) } else { self.bodies[body].is_fixed }
            };
            (0..self.pieces.len()).filter(wanted)
        };
        let mut deepest = 0.0_f64;
        for (first, second) in of(true).flat_map(|first| of(false).map(move |second| (first, second))) {
            if let Some(found) = self.touching([first, second], 0.0, &mut Search::NONE.clone()) {
                deepest = found.places().iter().fold(deepest, |deepest, place| deepest.max(-place.gap));
            }
        }
        deepest
    }

    fn locate(&mut self) {
        for piece in &mut self.pieces {
            piece.at = self.trees.pose(piece.body) * piece.in_body;
            let turn = piece.at.rotation.to_rotation_matrix().into_inner();
            let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
            for corner in &piece.hull.corners {
                let place: Point3<f64> = (turn * corner.coords + piece.at.translation.vector).into();
                (low, high) = (low.inf(&place.coords), high.sup(&place.coords));
            }
            piece.bounds = [low, high];
        }
    }

    fn touching(&self, pieces: [usize; 2], within: f64, found_by: &mut Search) -> Option<Touching> {
        let [first, second] = pieces.map(|i| &self.pieces[i]);
        let apart = |a: &PieceNow, b: &PieceNow| (0..3).any(|k| a.bounds[0][k] > b.bounds[1][k] + within);
        if apart(first, second) || apart(second, first) {
            return None;
        }
        let [first, second] = [first, second].map(|piece| Located { hull: &piece.hull, at: &piece.at });
        touch::find(first, second, within, found_by)
    }

    fn find_patches(&mut self) {
        self.patches.clear();
        for body in 0..self.bodies.len() {
            self.bodies[body].speed = self.speed(body);
        }
        for i in 0..self.pairs.len() {
            let PiecePair { pieces, mut found_by, .. } = self.pairs[i];
            let [first, second] = pieces.map(|piece| self.pieces[piece].body);
            let within = NEAR_PIECES + STEP * (self.bodies[first].speed + self.bodies[second].speed);
            let found = self.touching(pieces, within, &mut found_by);
            let pair = &mut self.pairs[i];
            pair.found_by = found_by;
            let Some(touching) = found else {
                pair.memory = Memory::NONE;
                continue;
            };
            let pad = self.bodies[first].pad_radius.max(self.bodies[second].pad_radius);
            let mut patch = Patch::new(&touching, pair.friction, pad, &pair.memory, STEP);
            self.trees.connect(&mut patch, first, second);
            patch.begin(&mut self.trees.velocities);
            self.patches.push((i, patch));
        }
    }
}

/// Pieces that may touch: of bodies that move against each other and that no joint connects.
fn pairs(plans: &[BodyPlan], pieces: &[PieceNow], trees: &Trees) -> Vec<PiecePair> {
    let parent = |body: usize| match &plans[body].hold {
        Hold::Joint(joint) => joint.parent,
        _ => None,
    };
    let mut found = Vec::new();
    for i in 0..pieces.len() {
        for j in i + 1..pieces.len() {
            let (a, b) = (pieces[i].body, pieces[j].body);
            let moves = !trees.is_held(a) || !trees.is_held(b);
            if a != b && moves && parent(a) != Some(b) && parent(b) != Some(a) {
                let friction = plans[a].friction.max(plans[b].friction);
                found.push(PiecePair { pieces: [i, j], friction, found_by: Search::NONE, memory: Memory::NONE });
            }
        }
    }
    found
}
