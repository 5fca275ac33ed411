//! Where objects stand when the simulated cell starts: where their blocks say, else each 5 cm beside the one before it. Base frame.

use crate::physics::Hull;
use crate::scene::{CellBody, ObjectShape, poses_in_root, start_of};
use crate::sim::SimError;
use crate::world::{BodyPlan, Hold, JointKind, JointPlan, Piece};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use shared_mem::cell::{Cell, Object, RootHold};

/// Between objects that have no `start` of their own [m].
const BESIDE: f64 = 0.05;

/// Pose of each object at the start; of one that moves in itself that of its root.
pub(super) fn starts(cell: &Cell, bodies: &[CellBody], table: f64) -> Vec<Isometry3<f64>> {
    let mut before: Option<([f64; 2], f64)> = None;
    let start = |(number, object): (usize, &Object)| {
        let (low, around) = extent(object, number, bodies);
        let beside = match before {
            None => cell.simulation.object_position,
            Some(([x, y], reach)) => [x, y + reach + BESIDE + around],
        };
        let [x, y] = object.start.unwrap_or(beside);
        before = Some(([x, y], around));
        let own_yaw = if number == 0 { cell.simulation.object_yaw } else { 0.0 };
        Isometry3::new(Vector3::new(x, y, table - low), Vector3::z() * object.start_yaw.unwrap_or(own_yaw))
    };
    cell.objects.iter().enumerate().map(start).collect()
}

/// Lowest point of an object under its origin, negative, and how far it reaches from there to the sides [m].
fn extent(object: &Object, number: usize, bodies: &[CellBody]) -> (f64, f64) {
    let own: Vec<&CellBody> = bodies.iter().filter(|body| body.object == number).collect();
    let (mut low, mut around) = (0.0_f64, 0.0_f64);
    for (body, pose) in own.iter().zip(poses_in_root(&own, |link| start_of(object, link))) {
        for point in body.surface().triangles().0 {
            let place = pose * point;
            low = low.min(place.z);
            around = around.max(place.x.hypot(place.y));
        }
    }
    (low, around)
}

/// The bodies of an object that moves in itself, for a world in which `before` bodies come before them.
///
/// # Errors
/// [`SimError::Body`] for a link without mass, inertia or volume.
pub(super) fn linked(
    object: &Object,
    own: &[&CellBody],
    root: Isometry3<f64>,
    before: usize,
) -> Result<Vec<BodyPlan>, SimError> {
    own.iter().map(|body| plan(object, body, root, before)).collect()
}

fn plan(object: &Object, body: &CellBody, root: Isometry3<f64>, before: usize) -> Result<BodyPlan, SimError> {
    let name = body.name.text();
    let fault = |what: &str| SimError::Body { name: name.to_owned(), what: what.to_owned() };
    let piece = |(at, shape): &(Isometry3<f64>, ObjectShape)| {
        let corners: Vec<Point3<f64>> = shape.triangles().0;
        let hull = Hull::of(&corners).ok_or_else(|| fault("a <collision> has no volume; give it one"))?;
        Ok(Piece::new(hull, *at))
    };
    let pieces = body.pieces.iter().map(piece).collect::<Result<Vec<_>, SimError>>()?;
    let (mut mass, mut centre_of_mass, mut inertia) = (0.0, Vector3::zeros(), Matrix3::zeros());
    let mut hold = if object.hold == RootHold::Fixed { Hold::Fixed(root) } else { Hold::Free(root) };
    if let Some(link) = &body.link {
        (mass, centre_of_mass, inertia) = (link.mass.mass, link.mass.centre, link.mass.inertia);
        if let Some(joint) = &link.joint {
            hold = Hold::Joint(JointPlan {
                parent: Some(before + joint.parent),
                at: joint.at,
                kind: if joint.slides { JointKind::Prismatic } else { JointKind::Revolute },
                axis: joint.axis,
                limits: joint.limits,
                start: start_of(object, link),
                friction: joint.friction,
                damping: joint.damping,
                drive: None,
                follows: None,
            });
        }
    }
    let moves = !matches!(hold, Hold::Fixed(_));
    let has_inertia = mass > 0.0 && inertia.cholesky().is_some();
    if moves && !has_inertia {
        return Err(fault("it moves and has no mass or inertia; give its link in the URDF an <inertial>"));
    }
    let friction = object.nominal_friction();
    Ok(BodyPlan { name: name.to_owned(), pieces, mass, centre_of_mass, inertia, friction, pad_radius: 0.0, hold })
}
