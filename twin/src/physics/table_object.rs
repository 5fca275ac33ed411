//! The object on (or above) the table.
//!
//! While it stands flat it slides by [`crate::sliding`]; while it tips, tumbles or flies it is a free body with rigid
//! corners ([`super::tumble`]). What the outside sees is the body's pose, its velocities and what the tool presses on it;
//! which of the two carries the state shows nowhere else.

use super::hit::Press;
use super::push::Pushed;
use super::shape::{CollisionShape, FlatMesh};
use super::tumble::Tumbling;
use crate::effects::{Effects, SlideEffects, TableFriction};
use crate::scene::{ObjectModel, ObjectParameters};
use crate::sliding::{Ending, Footing, FreeBody, PlanarState, Solid, Wrench};
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use shared_mem::cell::Support;
use shared_mem::frames::{Base, Object, Pose};

/// The object, its table and the time step between them.
#[derive(Clone)]
pub struct TableObject {
    shape: CollisionShape,
    support: Support,
    made_of: Material,
    /// Drag of a viscous film under the base over its speed [N s/m].
    drag: f64,
    tumbling: Tumbling,
    motion: ObjectMotion,
}

/// Everything about an object's physics that is not its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Material {
    parameters: ObjectParameters,
    yaw_factor: f64,
    slide: SlideEffects,
}

/// Everything about an object that changes over time.
#[derive(Debug, Clone, Copy)]
pub struct ObjectMotion {
    body: FreeBody,
    /// How the body stands while it stands: its motion is this one's then.
    standing: Option<(Footing, PlanarState)>,
    /// It stands still and does so until something touches it.
    rests: bool,
    made_of: Material,
}

/// Gravity [m/s²]; the value the arm model uses too.
const GRAVITY: f64 = 9.81;
/// Longest step of a free body [s]: steps of a twelfth move the resting place of a tossed box by less than 0.2 mm.
const FREE_STEP: f64 = 1.25e-4;
/// Longest step under a film's drag [s].
const DRAG_STEP: f64 = 2.5e-4;

impl TableObject {
    /// The object at the origin, at rest. Without `table_height` there is no table and it falls. Of `effects` those on
    /// the object and its slide act.
    ///
    /// # Errors
    /// [`FlatMesh`] when the object's mesh has no convex hull.
    pub fn new(model: &ObjectModel, table_height: Option<f64>, effects: &Effects) -> Result<Self, FlatMesh> {
        let shape = CollisionShape::new(&model.shape)?;
        let made_of = Material::new(model.parameters(), effects);
        let tumbling = Tumbling {
            corners: vec![Vector3::zeros(); shape.corners.len()],
            mass: 1.0,
            inertia: Matrix3::identity(),
            inverse_inertia: Matrix3::identity(),
            table_height,
            friction: TableFriction { nominal: 0.0, effects: None },
            restitution: 0.0,
            gravity: Vector3::zeros(),
        };
        let body = FreeBody {
            centre: Point3::from(model.centre_of_mass),
            rotation: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        };
        let motion = ObjectMotion { body, standing: None, rests: false, made_of };
        let mut object = Self { shape, support: model.support, made_of, drag: 0.0, tumbling, motion };
        object.take(made_of);
        Ok(object)
    }

    /// The same shape made of something else. Pose and velocity stay those of the geometric centre.
    pub fn set_parameters(&mut self, parameters: ObjectParameters, effects: &Effects) {
        let made_of = Material::new(parameters, effects);
        if made_of != self.made_of {
            let (pose, velocity, spin) = (self.pose(), self.centre_velocity(), self.angular_velocity());
            self.take(made_of);
            self.set(&pose, velocity, spin);
        }
    }

    fn take(&mut self, made_of: Material) {
        let Material { parameters, yaw_factor, slide } = made_of;
        let mut inertia = self.shape.unit_inertia * parameters.mass;
        inertia[(2, 2)] *= yaw_factor;
        let tumbling = &mut self.tumbling;
        for (corner, place) in tumbling.corners.iter_mut().zip(&self.shape.corners) {
            *corner = place.coords - parameters.centre_of_mass;
        }
        (tumbling.mass, tumbling.inertia) = (parameters.mass, inertia);
        tumbling.inverse_inertia = inertia.try_inverse().unwrap_or_else(Matrix3::identity);
        let effects = (slide != SlideEffects::default()).then_some(slide);
        tumbling.friction = TableFriction { nominal: parameters.friction, effects };
        tumbling.restitution = parameters.restitution;
        tumbling.gravity = slide.gravity(GRAVITY);
        self.drag = slide.drag();
        (self.made_of, self.motion.made_of) = (made_of, made_of);
    }

    /// What it does now, to go on from later.
    #[must_use]
    pub fn motion(&self) -> &ObjectMotion {
        &self.motion
    }

    /// Goes on from a motion of this shape: bit by bit when it is made of the same as then, else from the same pose and
    /// velocity of its geometric centre.
    pub fn resume(&mut self, motion: &ObjectMotion) {
        if motion.made_of == self.made_of {
            self.motion = *motion;
            return;
        }
        let FreeBody { centre, rotation, velocity, angular_velocity } = motion.body;
        let from_mass = rotation * -motion.made_of.parameters.centre_of_mass;
        let pose = Pose::from_isometry(Isometry3::from_parts((centre + from_mass).into(), rotation));
        self.set(&pose, velocity + angular_velocity.cross(&from_mass), angular_velocity);
    }

    /// Lets `dt` seconds pass under gravity, the table and the tool's presses, of which those without depth do nothing;
    /// mean force of each press on the object [N]. A standing object takes a millisecond without presses in one go, a
    /// free one in steps of its own.
    pub fn step(&mut self, dt: f64, presses: &[Press]) -> [Vector3<f64>; 2] {
        // The film's drag is taken from the velocity at the start of a step.
        let parts = if self.drag > 0.0 { (dt / DRAG_STEP).ceil() } else { 1.0 };
        let mut forces = [Vector3::zeros(); 2];
        for _ in 0..parts as usize {
            let now = self.step_once(dt / parts, presses);
            forces = [0, 1].map(|i| forces[i] + now[i] / parts);
        }
        forces
    }

    fn step_once(&mut self, dt: f64, presses: &[Press]) -> [Vector3<f64>; 2] {
        let pressing = presses.iter().any(|press| press.touch.depth > 0.0);
        if self.motion.rests && !pressing {
            return [Vector3::zeros(); 2];
        }
        self.motion.rests = false;
        let (mut body, mut left) = (self.motion.body, dt);
        if let Some((footing, mut state)) = self.motion.standing
            && let Some(forces) = self.push(&footing, presses, pressing, dt)
        {
            let wrench = self.wrench(&footing, &body, presses, &forces);
            let ending = footing.slider.step(&mut state, &wrench, &self.tumbling.friction, dt);
            match ending {
                Ending::Rests | Ending::Slides => {
                    self.motion.standing = Some((footing, state));
                    self.motion.body = footing.release(&state);
                    self.motion.rests = ending == Ending::Rests && !pressing;
                    return forces;
                }
                Ending::Lifts { .. } if pressing => {}
                Ending::Lifts { left: rest } => (body, left) = (footing.release(&state), rest),
            }
        }
        let mut forces = [Vector3::zeros(); 2];
        if pressing {
            forces = self.tumbling.step(&mut body, presses, dt);
            left = 0.0;
        }
        let parts = (left / FREE_STEP).ceil();
        for _ in 0..parts as usize {
            self.tumbling.step(&mut body, &[], left / parts);
        }
        self.settle(body, presses, &forces, dt);
        forces
    }

    /// The presses' forces on a body that goes on standing; `None` when such a one could not give way to them.
    fn push(&self, footing: &Footing, presses: &[Press], pressing: bool, dt: f64) -> Option<[Vector3<f64>; 2]> {
        if !pressing {
            return Some([Vector3::zeros(); 2]);
        }
        let Footing { slider, .. } = footing;
        Pushed { body: &self.motion.body, mass: slider.mass, yaw_inertia: slider.yaw_inertia }.forces(presses, dt)
    }

    /// Takes over the state of a free body; as a standing one, if it stands and under these forces goes on standing.
    fn settle(&mut self, body: FreeBody, presses: &[Press], forces: &[Vector3<f64>; 2], dt: f64) {
        self.motion.standing = self.standing(&body, presses, forces, dt);
        self.motion.body = self.motion.standing.as_ref().map_or(body, |(footing, state)| footing.release(state));
    }

    fn standing(
        &self,
        body: &FreeBody,
        presses: &[Press],
        forces: &[Vector3<f64>; 2],
        dt: f64,
    ) -> Option<(Footing, PlanarState)> {
        let (footing, state) = Footing::find(&self.solid(), body, self.tumbling.table_height?)?;
        let wrench = self.wrench(&footing, body, presses, forces);
        let ending = footing.slider.step(&mut { state }, &wrench, &self.tumbling.friction, dt);
        (!matches!(ending, Ending::Lifts { .. })).then_some((footing, state))
    }

    /// What acts on a standing body but for the table's answer.
    fn wrench(&self, footing: &Footing, body: &FreeBody, presses: &[Press], forces: &[Vector3<f64>; 2]) -> Wrench {
        let weight = Wrench::weight(self.tumbling.mass, self.tumbling.gravity);
        let pushed = presses
            .iter()
            .zip(forces)
            .fold(weight, |sum, (press, force)| sum.with_force(*force, press.touch.point - body.centre));
        match self.tumbling.table_height {
            Some(height) if self.drag > 0.0 => {
                let middle = self.isometry_of(body).translation.vector - body.centre.coords;
                let lever = Vector3::new(middle.x, middle.y, height - body.centre.z);
                let velocity = body.velocity + body.angular_velocity.cross(&lever);
                let mut dragged = pushed.with_force(velocity * -self.drag, lever);
                dragged.moment.z -= self.drag * footing.slider.patch.gyration_squared() * body.angular_velocity.z;
                dragged
            }
            _ => pushed,
        }
    }

    /// Puts the object somewhere: pose of its geometric centre, velocity of that point [m/s], angular velocity [rad/s], base frame.
    pub fn set(&mut self, pose: &Pose<Base, Object>, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        let isometry = pose.isometry();
        let centre_to_mass = isometry.rotation * self.made_of.parameters.centre_of_mass;
        let body = FreeBody {
            centre: Point3::from(isometry.translation.vector + centre_to_mass),
            rotation: isometry.rotation,
            velocity: velocity + angular_velocity.cross(&centre_to_mass),
            angular_velocity,
        };
        self.motion.rests = false;
        self.settle(body, &[], &Default::default(), FREE_STEP);
    }

    /// Geometric centre in the base frame.
    #[must_use]
    pub fn pose(&self) -> Pose<Base, Object> {
        Pose::from_isometry(self.isometry())
    }

    /// Velocity of the body's point that is at `point` now, base frame [m/s].
    #[must_use]
    pub fn velocity_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.motion.body.velocity + self.motion.body.angular_velocity.cross(&(point - self.motion.body.centre))
    }

    /// Velocity of the geometric centre, base frame [m/s].
    #[must_use]
    pub fn centre_velocity(&self) -> Vector3<f64> {
        self.velocity_at(&Point3::from(self.isometry().translation.vector))
    }

    /// Angular velocity, base frame [rad/s].
    #[must_use]
    pub fn angular_velocity(&self) -> Vector3<f64> {
        self.motion.body.angular_velocity
    }

    /// Radius of a sphere around the geometric centre that holds the object [m].
    #[must_use]
    pub fn bounding_radius(&self) -> f64 {
        self.shape.bounding_radius
    }

    pub(super) fn isometry(&self) -> Isometry3<f64> {
        self.isometry_of(&self.motion.body)
    }

    pub(super) fn corners(&self) -> &[Point3<f64>] {
        &self.shape.corners
    }

    pub(super) fn half_extents(&self) -> Option<&Vector3<f64>> {
        self.shape.half_extents.as_ref()
    }

    /// Distance from the surface (negative inside), nearest point of it, and the outward direction; object frame.
    pub(super) fn signed_distance(&self, point: &Point3<f64>) -> (f64, Point3<f64>, Vector3<f64>) {
        self.shape.signed_distance(point)
    }

    fn isometry_of(&self, body: &FreeBody) -> Isometry3<f64> {
        Isometry3::from_parts(
            (body.centre - body.rotation * self.made_of.parameters.centre_of_mass).into(),
            body.rotation,
        )
    }

    fn solid(&self) -> Solid<'_> {
        Solid {
            corners: &self.shape.corners,
            centre_of_mass: self.made_of.parameters.centre_of_mass,
            mass: self.tumbling.mass,
            inertia: self.tumbling.inertia,
            support: self.support,
            pressure_reach: self.made_of.slide.pressure_reach(),
        }
    }
}

impl Material {
    fn new(parameters: ObjectParameters, effects: &Effects) -> Self {
        Self { parameters, yaw_factor: effects.hit.yaw_inertia_factor(), slide: effects.slide }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ObjectShape;

    const STEP: f64 = 2.5e-4;

    fn box_model(friction: f64, restitution: f64) -> ObjectModel {
        ObjectModel {
            shape: ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) },
            mass: 0.3,
            centre_of_mass: Vector3::new(0.005, -0.004, 0.003),
            friction,
            tip_friction: 0.2,
            restitution,
            support: Support::Corners,
        }
    }

    fn placed(model: &ObjectModel, pose: Isometry3<f64>, velocity: Vector3<f64>) -> TableObject {
        let mut object = TableObject::new(model, Some(0.0), &Effects::default()).expect("a box");
        object.set(&Pose::from_isometry(pose), velocity, Vector3::zeros());
        object
    }

    fn run(object: &mut TableObject, seconds: f64) {
        for _ in 0..(seconds / STEP).round() as usize {
            object.step(STEP, &[]);
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
    fn what_is_resumed_under_other_parameters_is_where_it_was() {
        let start = Isometry3::new(Vector3::new(0.5, 0.1, 0.05), Vector3::z() * 0.3);
        let mut object = placed(&box_model(0.3, 0.0), start, Vector3::x() * 0.2);
        let other = ObjectModel { mass: 0.5, centre_of_mass: Vector3::new(-0.01, 0.0, 0.0), ..box_model(0.3, 0.0) };
        for model in [other, box_model(0.3, 0.0)] {
            object.set_parameters(model.parameters(), &Effects::default());
            let motion = *object.motion();
            object.resume(&motion);
            let moved = start.inverse() * object.isometry();
            assert!(moved.translation.vector.norm() < 1e-9, "{}", moved.translation.vector);
            assert!((object.centre_velocity() - Vector3::x() * 0.2).norm() < 1e-9, "{}", object.centre_velocity());
        }
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
        let mut object = TableObject::new(&box_model(0.3, 0.0), None, &Effects::default()).expect("a box");
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
        let mut object = TableObject::new(&box_model(0.3, 0.0), None, &Effects::default()).expect("a box");
        let (velocity, spin) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, -2.0, 3.0));
        object.set(&Pose::from_isometry(turned), velocity, spin);
        let centre = Point3::from(turned.translation.vector);
        assert!((object.velocity_at(&centre) - velocity).norm() < 1e-12, "{}", object.velocity_at(&centre));
    }

    #[test]
    fn a_sliding_box_travels_as_coulomb_says() {
        let mut model = box_model(0.3, 0.0);
        model.centre_of_mass = Vector3::zeros();
        let mut object = placed(&model, Isometry3::translation(0.0, 0.0, 0.05), Vector3::x() * 0.6);
        run(&mut object, 1.0);
        let travel = object.pose().position()[0];
        let coulomb = 0.36 / (2.0 * 0.3 * 9.81);
        assert!((travel / coulomb - 1.0).abs() < 0.005, "{travel} m, Coulomb {coulomb} m");
    }

    #[test]
    fn a_box_on_a_grippy_table_topples_over_its_front_edge() {
        let start = Isometry3::translation(0.0, 0.0, 0.05);
        let mut object = placed(&box_model(1.5, 0.0), start, Vector3::x() * 1.2);
        run(&mut object, 2.0);
        assert!((height(&object) - 0.04).abs() < 2e-4, "{}", height(&object));
        assert!(object.angular_velocity() == Vector3::zeros());
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
        // On a corner right below the centre of mass: a flat landing has four impacts in one step, which act together.
        let mut model = box_model(0.0, 0.5);
        model.centre_of_mass = Vector3::zeros();
        let corner = -Vector3::new(0.04, 0.03, 0.05);
        let turn = UnitQuaternion::rotation_between(&corner, &-Vector3::z()).expect("not opposite");
        let start = Isometry3::from_parts(nalgebra::Translation3::new(0.0, 0.0, corner.norm() + 0.2), turn);
        let mut object = placed(&model, start, Vector3::zeros());
        run(&mut object, (2.0f64 * 0.2 / 9.81).sqrt() + 0.004);
        let mut top: f64 = 0.0;
        for _ in 0..1000 {
            object.step(STEP, &[]);
            top = top.max(height(&object) - corner.norm());
        }
        assert!((top / 0.2 - 0.25).abs() < 0.01, "rebound {top} m of 0.2 m");
    }
}
