//! A rigid body that flies, tips or tumbles over a rigid table, with or without a tool against it.
//!
//! Velocities change by impulses at the places that touch within the step (Stewart and Trinkle 1996): a corner of the
//! convex hull may not sink into the table, a place under the tool must give way as the contact law asks, nothing is
//! pulled, and friction stops a slip or reaches Coulomb's cone. All impulses of a step are found together by sweeps over
//! the places (projected Gauss-Seidel), because they act together: a box that is struck above its centre of mass leans
//! on its front edge at once, and what the tool meets is the box with the table behind it.
//!
//! Base frame, SI. Called by [`super::TableObject`] while the body does not stand.

use super::hit::Press;
use crate::effects::TableFriction;
use crate::sliding::{FreeBody, SlidingFriction};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The body and the table below it.
#[derive(Debug, Clone)]
pub(super) struct Tumbling {
    /// Corners of the convex hull from the centre of mass, object axes [m].
    pub(super) corners: Vec<Vector3<f64>>,
    /// Mass [kg].
    pub(super) mass: f64,
    /// Inertia about the centre of mass, object axes [kg m²].
    pub(super) inertia: Matrix3<f64>,
    /// Its inverse.
    pub(super) inverse_inertia: Matrix3<f64>,
    /// Height of the table [m]; `None`: there is none.
    pub(super) table_height: Option<f64>,
    /// Friction of a corner on the table.
    pub(super) friction: TableFriction,
    /// Restitution of a corner, 0 to 1.
    pub(super) restitution: f64,
    /// In the table's axes [m/s²].
    pub(super) gravity: Vector3<f64>,
    /// Drag of a viscous film under a standing body's base over its speed [N s/m].
    pub(super) drag: f64,
    /// The geometric centre from the centre of mass, object axes [m].
    pub(super) middle: Vector3<f64>,
}

/// Places that touch at one time; a flat base has more only on meshes finer than needed.
const MOST_CONTACTS: usize = 32;
/// Sweeps over the places, and the change of velocity [m/s] below which they end early.
const SWEEPS: usize = 40;
const SETTLED: f64 = 1e-7;
/// Corners that arrive slower than this do not bounce [m/s], so that a body comes to rest.
const BOUNCE_SPEED: f64 = 0.05;
/// A sunken corner leaves by this share of its depth in a step, and no faster than [`PUSH_OUT`] [m/s].
const RECOVERY: f64 = 0.1;
const PUSH_OUT: f64 = 0.02;
/// A corner nearer to the table than this touches it [m].
const TOUCHING: f64 = 1e-9;

/// One place that touches within the step.
#[derive(Clone, Copy)]
struct Contact {
    /// From the centre of mass, world axes.
    lever: Vector3<f64>,
    /// Away from table or tool.
    normal: Vector3<f64>,
    /// Of table or tool.
    surface_velocity: Vector3<f64>,
    /// Least speed along the normal, relative to the surface, after the step [m/s].
    least_parting: f64,
    friction: f64,
    /// Impulse for one unit of velocity: along the normal, and across it in the most mobile direction.
    normal_mass: f64,
    slip_mass: f64,
    impulse: Vector3<f64>,
}

/// A body in the middle of a step.
struct Motion<'a> {
    body: &'a mut FreeBody,
    inverse_mass: f64,
    inverse_inertia: Matrix3<f64>,
    contacts: [Contact; MOST_CONTACTS],
    count: usize,
}

impl Tumbling {
    /// Moves `body` by one short step under gravity, the table and the tool; mean force of each press on the body [N].
    pub(super) fn step(&self, body: &mut FreeBody, presses: &[Press], dt: f64) -> [Vector3<f64>; 2] {
        let turn = body.rotation.to_rotation_matrix().into_inner();
        let (velocity, spin) = (body.velocity, body.angular_velocity);
        let gyroscopic = spin.cross(&(turn * (self.inertia * (turn.transpose() * spin))));
        let inverse_inertia = turn * self.inverse_inertia * turn.transpose();
        body.velocity += self.gravity * dt;
        body.angular_velocity -= inverse_inertia * gyroscopic * dt;
        let contacts = [Contact::NONE; MOST_CONTACTS];
        let mut motion = Motion { body, inverse_mass: 1.0 / self.mass, inverse_inertia, contacts, count: 0 };
        for press in presses {
            let lever = press.touch.point - motion.body.centre;
            let before = velocity + spin.cross(&lever);
            motion.add(press.contact(lever, before, dt));
        }
        self.add_corners(&mut motion, &turn, dt);
        motion.settle();
        let mut forces = [Vector3::zeros(); 2];
        forces.iter_mut().zip(&motion.contacts[..presses.len()]).for_each(|(f, contact)| *f = contact.impulse / dt);
        // In free flight the mean velocity is exact; where something touches, the last one is what the contacts allow.
        let travelling = if motion.count == 0 { (velocity + body.velocity) * 0.5 } else { body.velocity };
        body.centre += travelling * dt;
        body.rotation = UnitQuaternion::from_scaled_axis(body.angular_velocity * dt) * body.rotation;
        forces
    }

    /// Adds the corners that would be in the table at the end of the step.
    fn add_corners(&self, motion: &mut Motion<'_>, turn: &Matrix3<f64>, dt: f64) {
        let Some(table) = self.table_height else { return };
        for corner in &self.corners {
            let lever = turn * corner;
            let velocity = motion.velocity_at(&lever);
            let place = motion.body.centre.coords + lever;
            let (gap, rise) = (place.z - table, velocity.z);
            if gap + rise.min(0.0) * dt > TOUCHING {
                continue;
            }
            let least_parting = if self.restitution > 0.0 && rise < -BOUNCE_SPEED {
                -self.restitution * rise
            } else if gap > 0.0 {
                -gap / dt
            } else {
                (-gap * RECOVERY / dt).min(PUSH_OUT)
            };
            let friction = self.friction.mu(place.xy(), velocity.xy());
            motion.add(Contact { lever, normal: Vector3::z(), least_parting, friction, ..Contact::NONE });
        }
    }
}

impl Press {
    fn contact(&self, lever: Vector3<f64>, velocity: Vector3<f64>, dt: f64) -> Contact {
        Contact {
            lever,
            normal: self.touch.normal,
            surface_velocity: self.surface_velocity(dt),
            least_parting: self.least_parting(&velocity, dt),
            friction: self.motion.friction,
            ..Contact::NONE
        }
    }
}

impl Contact {
    /// The impulse with which the place gives way as it must and rubs as it can, from its velocity relative to the surface.
    #[inline]
    fn relaxed(&self, relative: &Vector3<f64>) -> Vector3<f64> {
        let (parting, before) = (relative.dot(&self.normal), self.impulse.dot(&self.normal));
        let normal = (before + (self.least_parting - parting) * self.normal_mass).max(0.0);
        let slip = relative - self.normal * parting;
        let wanted = self.impulse - self.normal * before - slip * self.slip_mass;
        let (limit, square) = (self.friction * normal, wanted.norm_squared());
        let rubbing = if square > limit * limit { wanted * (limit / square.sqrt()) } else { wanted };
        self.normal * normal + rubbing
    }

    const NONE: Self = Self {
        lever: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 1.0),
        surface_velocity: Vector3::new(0.0, 0.0, 0.0),
        least_parting: 0.0,
        friction: 0.0,
        normal_mass: 1.0,
        slip_mass: 1.0,
        impulse: Vector3::new(0.0, 0.0, 0.0),
    };
}

impl Motion<'_> {
    fn velocity_at(&self, lever: &Vector3<f64>) -> Vector3<f64> {
        self.body.velocity + self.body.angular_velocity.cross(lever)
    }

    fn add(&mut self, contact: Contact) {
        if self.count == MOST_CONTACTS {
            return;
        }
        let cross = contact.lever.cross_matrix();
        let mobility =
            cross.transpose() * self.inverse_inertia * cross + Matrix3::from_diagonal_element(self.inverse_mass);
        let normal_mobility = contact.normal.dot(&(mobility * contact.normal));
        // The larger eigenvalue of the mobility across the normal, from trace and determinant of that 2 x 2 block.
        let [x, y, z] = [mobility.column(0), mobility.column(1), mobility.column(2)];
        let cofactors = Vector3::new(
            contact.normal.dot(&y.cross(&z)),
            contact.normal.dot(&z.cross(&x)),
            contact.normal.dot(&x.cross(&y)),
        );
        let (half_trace, determinant) = (0.5 * (mobility.trace() - normal_mobility), contact.normal.dot(&cofactors));
        let slip_mobility = half_trace + (half_trace * half_trace - determinant).max(0.0).sqrt();
        self.contacts[self.count] =
            Contact { normal_mass: 1.0 / normal_mobility, slip_mass: 1.0 / slip_mobility, ..contact };
        self.count += 1;
    }

    /// Sweeps until every place gives way as it must and rubs as it can.
    fn settle(&mut self) {
        for _ in 0..SWEEPS {
            let mut largest: f64 = 0.0;
            for i in 0..self.count {
                let contact = &self.contacts[i];
                let relative = self.velocity_at(&contact.lever) - contact.surface_velocity;
                let impulse = contact.relaxed(&relative);
                let (change, lever) = (impulse - contact.impulse, contact.lever);
                self.contacts[i].impulse = impulse;
                self.body.velocity += change * self.inverse_mass;
                self.body.angular_velocity += self.inverse_inertia * lever.cross(&change);
                largest = largest.max(change.amax() * self.inverse_mass);
            }
            if largest < SETTLED {
                break;
            }
        }
    }
}
