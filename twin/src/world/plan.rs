//! What a world is made of: bodies of convex pieces, and what holds each. Own axes of a body unless said otherwise, SI.

use super::arm::ArmPlan;
use crate::physics::Hull;
use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};
use std::sync::Arc;

/// Sides of the prism that stands for a cylinder: its rim is nowhere more than 0.9 % of the radius inside the circle.
const SIDES: usize = 24;

/// One convex piece of a body.
#[derive(Debug, Clone)]
pub struct Piece {
    pub hull: Arc<Hull>,
    /// Where it is in the body.
    pub at: Isometry3<f64>,
}

/// A rigid body.
#[derive(Debug, Clone)]
pub struct BodyPlan {
    /// For errors and answers.
    pub name: String,
    /// What it is made of; may be nothing for a link without a surface.
    pub pieces: Vec<Piece>,
    /// Mass [kg]; of no matter where the body is held fast or moved. What an arm carries adds to the arm.
    pub mass: f64,
    /// Centre of mass [m].
    pub centre_of_mass: Vector3<f64>,
    /// Inertia about the centre of mass [kg m²].
    pub inertia: Matrix3<f64>,
    /// Coulomb friction; of two bodies that touch, the larger one counts.
    pub friction: f64,
    /// Radius of the disc with which a soft surface, such as a finger's pad, touches wherever it touches [m]: what resists
    /// a turn about the normal there, 2/3 of it being the lever of an even pressure. 0 for a hard body; of two, the larger counts.
    pub pad_radius: f64,
    /// What holds it.
    pub hold: Hold,
}

/// What holds a body.
#[derive(Debug, Clone)]
pub enum Hold {
    /// Nothing moves it.
    Fixed(Isometry3<f64>),
    /// It goes where [`super::World::move_to`] says, whatever is in its way.
    Moved(Isometry3<f64>),
    /// An arm, which gives way to what touches it; it goes where [`super::World::move_to`] or [`super::World::aim`] tell its
    /// controller.
    Arm(Box<ArmPlan>),
    /// Nothing but contacts; where it starts.
    Free(Isometry3<f64>),
    Joint(JointPlan),
}

/// A joint between a body and the one that carries it.
#[derive(Debug, Clone)]
pub struct JointPlan {
    /// Index of the body that carries this one, an earlier one; `None`: the world does.
    pub parent: Option<usize>,
    /// Pose of the body in its parent, or in the world, at position 0.
    pub at: Isometry3<f64>,
    /// Turns or slides.
    pub kind: JointKind,
    /// Through the body's origin, own axes.
    pub axis: Unit<Vector3<f64>>,
    /// Least and largest position [rad or m].
    pub limits: [f64; 2],
    /// Where it starts.
    pub start: f64,
    /// Dry friction [N m or N].
    pub friction: f64,
    /// Viscous friction [N m s/rad or N s/m].
    pub damping: f64,
    /// What moves it.
    pub drive: Option<Drive>,
    /// Index of a body on a joint of the same tree, and how many times its position this one has: geared together, both have
    /// one freedom. Limits, friction, damping and drive are those of the other.
    pub follows: Option<(usize, f64)>,
}

/// Turns or slides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// About its axis.
    Revolute,
    /// Along its axis.
    Prismatic,
}

/// A motor that goes to a position at a speed, as long as that takes no more than its force: a gripper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Where to [rad or m].
    pub target: f64,
    /// How fast at most [rad/s or m/s].
    pub speed: f64,
    /// How strong at most [N m or N]. Two fingers geared together press with half of it each.
    pub force: f64,
}

/// A world that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("body `{body}`: `{key}`: {what}")]
pub struct PlanError {
    pub body: String,
    /// What of it, as it is called in a task file.
    pub key: &'static str,
    /// What is wrong and what would do.
    pub what: String,
}

impl BodyPlan {
    /// A body of evenly spread mass.
    pub fn homogeneous(name: &str, pieces: Vec<Piece>, mass: f64, hold: Hold) -> Self {
        let volume: f64 = pieces.iter().map(|piece| piece.hull.volume).sum();
        let centre = |piece: &Piece| (piece.at * piece.hull.centroid).coords;
        let share = |piece: &Piece| piece.hull.volume / volume;
        let centre_of_mass: Vector3<f64> = pieces.iter().map(|piece| centre(piece) * share(piece)).sum();
        let inertia = pieces.iter().fold(Matrix3::zeros(), |sum, piece| {
            let turn = piece.at.rotation.to_rotation_matrix().into_inner();
            let away = centre(piece) - centre_of_mass;
            let offset = Matrix3::from_diagonal_element(away.norm_squared()) - away * away.transpose();
            sum + (turn * piece.hull.unit_inertia * turn.transpose() + offset) * (mass * share(piece))
        });
        Self { name: name.into(), pieces, mass, centre_of_mass, inertia, friction: 0.0, pad_radius: 0.0, hold }
    }

    /// The force of its joint's drive, where it has one [N or N m].
    pub fn drive_force(&self) -> Option<f64> {
        match &self.hold {
            Hold::Joint(joint) => joint.drive.map(|drive| drive.force),
            _ => None,
        }
    }

    /// The same with a friction.
    pub fn with_friction(self, friction: f64) -> Self {
        Self { friction, ..self }
    }

    /// The same in a world in which so many more bodies come before it and the one that carries it.
    pub fn hanging(mut self, behind: usize) -> Self {
        if let Hold::Joint(JointPlan { parent: Some(parent), .. }) = &mut self.hold {
            *parent += behind;
        }
        self
    }

    pub(super) fn check(&self, index: usize, bodies: &[Self]) -> Result<(), PlanError> {
        let fault = |key, what: String| Err(PlanError { body: self.name.clone(), key, what });
        let movable = matches!(self.hold, Hold::Free(_) | Hold::Joint(_));
        if movable && !(self.mass > 0.0 && self.mass.is_finite()) {
            return fault("mass", format!("it is {}; give a positive number of kilograms", self.mass));
        }
        if movable && self.inertia.cholesky().is_none() {
            return fault("piece", "the body has no inertia; give it a piece".into());
        }
        let Hold::Joint(joint) = &self.hold else { return Ok(()) };
        if joint.parent.is_some_and(|parent| parent >= index) {
            return fault("parent", "the body that carries it has to stand before it".into());
        }
        if let Some((other, _)) = joint.follows {
            let leads = |led: &Self| matches!(&led.hold, Hold::Joint(led) if led.follows.is_none() && led.parent == joint.parent);
            if other >= index || !leads(&bodies[other]) {
                let what = "it has to be an earlier body on a joint with the same parent, which follows none";
                return fault("follows", what.into());
            }
            return Ok(());
        }
        let [low, high] = joint.limits;
        if !(low < high && low.is_finite() && high.is_finite()) {
            return fault("limits", format!("[{low}, {high}] is no range; give the least and the largest position"));
        }
        if !(low..=high).contains(&joint.start) {
            return fault(
                "start",
                format!("the joint starts at {}, outside of its limits {low} to {high}", joint.start),
            );
        }
        Ok(())
    }
}

impl Piece {
    /// A piece whose axes are the body's.
    pub fn new(hull: Hull, at: Isometry3<f64>) -> Self {
        Self { hull: Arc::new(hull), at }
    }
}

/// A box around the origin with edges of these lengths [m]; `None` where one has none.
pub fn box_hull(size: [f64; 3]) -> Option<Hull> {
    let corners = (0..8).map(|i| {
        let side = |axis: usize| if i >> axis & 1 == 0 { -0.5 } else { 0.5 } * size[axis];
        Point3::new(side(0), side(1), side(2))
    });
    Hull::of(&corners.collect::<Vec<_>>())
}

/// A cylinder around the origin along z, as a prism inside of it with faces across x and y [m]; `None` where it has no volume.
pub fn cylinder_hull(radius: f64, length: f64) -> Option<Hull> {
    let corners = (0..2 * SIDES).map(|i| {
        let (sin, cos) = (((i / 2) as f64 + 0.5) * std::f64::consts::TAU / SIDES as f64).sin_cos();
        Point3::new(radius * cos, radius * sin, if i % 2 == 0 { -0.5 } else { 0.5 } * length)
    });
    Hull::of(&corners.collect::<Vec<_>>())
}
