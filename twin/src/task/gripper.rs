//! Two fingers on geared joints as a gripper with an opening.

use crate::world::{BodyPlan, Hold, JointKind, JointPlan, World};
use shared_mem::msg::gripper::GripperState;

/// A finger that a drive slides, and the one that follows it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gripper {
    fingers: [usize; 2],
    /// Between the fingers at position 0 [m], and how that goes with the position.
    opening: f64,
    per_position: f64,
}

impl Gripper {
    /// The first of a task: a body that a drive slides, and one that follows it along the same line.
    pub(super) fn of(bodies: &[BodyPlan]) -> Option<Self> {
        bodies.iter().enumerate().find_map(|(i, finger)| {
            let joint = slides(finger).filter(|joint| joint.drive.is_some())?;
            let follows = |other: &BodyPlan| slides(other)?.follows.filter(|(leader, _)| *leader == i);
            let mut followers = bodies.iter().enumerate().filter_map(|(j, other)| Some((j, other, follows(other)?.1)));
            let (j, other, ratio) = followers.next().filter(|_| followers.next().is_none())?;
            let along = joint.at.rotation * joint.axis;
            let other_joint = slides(other)?;
            let other_along = other_joint.at.rotation * other_joint.axis;
            let ends = |body: &BodyPlan, joint: &JointPlan| {
                let corners = body
                    .pieces
                    .iter()
                    .flat_map(|piece| piece.hull.corners.iter().map(move |corner| joint.at * (piece.at * corner)));
                corners
                    .map(|corner| corner.coords.dot(&along))
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
            };
            let ([low, high], [other_low, other_high]) = (ends(finger, joint), ends(other, other_joint));
            let faster = 1.0 - ratio * along.dot(&other_along);
            // Whichever lies in front along the axis; the opening is that between the faces that look at each other.
            let (opening, per_position) =
                if low > other_high { (low - other_high, faster) } else { (other_low - high, -faster) };
            (opening > 0.0).then_some(Self { fingers: [i, j], opening, per_position })
        })
    }

    /// The finger with the drive.
    pub(super) fn drive(&self) -> usize {
        self.fingers[0]
    }

    /// Position and force that open or close it.
    pub(super) fn order(&self, bodies: &[BodyPlan], open: bool) -> Option<(f64, f64)> {
        let joint = slides(&bodies[self.fingers[0]])?;
        let [low, high] = joint.limits;
        let wider = self.per_position > 0.0;
        Some((if open == wider { high } else { low }, joint.drive?.force))
    }

    /// Position and force for an opening [m], as near to it as the fingers go.
    pub(super) fn order_width(&self, bodies: &[BodyPlan], width: f64) -> Option<(f64, f64)> {
        let joint = slides(&bodies[self.fingers[0]])?;
        let [low, high] = joint.limits;
        Some((((width - self.opening) / self.per_position).max(low).min(high), joint.drive?.force))
    }

    /// Opening when it is closed and when it is open, as far as it goes [m].
    pub(super) fn range(&self, bodies: &[BodyPlan]) -> Option<[f64; 2]> {
        let ends = slides(&bodies[self.fingers[0]])?.limits.map(|at| (self.opening + self.per_position * at).max(0.0));
        Some([ends[0].min(ends[1]), ends[0].max(ends[1])])
    }

    /// What it does now.
    pub(super) fn state(&self, world: &World, bodies: usize) -> Option<GripperState> {
        let [finger, other] = self.fingers;
        let width = |position: f64| (self.opening + self.per_position * position).max(0.0);
        let mut between = (0..bodies).filter(|body| !self.fingers.contains(body));
        Some(GripperState {
            width: width(world.joint(finger)?),
            width_d: width(world.driven_to(finger)?),
            force: f64::NAN,
            grasped: between.any(|body| world.touch(body, finger) && world.touch(body, other)).into(),
            ..GripperState::default()
        })
    }
}

fn slides(body: &BodyPlan) -> Option<&JointPlan> {
    match &body.hold {
        Hold::Joint(joint) if joint.kind == JointKind::Prismatic => Some(joint),
        _ => None,
    }
}
