//! The object on (or above) the table: a rapier world with one plane and one convex body.
//!
//! What the outside sees is the body's pose, its velocities and one push per step. The friction between object and
//! table acts inside [`TableObject::step`] and nowhere else, so an own sliding law takes rapier's place there.

use super::convert;
use super::settings;
use crate::scene::{ObjectModel, ObjectShape};
use nalgebra::{Isometry3, Point3, Vector3};
use rapier3d_f64::prelude::{
    ColliderBuilder, MassProperties, PhysicsWorld, RigidBody, RigidBodyBuilder, RigidBodyHandle, SharedShape, Vector,
};
use shared_mem::frames::{Base, Object, Pose};

/// The object, its table and the time step between them.
pub struct TableObject {
    world: PhysicsWorld,
    body: RigidBodyHandle,
    bounding_radius: f64,
}

/// A force on the object, constant over one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Force on the object, base frame [N].
    pub force: Vector3<f64>,
    /// Where it acts, base frame [m].
    pub point: Point3<f64>,
}

/// The mesh encloses no volume, so it cannot be a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the object's mesh is flat or empty; give a mesh that encloses a volume")]
pub struct FlatMesh;

impl TableObject {
    /// The object at the origin, at rest. Without `table_height` there is no table and it falls.
    ///
    /// # Errors
    /// [`FlatMesh`] when the object's mesh has no convex hull.
    pub fn new(model: &ObjectModel, table_height: Option<f64>) -> Result<Self, FlatMesh> {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, 0.0, -settings::GRAVITY);
        if let Some(height) = table_height {
            let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Z))
                .translation(Vector::new(0.0, 0.0, height))
                .friction(model.friction)
                .restitution(model.restitution);
            world.insert_collider(plane, None);
        }
        let shape = collision_shape(&model.shape)?;
        let collider = ColliderBuilder::new(shape.clone())
            .friction(model.friction) // both sides carry the same numbers, so rapier's averages return them
            .restitution(model.restitution)
            .mass_properties(homogeneous(&shape, model));
        let body = RigidBodyBuilder::dynamic()
            .can_sleep(false) // a sleeping box would swallow the first instants of a hit
            .gyroscopic_forces_enabled(true)
            .allow_fast_rotation(true);
        let (body, _) = world.insert(body, collider);
        Ok(Self { world, body, bounding_radius: model.shape.bounding_radius() })
    }

    /// Lets `dt` seconds pass under gravity, the table and `push`.
    pub fn step(&mut self, dt: f64, push: Option<Push>) {
        self.world.integration_parameters = settings::integration_parameters(dt);
        if let Some(Push { force, point }) = push {
            self.body_mut().apply_impulse_at_point(convert::vector(&(force * dt)), convert::point(&point), true);
        }
        self.world.step();
    }

    /// Puts the object somewhere: pose of its geometric centre, velocity of that point [m/s], angular velocity [rad/s], base frame.
    pub fn set(&mut self, pose: &Pose<Base, Object>, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        let body = self.body_mut();
        body.set_position(convert::pose(&pose.isometry()), true);
        let centre_to_mass = pose.isometry().rotation * convert::to_vector(body.local_center_of_mass());
        body.set_linvel(convert::vector(&(velocity + angular_velocity.cross(&centre_to_mass))), true);
        body.set_angvel(convert::vector(&angular_velocity), true);
    }

    /// Geometric centre in the base frame.
    #[must_use]
    pub fn pose(&self) -> Pose<Base, Object> {
        Pose::from_isometry(self.isometry())
    }

    /// Velocity of the body's point that is at `point` now, base frame [m/s].
    #[must_use]
    pub fn velocity_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        convert::to_vector(self.body().velocity_at_point(convert::point(point)))
    }

    /// Angular velocity, base frame [rad/s].
    #[must_use]
    pub fn angular_velocity(&self) -> Vector3<f64> {
        convert::to_vector(self.body().angvel())
    }

    /// Inertia that a force at `point` along the unit vector `direction` feels: `1 / (1/m + (r x n)' I^-1 (r x n))` [kg].
    #[must_use]
    pub fn effective_mass(&self, point: &Point3<f64>, direction: &Vector3<f64>) -> f64 {
        let body = self.body();
        let arm = convert::point(point) - body.center_of_mass();
        let lever = arm.cross(convert::vector(direction));
        let mass = body.mass_properties();
        let turned = mass.effective_world_inv_inertia * lever;
        1.0 / (mass.local_mprops.inv_mass + lever.dot(turned))
    }

    /// Radius of a sphere around the geometric centre that holds the object [m].
    #[must_use]
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    pub(super) fn isometry(&self) -> Isometry3<f64> {
        convert::to_isometry(self.body().position())
    }

    pub(super) fn shape(&self) -> &dyn rapier3d_f64::parry::shape::Shape {
        self.world.colliders[self.body().colliders()[0]].shape()
    }

    fn body(&self) -> &RigidBody {
        &self.world.bodies[self.body]
    }

    fn body_mut(&mut self) -> &mut RigidBody {
        &mut self.world.bodies[self.body]
    }
}

fn collision_shape(shape: &ObjectShape) -> Result<SharedShape, FlatMesh> {
    match shape {
        ObjectShape::Box { half_extents: h } => Ok(SharedShape::cuboid(h.x, h.y, h.z)),
        ObjectShape::Mesh { points, .. } => {
            let points: Vec<Vector> = points.iter().map(convert::point).collect();
            SharedShape::convex_hull(&points).ok_or(FlatMesh)
        }
    }
}

/// The homogeneous body's inertia, about the centre of mass wherever that was found to be.
fn homogeneous(shape: &SharedShape, model: &ObjectModel) -> MassProperties {
    let mut properties = shape.mass_properties(1.0);
    properties.set_mass(model.mass, true);
    properties.local_com = convert::vector(&model.centre_of_mass);
    properties
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    const STEP: f64 = 2.5e-4;

    fn box_model(friction: f64, restitution: f64) -> ObjectModel {
        ObjectModel {
            shape: ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) },
            mass: 0.3,
            centre_of_mass: Vector3::new(0.005, -0.004, 0.003),
            friction,
            tip_friction: 0.2,
            restitution,
        }
    }

    fn placed(model: &ObjectModel, pose: Isometry3<f64>, velocity: Vector3<f64>) -> TableObject {
        let mut object = TableObject::new(model, Some(0.0)).expect("a box");
        object.set(&Pose::from_isometry(pose), velocity, Vector3::zeros());
        object
    }

    fn run(object: &mut TableObject, seconds: f64) {
        for _ in 0..(seconds / STEP).round() as usize {
            object.step(STEP, None);
        }
    }

    fn height(object: &TableObject) -> f64 {
        object.pose().position()[2]
    }

    #[test]
    fn a_box_at_rest_stays_where_it_is() {
        let start = Isometry3::new(Vector3::new(0.5, 0.1, 0.05), Vector3::z() * 0.3);
        let mut object = placed(&box_model(0.3, 0.0), start, Vector3::zeros());
        run(&mut object, 2.0);
        let moved = start.inverse() * object.isometry();
        assert!(moved.translation.vector.norm() < 1e-4, "{}", moved.translation.vector);
        assert!(moved.rotation.angle() < 1e-3, "{}", moved.rotation.angle());
        let before = object.isometry();
        run(&mut object, 2.0);
        let crept = (before.inverse() * object.isometry()).translation.vector.norm();
        assert!(crept < 1e-6, "settled, then crept {crept} m");
    }

    #[test]
    fn a_dropped_box_does_not_hover() {
        let start = Isometry3::translation(0.0, 0.0, 0.06);
        let mut object = placed(&box_model(0.3, 0.0), start, Vector3::zeros());
        run(&mut object, 1.0);
        assert!((height(&object) - 0.05).abs() < 5e-5, "{}", height(&object));
    }

    #[test]
    fn a_falling_box_follows_gravity() {
        let mut object = TableObject::new(&box_model(0.3, 0.0), None).expect("a box");
        object.set(&Pose::from_isometry(Isometry3::translation(0.0, 0.0, 5.0)), Vector3::x(), Vector3::z() * 2.0);
        run(&mut object, 0.5);
        let fallen = 5.0 - height(&object);
        assert!((fallen - 0.5 * 9.81 * 0.25).abs() < 1e-3, "{fallen}");
        assert!((object.angular_velocity().z - 2.0).abs() < 1e-9);
    }

    #[test]
    fn velocities_are_those_of_the_geometric_centre() {
        let turned = Isometry3::from_parts(
            nalgebra::Translation3::new(0.3, 0.2, 1.0),
            UnitQuaternion::from_euler_angles(0.3, 0.2, 1.0),
        );
        let mut object = TableObject::new(&box_model(0.3, 0.0), None).expect("a box");
        let (velocity, spin) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, -2.0, 3.0));
        object.set(&Pose::from_isometry(turned), velocity, spin);
        let centre = Point3::from(turned.translation.vector);
        assert!((object.velocity_at(&centre) - velocity).norm() < 1e-12, "{}", object.velocity_at(&centre));
    }

    #[test]
    fn the_effective_mass_is_what_an_impulse_meets() {
        let mut object = placed(&box_model(0.0, 0.0), Isometry3::translation(0.0, 0.0, 1.0), Vector3::zeros());
        let (point, along) = (Point3::new(0.04, 0.02, 1.03), -Vector3::x());
        let mass = object.effective_mass(&point, &along);
        object.step(1e-9, Some(Push { force: along * 1e6, point }));
        let gained = object.velocity_at(&point).dot(&along);
        assert!((gained * mass / 1e-3 - 1.0).abs() < 1e-3, "{gained} m/s from 1e-3 N s on {mass} kg");
        assert!(mass < 0.3);
    }

    #[test]
    fn a_sliding_box_travels_within_a_tenth_of_coulomb() {
        // Without spin the travel is v^2 / (2 mu g). rapier solves each corner's friction as if it alone turned the box,
        // so the four forces do not point quite backwards: 9 % too far here, in every setting tried.
        let mut model = box_model(0.3, 0.0);
        model.centre_of_mass = Vector3::zeros();
        model.shape = ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.01) };
        let mut object = placed(&model, Isometry3::translation(0.0, 0.0, 0.01), Vector3::x() * 0.6);
        run(&mut object, 1.0);
        let travel = object.pose().position()[0];
        let coulomb = 0.36 / (2.0 * 0.3 * 9.81);
        assert!((travel / coulomb - 1.0).abs() < 0.1, "{travel} m, Coulomb {coulomb} m");
    }

    #[test]
    fn a_toppled_box_comes_to_rest_on_its_side() {
        let tilted = Isometry3::new(Vector3::new(0.0, 0.0, 0.2), Vector3::new(0.0, 1.2, 0.0));
        let mut object = placed(&box_model(0.4, 0.1), tilted, Vector3::new(0.5, 0.0, 0.0));
        run(&mut object, 3.0);
        assert!((height(&object) - 0.04).abs() < 2e-4, "{}", height(&object));
        assert!(object.velocity_at(&Point3::origin()).norm() < 1e-3);
    }

    #[test]
    fn a_bounce_returns_the_restitution() {
        // On a corner right below the centre of mass: a flat landing has four impacts in one step, which rapier adds up.
        let mut model = box_model(0.0, 0.5);
        model.centre_of_mass = Vector3::zeros();
        let corner = -Vector3::new(0.04, 0.03, 0.05);
        let turn = UnitQuaternion::rotation_between(&corner, &-Vector3::z()).expect("not opposite");
        let start = Isometry3::from_parts(nalgebra::Translation3::new(0.0, 0.0, corner.norm() + 0.2), turn);
        let mut object = placed(&model, start, Vector3::zeros());
        run(&mut object, (2.0f64 * 0.2 / 9.81).sqrt() + 0.004);
        let mut top: f64 = 0.0;
        for _ in 0..1000 {
            object.step(STEP, None);
            top = top.max(height(&object) - corner.norm());
        }
        assert!((top / 0.2 - 0.25).abs() < 0.01, "rebound {top} m of 0.2 m");
    }
}
