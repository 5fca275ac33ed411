//! A rigid body that flies, tips or tumbles over a rigid table, with or without a tool against it.
//!
//! Velocities change by impulses at the places that touch within the step (Stewart and Trinkle 1996): a corner of the
//! convex hull may not sink into the table, a place under the tool must give way as the contact law asks, nothing is
//! pulled, and friction stops a slip or reaches Coulomb's cone. All impulses of a step are found together
//! ([`super::impulses`]), because they act together: a box that is struck above its centre of mass leans on its front edge
//! at once, and what the tool meets is the box with the table behind it.
//!
//! Base frame, SI. Called by [`super::TableObject`] while the body does not stand.

use super::hit::Press;
use super::impulses::{Contact, Impulses};
use super::material::Material;
use crate::sliding::{FreeBody, SlidingFriction};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The body and the table below it.
#[derive(Debug, Clone)]
pub(super) struct Tumbling<F> {
    /// Corners of the convex hull from the centre of mass, object axes [m].
    pub(super) corners: Vec<Vector3<f64>>,
    /// Inertia about the centre of mass, object axes [kg m²].
    pub(super) inertia: Matrix3<f64>,
    pub(super) inverse_inertia: Matrix3<f64>,
    /// Height of the table [m]; `None`: there is none.
    pub(super) table_height: Option<f64>,
    pub(super) made_of: Material<F>,
}

/// Places that touch at one time: a box's corners and both ends of the tool's line, or those of a mesh. A flat base has
/// more only on meshes finer than needed.
const OF_BOX: usize = 10;
const OF_MESH: usize = 34;
/// Corners that arrive slower than this do not bounce [m/s], so that a body comes to rest.
const BOUNCE_SPEED: f64 = 0.05;
/// A sunken corner leaves by this share of its depth in a step, and no faster than [`PUSH_OUT`] [m/s].
const RECOVERY: f64 = 0.1;
const PUSH_OUT: f64 = 0.02;
/// A corner nearer to the table than this touches it [m].
const TOUCHING: f64 = 1e-9;

impl<F: SlidingFriction> Tumbling<F> {
    /// Moves `body` by one short step under gravity, the table and the tool; mean force of each press on the body [N].
    pub(super) fn step(&self, body: &mut FreeBody, presses: &[Press], dt: f64) -> [Vector3<f64>; 2] {
        if self.corners.len() + 2 <= OF_BOX {
            self.step_of::<OF_BOX>(body, presses, dt)
        } else {
            self.step_of::<OF_MESH>(body, presses, dt)
        }
    }

    fn step_of<const N: usize>(&self, body: &mut FreeBody, presses: &[Press], dt: f64) -> [Vector3<f64>; 2] {
        let turn = body.rotation.to_rotation_matrix().into_inner();
        let (velocity, spin) = (body.velocity, body.angular_velocity);
        let gyroscopic = spin.cross(&(turn * (self.inertia * (turn.transpose() * spin))));
        let inverse_inertia = turn * self.inverse_inertia * turn.transpose();
        body.velocity += self.made_of.gravity * dt;
        body.angular_velocity -= inverse_inertia * gyroscopic * dt;
        let mut impulses = Impulses::<N>::on(body, 1.0 / self.made_of.parameters.mass, inverse_inertia);
        for press in presses.iter().filter(|press| press.touch.depth > 0.0) {
            let lever = press.touch.point - impulses.centre();
            let before = velocity + spin.cross(&lever);
            impulses.add(press.contact(lever, before, dt));
        }
        self.add_corners(&mut impulses, &turn, dt);
        impulses.settle();
        if self.made_of.friction.turns_aside() {
            impulses.turn_aside(|place, slip| self.made_of.friction.aside(place, slip));
        }
        let (mut forces, touched) = ([Vector3::zeros(); 2], !impulses.is_empty());
        let pressing = forces.iter_mut().zip(presses).filter(|(_, press)| press.touch.depth > 0.0);
        pressing.zip(impulses.iter()).for_each(|((force, _), impulse)| *force = impulse / dt);
        // In free flight the mean velocity is exact; where something touches, the last one is what the contacts allow.
        let travelling = if touched { body.velocity } else { (velocity + body.velocity) * 0.5 };
        body.centre += travelling * dt;
        body.rotation = UnitQuaternion::from_scaled_axis(body.angular_velocity * dt) * body.rotation;
        forces
    }

    /// Adds the corners that would be in the table at the end of the step.
    fn add_corners<const N: usize>(&self, impulses: &mut Impulses<'_, N>, turn: &Matrix3<f64>, dt: f64) {
        let Some(table) = self.table_height else { return };
        let restitution = self.made_of.parameters.restitution;
        for corner in &self.corners {
            let lever = turn * corner;
            let velocity = impulses.velocity_at(&lever);
            let place = impulses.centre().coords + lever;
            let (gap, rise) = (place.z - table, velocity.z);
            if gap + rise.min(0.0) * dt > TOUCHING {
                continue;
            }
            let least_parting = if restitution > 0.0 && rise < -BOUNCE_SPEED {
                -restitution * rise
            } else if gap > 0.0 {
                -gap / dt
            } else {
                (-gap * RECOVERY / dt).min(PUSH_OUT)
            };
            let friction = self.made_of.friction.mu(place.xy(), velocity.xy());
            impulses.add(Contact { lever, normal: Vector3::z(), least_parting, friction, ..Contact::NONE });
        }
    }
}

impl Press {
    pub(super) fn contact(&self, lever: Vector3<f64>, velocity: Vector3<f64>, dt: f64) -> Contact {
        Contact {
            lever,
            normal: self.touch.normal,
            surface_velocity: self.surface_velocity(dt),
            least_parting: self.least_parting(&velocity, dt),
            friction: self.motion.friction,
        }
    }
}
