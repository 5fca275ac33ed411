//! Objects that move in themselves as bodies of one world. Base frame.

use crate::physics::Hull;
use crate::scene::{CellBody, ObjectShape, start_of};
use crate::sim::SimError;
use crate::world::{BodyPlan, Hold, JointKind, JointPlan, Piece};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use shared_mem::cell::{Object, RootHold};

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
