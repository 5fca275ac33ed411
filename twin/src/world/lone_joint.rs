//! One part on its joint while nothing touches it: its weight, dry and viscous friction, and nothing else.
//!
//! `I q'' = load(q) - damping q' - friction sgn(q')`; where the part rests, friction holds it against a load up to its own size. `I` is
//! the inertia about a hinge's axis [kg m²] or the mass on a slide [kg]. The same law as a joint's in [`super::World`], for one
//! freedom and a parent that stays: fast enough to be fitted.

use crate::arm::{MassProperties, UrdfJoint};
use nalgebra::{UnitQuaternion, Vector3};
use shared_mem::cell::GRAVITY;

/// Longest step [s].
const STEP: f64 = 5e-4;

/// A part on a hinge or a slide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoneJoint {
    /// Inertia about the axis [kg m²], or mass [kg].
    pub inertia: f64,
    /// Dry friction [N m or N].
    pub friction: f64,
    /// Viscous friction [N m s/rad or N s/m].
    pub damping: f64,
    /// Parts of the load that go with the cosine of the position, with its sine, and with nothing.
    load: [f64; 3],
}

impl LoneJoint {
    /// Of a part, in its link's frame, on a joint of a URDF, with the friction of the file; `parent` turns the frame of the link that
    /// carries it into one whose z points up.
    pub fn new(joint: &UrdfJoint, part: &MassProperties, parent: &UnitQuaternion<f64>) -> Self {
        let axis = joint.axis.into_inner();
        let weight = (parent * joint.at.rotation).inverse() * Vector3::new(0.0, 0.0, -GRAVITY * part.mass);
        let UrdfJoint { friction, damping, .. } = *joint;
        if joint.slides {
            return Self { inertia: part.mass, friction, damping, load: [0.0, 0.0, axis.dot(&weight)] };
        }
        let across = part.centre - axis * axis.dot(&part.centre);
        let inertia = axis.dot(&(part.inertia * axis)) + part.mass * across.norm_squared();
        let moment = |lever: &Vector3<f64>| axis.dot(&lever.cross(&weight));
        Self { inertia, friction, damping, load: [moment(&across), moment(&axis.cross(&across)), 0.0] }
    }

    /// Torque or force of the weight at a position [N m or N].
    pub fn load(&self, position: f64) -> f64 {
        let [cosine, sine, constant] = self.load;
        cosine * position.cos() + sine * position.sin() + constant
    }

    /// Position and velocity some seconds later.
    pub fn after(&self, (mut position, mut velocity): (f64, f64), seconds: f64) -> (f64, f64) {
        let steps = (seconds / STEP).ceil().max(1.0);
        let dt = seconds / steps;
        // Midpoints: the load is taken half a step on, damping acts on the mean velocity.
        let halved = 0.5 * dt * self.damping / self.inertia;
        let dry = dt * self.friction / self.inertia / (1.0 + halved);
        for _ in 0..steps as usize {
            let load = self.load(position + 0.5 * dt * velocity) / self.inertia;
            let free = ((1.0 - halved) * velocity + dt * load) / (1.0 + halved);
            let next = if free.abs() <= dry { 0.0 } else { free - dry.copysign(free) };
            position += 0.5 * dt * (velocity + next);
            velocity = next;
        }
        (position, velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BodyPlan, Hold, JointKind, JointPlan, Piece, STEP as TICK, World, box_hull};
    use super::*;
    use nalgebra::{Isometry3, Unit};

    const AT: [f64; 3] = [0.3, 0.2, 0.1];

    fn joint(slides: bool, friction: f64, damping: f64) -> UrdfJoint {
        let at = Isometry3::new(Vector3::new(0.1, 0.0, 0.2), Vector3::from(AT));
        let axis = Unit::new_normalize(Vector3::new(0.2, -1.0, 0.3));
        UrdfJoint { name: "j".into(), parent: 0, at, slides, axis, limits: [-9.0, 9.0], friction, damping }
    }

    /// The same in a world of bodies, from rest at `start`.
    fn world(joint: &UrdfJoint, start: f64) -> (World, MassProperties) {
        let plan = JointPlan {
            parent: None,
            at: joint.at,
            kind: if joint.slides { JointKind::Prismatic } else { JointKind::Revolute },
            axis: joint.axis,
            limits: joint.limits,
            start,
            friction: joint.friction,
            damping: joint.damping,
            drive: None,
            follows: None,
        };
        let piece = Piece::new(box_hull([0.3, 0.2, 0.05]).expect("a box"), Isometry3::translation(0.1, 0.05, 0.2));
        let body = BodyPlan::homogeneous("part", vec![piece], 0.4, Hold::Joint(plan));
        let part = MassProperties { mass: body.mass, centre: body.centre_of_mass, inertia: body.inertia };
        (World::new(&[body]).expect("a world"), part)
    }

    #[test]
    fn a_part_moves_and_stops_as_in_a_world_of_bodies() {
        for slides in [false, true] {
            for (friction, damping, start) in [(0.0, 0.0, 1.3), (0.1, 0.0, 1.3), (0.0, 0.05, -0.8), (0.1, 0.03, 1.2)] {
                let joint = joint(slides, friction, damping);
                let (mut world, part) = world(&joint, start);
                let alone = LoneJoint::new(&joint, &part, &UnitQuaternion::identity());
                let mut state = (start, 0.0);
                let mut way = 0.0_f64;
                for _ in 0..15 {
                    (0..100).for_each(|_| world.step());
                    state = alone.after(state, 100.0 * TICK);
                    let asked = world.joint(0).expect("a joint");
                    way = way.max((asked - start).abs());
                    assert!((state.0 - asked).abs() < 2e-3 * way, "{slides} {friction} {damping}: {} {asked}", state.0);
                }
                assert!(way > 0.3, "{slides} {friction} {damping}: {way}");
            }
        }
    }

    #[test]
    fn what_friction_can_hold_stays_and_a_push_ends_where_energy_says() {
        let (_, part) = world(&joint(false, 0.0, 0.0), 0.0);
        let load = LoneJoint::new(&joint(false, 0.0, 0.0), &part, &UnitQuaternion::identity()).load(0.7);
        let holds = |friction: f64| {
            let alone = LoneJoint::new(&joint(false, friction, 0.0), &part, &UnitQuaternion::identity());
            alone.after((0.7, 0.0), 5.0).0 == 0.7
        };
        assert!(holds(load.abs() * 1.001) && !holds(load.abs() * 0.999));
        // Level: the weight does no work.
        let level = UrdfJoint { axis: Vector3::x_axis(), at: Isometry3::identity(), ..joint(true, 1.2, 0.0) };
        let alone = LoneJoint::new(&level, &part, &UnitQuaternion::identity());
        let (end, velocity) = alone.after((0.3, -0.5), 3.0);
        let asked = 0.3 - 0.5 * 0.25 * part.mass / 1.2;
        assert!((end - asked).abs() < 1e-5 && velocity == 0.0, "{end} {asked}");
    }
}
