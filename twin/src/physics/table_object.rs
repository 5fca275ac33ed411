//! The object on (or above) the table.
//!
//! While it stands flat it slides by [`crate::sliding`]; while it tips, tumbles or flies it is a free body with rigid
//! corners ([`super::tumble`]). What the outside sees is the body's pose, its velocities and what the tool presses on it;
//! which of the two carries the state shows nowhere else.

#[cfg(test)]
mod tests;

use super::hit::Press;
use super::hull::Hull;
use super::material::Material;
use super::shape::{CollisionShape, FlatMesh};
use super::tumble::Tumbling;
use crate::scene::ObjectModel;
use crate::sliding::{BASE, Closeness, Ending, Footing, FreeBody, PlanarState, SlidingFriction, Solid};
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use shared_mem::cell::Support;
use shared_mem::frames::{Base, Object, Pose};

/// The object, its table and the time step between them; `F` is the law of friction between the two.
#[derive(Clone)]
pub struct TableObject<F> {
    shape: CollisionShape,
    support: Support,
    tumbling: Tumbling<F>,
    motion: ObjectMotion<F>,
}

/// Everything about an object that changes over time.
#[derive(Debug, Clone, Copy)]
pub struct ObjectMotion<F> {
    body: FreeBody,
    /// How the body stands while it stands: its motion is this one's then.
    standing: Option<(Footing, PlanarState)>,
    /// It stands still and does so until something touches it.
    rests: bool,
    /// Where the table is from the face on which it stands or last stood, object axes.
    down: Vector3<f64>,
    made_of: Material<F>,
}

/// Longest step of a free body [s]: steps of a twelfth move the resting place of a tossed box by less than 0.2 mm.
const FREE_STEP: f64 = 1.25e-4;
/// Longest step under a film's drag [s].
const DRAG_STEP: f64 = 2.5e-4;
/// Longest step under a tool that pushes steadily, of a standing object and of one that leans on an edge [s]. A tenth of
/// the one and a fifth of the other move the resting places of 48 strokes by 0.07 mm in the median; half the step of the
/// hit before moves them by 0.2 mm.
const PUSHED_STEP: f64 = 1e-3;
const LEANING_STEP: f64 = 3.4e-4;
/// What leans more than this topples [rad]: it no longer pivots about where its base presses, but meets the table with its
/// corners.
const TOPPLES: f64 = 0.3;

impl<F: SlidingFriction> TableObject<F> {
    /// A body of the model's shape at the origin, at rest. Without `table_height` there is no table and it falls.
    ///
    /// # Errors
    /// [`FlatMesh`] when the object's mesh has no convex hull.
    pub fn new(model: &ObjectModel, made_of: Material<F>, table_height: Option<f64>) -> Result<Self, FlatMesh> {
        let shape = CollisionShape::new(&model.shape)?;
        let tumbling = Tumbling {
            corners: vec![Vector3::zeros(); shape.corners.len()],
            inertia: Matrix3::identity(),
            inverse_inertia: Matrix3::identity(),
            table_height,
            made_of,
        };
        let body = FreeBody {
            centre: Point3::from(made_of.parameters.centre_of_mass),
            rotation: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        };
        let motion = ObjectMotion { body, standing: None, rests: false, down: -Vector3::z(), made_of };
        let mut object = Self { shape, support: model.support, tumbling, motion };
        object.take(made_of);
        Ok(object)
    }

    /// The same shape made of something else. Pose and velocity stay those of the geometric centre.
    pub fn set_material(&mut self, made_of: Material<F>) {
        if made_of != self.tumbling.made_of {
            let (pose, velocity, spin) = (self.pose(), self.centre_velocity(), self.angular_velocity());
            self.take(made_of);
            self.set(&pose, velocity, spin);
        }
    }

    fn take(&mut self, made_of: Material<F>) {
        let mut inertia = self.shape.unit_inertia * made_of.parameters.mass;
        inertia[(2, 2)] *= made_of.yaw_inertia_factor;
        let tumbling = &mut self.tumbling;
        tumbling.inertia = inertia;
        tumbling.inverse_inertia = inertia.try_inverse().unwrap_or_else(Matrix3::identity);
        (tumbling.made_of, self.motion.made_of) = (made_of, made_of);
        self.place_corners();
    }

    /// The corners about which it pivots: those of the base on which it stood nearer to the middle, where it presses there.
    fn place_corners(&mut self) {
        let (corners, down) = (&self.shape.corners, self.motion.down);
        let lowest = corners.iter().map(|p| p.coords.dot(&down)).fold(f64::NEG_INFINITY, f64::max);
        let made_of = &self.tumbling.made_of;
        let (pivots, centre_of_mass) = (made_of.pivot_reach, made_of.parameters.centre_of_mass);
        let lean = (self.motion.body.rotation * down).angle(&-Vector3::z());
        let in_base = |p: &Point3<f64>| pivots != 1.0 && lean < TOPPLES && p.coords.dot(&down) > lowest - BASE;
        let base = || corners.iter().filter(|p| in_base(p)).map(|p| p.coords);
        let middle = base().sum::<Vector3<f64>>() / base().count().max(1) as f64;
        for (corner, place) in self.tumbling.corners.iter_mut().zip(corners) {
            let from = if in_base(place) { middle + (place.coords - middle) * pivots } else { place.coords };
            *corner = from - centre_of_mass;
        }
    }

    /// What it does now, to go on from later.
    pub fn motion(&self) -> &ObjectMotion<F> {
        &self.motion
    }

    /// Goes on from a motion of this shape: bit by bit when it is made of the same as then, else from the same pose and
    /// velocity of its geometric centre.
    pub fn resume(&mut self, motion: &ObjectMotion<F>) {
        if motion.made_of == self.tumbling.made_of {
            self.motion = *motion;
            self.find_base();
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
        let parts = if self.tumbling.made_of.drag > 0.0 { (dt / DRAG_STEP).ceil() } else { 1.0 };
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
        let Self { tumbling, motion, .. } = self;
        if let Some((footing, state)) = &mut motion.standing
            && let Some(forces) = tumbling.push((footing, state), &body, presses, dt)
        {
            let before = *state;
            let mut wrench = tumbling.wrench(footing, &body, presses, &forces);
            if pressing && !presses[0].steady && !state.is_at_rest() {
                // Against the push of a hit the friction of so short a step is nothing: it acts on the speed after it.
                footing.slider.kick(state, &mut wrench, dt);
            }
            let ending = footing.slider.step(state, &wrench, &tumbling.made_of.friction, dt);
            match ending {
                Ending::Rests | Ending::Slides => {
                    motion.body = footing.release(state);
                    motion.rests = ending == Ending::Rests && !pressing;
                    return forces;
                }
                Ending::Lifts { .. } if pressing => *state = before,
                Ending::Lifts { left: rest } => (body, left) = (footing.release(state), rest),
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
        self.settle(body, presses, dt);
        forces
    }

    /// Takes over the state of a free body; as a standing one, if it stands and goes on standing under what then presses.
    fn settle(&mut self, body: FreeBody, presses: &[Press], dt: f64) {
        self.motion.standing = self.standing(&body, presses, dt);
        self.motion.body = self.motion.standing.as_ref().map_or(body, |(footing, state)| footing.release(state));
        self.find_base();
    }

    /// Notes on which face it stands, and what it pivots about there.
    fn find_base(&mut self) {
        if self.tumbling.made_of.pivot_reach == 1.0 {
            return;
        }
        if self.motion.standing.is_some() {
            self.motion.down = self.motion.body.rotation.inverse() * -Vector3::z();
        }
        self.place_corners();
    }

    fn standing(&self, body: &FreeBody, presses: &[Press], dt: f64) -> Option<(Footing, PlanarState)> {
        let pressing = presses.iter().any(|press| press.touch.depth > 0.0);
        let closeness = if pressing { Closeness::FLAT } else { Closeness::LANDED };
        let (footing, state) = Footing::find(&self.solid(), body, self.tumbling.table_height?, closeness)?;
        let forces = self.tumbling.push((&footing, &state), body, presses, dt)?;
        let wrench = self.tumbling.wrench(&footing, body, presses, &forces);
        let ending = footing.slider.step(&mut { state }, &wrench, &self.tumbling.made_of.friction, dt);
        (!matches!(ending, Ending::Lifts { .. })).then_some((footing, state))
    }

    /// Longest step that follows the object under a tool that pushes steadily [s].
    pub fn pushed_step(&self) -> f64 {
        if self.motion.standing.is_some() { PUSHED_STEP } else { LEANING_STEP }
    }

    /// Puts the object somewhere: pose of its geometric centre, velocity of that point [m/s], angular velocity [rad/s], base frame.
    pub fn set(&mut self, pose: &Pose<Base, Object>, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        let isometry = pose.isometry();
        let centre_to_mass = isometry.rotation * self.centre_of_mass();
        let body = FreeBody {
            centre: Point3::from(isometry.translation.vector + centre_to_mass),
            rotation: isometry.rotation,
            velocity: velocity + angular_velocity.cross(&centre_to_mass),
            angular_velocity,
        };
        self.motion.rests = false;
        self.settle(body, &[], FREE_STEP);
    }

    /// Geometric centre in the base frame.
    pub fn pose(&self) -> Pose<Base, Object> {
        Pose::from_isometry(self.isometry())
    }

    /// Velocity of the body's point that is at `point` now, base frame [m/s].
    pub fn velocity_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.motion.body.velocity + self.motion.body.angular_velocity.cross(&(point - self.motion.body.centre))
    }

    /// Velocity of the geometric centre, base frame [m/s].
    pub fn centre_velocity(&self) -> Vector3<f64> {
        self.velocity_at(&Point3::from(self.isometry().translation.vector))
    }

    /// Whether it stands still and does so until something touches it.
    pub fn rests(&self) -> bool {
        self.motion.rests
    }

    /// Angular velocity, base frame [rad/s].
    pub fn angular_velocity(&self) -> Vector3<f64> {
        self.motion.body.angular_velocity
    }

    /// Radius of a sphere around the geometric centre that holds the object [m].
    pub fn bounding_radius(&self) -> f64 {
        self.shape.bounding_radius
    }

    /// Its convex hull, for a world of many bodies; `None` where it has none. One with more than 64 directions of edges, of which a
    /// step there would have to ask each pair, is replaced by that of its outermost corners.
    pub fn hull(&self) -> Option<Hull> {
        self.shape.hull()
    }

    pub(super) fn isometry(&self) -> Isometry3<f64> {
        let FreeBody { centre, rotation, .. } = self.motion.body;
        Isometry3::from_parts((centre - rotation * self.centre_of_mass()).into(), rotation)
    }

    pub(super) fn shape(&self) -> &CollisionShape {
        &self.shape
    }

    fn centre_of_mass(&self) -> Vector3<f64> {
        self.tumbling.made_of.parameters.centre_of_mass
    }

    fn solid(&self) -> Solid<'_> {
        Solid {
            corners: &self.shape.corners,
            centre_of_mass: self.centre_of_mass(),
            mass: self.tumbling.made_of.parameters.mass,
            inertia: self.tumbling.inertia,
            support: self.support,
            pressure_reach: self.tumbling.made_of.pressure_reach,
        }
    }
}
