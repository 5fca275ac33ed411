//! What a tool presses on a body that stands: the law of the hit, solved for a body that can only slide and turn on its
//! base. Whether it goes on standing under these forces is for the load to tell; where it does not, [`super::tumble`] solves
//! all six freedoms. Base frame, SI. Called by [`super::TableObject`].

use super::hit::Press;
use super::impulses::Place;
use super::material::Material;
use super::tumble::Tumbling;
use crate::sliding::{Footing, FreeBody, PlanarState, SlidingFriction, Wrench};
use nalgebra::Vector3;

/// Sweeps over the two places, and the change of impulse over mass [m/s] below which they end early.
const SWEEPS: usize = 40;
const SETTLED: f64 = 1e-6;
/// A push steeper than this against the table is none that a sliding body could give way to: the sine of 18 degrees.
const STEEPEST: f64 = 0.95;

/// A standing body that is pushed.
struct Pushed<'a> {
    body: &'a FreeBody,
    /// Of velocity and yaw rate without the push.
    rates: Vector3<f64>,
    mass: f64,
    yaw_inertia: f64,
}

impl<F: SlidingFriction> Tumbling<F> {
    /// Contact forces of the tool on an upright body that slides on its base [N]; `None` where none are feasible.
    pub(super) fn push(
        &self,
        (footing, state): (&Footing, &PlanarState),
        body: &FreeBody,
        presses: &[Press],
        dt: f64,
    ) -> Option<[Vector3<f64>; 2]> {
        if presses.iter().all(|press| press.touch.depth <= 0.0) {
            return Some([Vector3::zeros(); 2]);
        }
        // In the short steps of a hit the table's friction is nothing against the push.
        let rates = if presses.iter().any(|press| press.steady) {
            let alone = self.wrench(footing, body, &[], &Default::default());
            footing.slider.rates(state, &alone, &self.made_of.friction)
        } else {
            Vector3::zeros()
        };
        let mass = self.made_of.parameters.mass;
        Pushed { body, rates, mass, yaw_inertia: footing.slider.yaw_inertia }.forces(presses, dt)
    }

    /// What acts on a standing body but for the table's answer.
    pub(super) fn wrench(
        &self,
        footing: &Footing,
        body: &FreeBody,
        presses: &[Press],
        forces: &[Vector3<f64>; 2],
    ) -> Wrench {
        let Material { parameters, gravity, drag, .. } = &self.made_of;
        let weight = Wrench::weight(parameters.mass, *gravity);
        let pushed = presses
            .iter()
            .zip(forces)
            .fold(weight, |sum, (press, force)| sum.with_force(*force, press.touch.point - body.centre));
        let Some(height) = self.table_height.filter(|_| *drag > 0.0) else { return pushed };
        let middle = body.rotation * -parameters.centre_of_mass;
        let lever = Vector3::new(middle.x, middle.y, height - body.centre.z);
        let velocity = body.velocity + body.angular_velocity.cross(&lever);
        let mut dragged = pushed.with_force(velocity * -drag, lever);
        dragged.moment.z -= drag * footing.slider.patch.gyration_squared() * body.angular_velocity.z;
        dragged
    }
}

impl Pushed<'_> {
    /// Mean force of each press on the body over `dt` [N]; `None` when a press is too steep for a body that slides.
    fn forces(&self, presses: &[Press], dt: f64) -> Option<[Vector3<f64>; 2]> {
        if presses.iter().any(|press| press.touch.normal.z.abs() > STEEPEST) {
            return None;
        }
        let gain = self.rates * dt;
        let mut velocity = self.body.velocity + Vector3::new(gain.x, gain.y, 0.0);
        let mut spin = self.body.angular_velocity.z + gain.z;
        let place = |i: usize| presses.get(i).map(|press| self.place(press, dt));
        let mut places = [place(0), place(1)];
        let (per_mass, per_inertia) = (1.0 / self.mass, 1.0 / self.yaw_inertia);
        for _ in 0..SWEEPS {
            let mut largest: f64 = 0.0;
            for place in places.iter_mut().flatten() {
                let lever = place.contact.lever;
                let projected = place.projected(&(at(&lever, &velocity, spin) - place.contact.surface_velocity));
                let change = projected - place.impulse;
                place.impulse = projected;
                velocity += Vector3::new(change.x, change.y, 0.0) * per_mass;
                spin += (lever.x * change.y - lever.y * change.x) * per_inertia;
                largest = largest.max(change.amax() * per_mass);
            }
            if largest < SETTLED {
                break;
            }
        }
        let force = |place: &Option<Place>| place.as_ref().map_or_else(Vector3::zeros, |place| place.impulse / dt);
        Some([force(&places[0]), force(&places[1])])
    }

    fn place(&self, press: &Press, dt: f64) -> Place {
        let (lever, normal) = (press.touch.point - self.body.centre, press.touch.normal);
        let (along, turning) = (normal.xy().norm_squared(), lever.x * normal.y - lever.y * normal.x);
        let before = at(&lever, &self.body.velocity, self.body.angular_velocity.z);
        Place {
            contact: press.contact(lever, before, dt),
            normal_mass: 1.0 / (along / self.mass + turning * turning / self.yaw_inertia),
            slip_mass: 1.0 / (1.0 / self.mass + lever.xy().norm_squared() / self.yaw_inertia),
            impulse: Vector3::zeros(),
        }
    }
}

/// Velocity of a standing body's point.
fn at(lever: &Vector3<f64>, velocity: &Vector3<f64>, spin: f64) -> Vector3<f64> {
    Vector3::new(velocity.x - spin * lever.y, velocity.y + spin * lever.x, 0.0)
}
