//! The impulses at all places that touch a free body within one step, found together: each place gives way as it must and
//! pulls at nothing, and friction stops a slip or reaches Coulomb's cone.
//!
//! Sweeps over the places (projected Gauss-Seidel) find them. Where it is known which places part, stick or slip and how,
//! linear equations give the answer ([`modes`]): the sweeps begin with that for a motion that goes on as before, and where
//! they settle slowly, as with a tool that sticks, with that for what they have found so far (after Silcowitz, Niebe and
//! Erleben 2010, "Projected Gauss-Seidel Subspace Minimization Method for Interactive Rigid Body Dynamics"). Base frame,
//! SI. Called by [`super::tumble`].

mod modes;

use crate::sliding::FreeBody;
use modes::Mode;
use nalgebra::{Matrix3, Point3, Vector2, Vector3};

/// Sweeps over the places, and the change of velocity [m/s] below which they end early.
const SWEEPS: usize = 80;
const SETTLED: f64 = 1e-6;
/// Sweeps after which equations take up what they have found; again after twice as many, and so on, so that where no
/// answer of equations holds the sweeps get there.
const SWEEPS_BEFORE_EQUATIONS: usize = 3;
/// Sweeps end where the change of velocity is still this share of what it was when equations were last asked: a body that
/// a tool pins to the table is pressed a little harder by every sweep, and moves no more.
const HARDLY: f64 = 0.9;

/// Slower than this a place is as good as at rest [m/s]: which way it slips is chance.
const SLIPS: f64 = 1e-3;

/// One place that touches within the step.
#[derive(Clone, Copy)]
pub(super) struct Contact {
    /// From the centre of mass, world axes.
    pub(super) lever: Vector3<f64>,
    /// Away from table or tool.
    pub(super) normal: Vector3<f64>,
    /// Of table or tool.
    pub(super) surface_velocity: Vector3<f64>,
    /// Least speed along the normal, relative to the surface, after the step [m/s].
    pub(super) least_parting: f64,
    pub(super) friction: f64,
}

/// The same with what it takes to find its impulse.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) contact: Contact,
    /// Impulse for one unit of velocity: along the normal, and across it in the most mobile direction.
    pub(super) normal_mass: f64,
    pub(super) slip_mass: f64,
    /// Found so far [N s].
    pub(super) impulse: Vector3<f64>,
}

/// A body in the middle of a step, and at most `N` places that touch it.
pub(super) struct Impulses<'a, const N: usize> {
    body: &'a mut FreeBody,
    inverse_mass: f64,
    inverse_inertia: Matrix3<f64>,
    places: [Place; N],
    count: usize,
}

impl Contact {
    /// A table that holds against what comes down on it.
    pub(super) const NONE: Self = Self {
        lever: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 1.0),
        surface_velocity: Vector3::new(0.0, 0.0, 0.0),
        least_parting: 0.0,
        friction: 0.0,
    };
}

impl Place {
    const NONE: Self =
        Self { contact: Contact::NONE, normal_mass: 1.0, slip_mass: 1.0, impulse: Vector3::new(0.0, 0.0, 0.0) };

    /// The projected impulse, from the place's velocity relative to the surface: complementary to the parting speed along the
    /// normal, within Coulomb's cone across it.
    #[inline]
    pub(super) fn projected(&self, relative: &Vector3<f64>) -> Vector3<f64> {
        let Contact { normal, least_parting, friction, .. } = &self.contact;
        let (parting, before) = (relative.dot(normal), self.impulse.dot(normal));
        let push = (before + (least_parting - parting) * self.normal_mass).max(0.0);
        let slip = relative - normal * parting;
        let wanted = self.impulse - normal * before - slip * self.slip_mass;
        let (limit, square) = (friction * push, wanted.norm_squared());
        let friction = if square > limit * limit { wanted * (limit / square.sqrt()) } else { wanted };
        normal * push + friction
    }
}

impl<'a, const N: usize> Impulses<'a, N> {
    pub(super) fn on(body: &'a mut FreeBody, inverse_mass: f64, inverse_inertia: Matrix3<f64>) -> Self {
        Self { body, inverse_mass, inverse_inertia, places: [Place::NONE; N], count: 0 }
    }

    pub(super) fn centre(&self) -> Point3<f64> {
        self.body.centre
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// What was found, in the order in which the places were added [N s].
    pub(super) fn iter(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.places[..self.count].iter().map(|place| place.impulse)
    }

    /// Turns what slips on the table aside, after the impulses are found: `aside` is the force to the right of a slip over the
    /// load, for a place on the table and the slip there.
    pub(super) fn turn_aside(&mut self, aside: impl Fn(Vector2<f64>, Vector2<f64>) -> f64) {
        for k in 0..self.count {
            let Place { contact, impulse, .. } = self.places[k];
            let slip = self.velocity_at(&contact.lever).xy();
            let speed = slip.norm();
            if contact.normal != Contact::NONE.normal || speed < SLIPS {
                continue;
            }
            let across = impulse.z * aside((self.body.centre.coords + contact.lever).xy(), slip) / speed;
            let push = Vector3::new(slip.y * across, -slip.x * across, 0.0);
            self.body.velocity += push * self.inverse_mass;
            self.body.angular_velocity += self.inverse_inertia * contact.lever.cross(&push);
        }
    }

    pub(super) fn velocity_at(&self, lever: &Vector3<f64>) -> Vector3<f64> {
        self.body.velocity + self.body.angular_velocity.cross(lever)
    }

    /// Adds a place, as long as there is room.
    pub(super) fn add(&mut self, contact: Contact) {
        if self.count == N {
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
        self.places[self.count] = Place {
            contact,
            normal_mass: 1.0 / normal_mobility,
            slip_mass: 1.0 / slip_mobility,
            impulse: Vector3::zeros(),
        };
        self.count += 1;
    }

    /// Finds the impulses and gives them to the body.
    pub(super) fn settle(&mut self) {
        self.follow(|contact, relative, _| Mode::of_motion(contact, relative));
        let mut before = f64::INFINITY;
        for sweep in 1..=SWEEPS {
            let mut largest: f64 = 0.0;
            for i in 0..self.count {
                let relative = self.relative(i);
                let change = self.places[i].projected(&relative) - self.places[i].impulse;
                self.push(i, &change);
                largest = largest.max(change.amax() * self.inverse_mass);
            }
            if largest < SETTLED {
                break;
            }
            if sweep % SWEEPS_BEFORE_EQUATIONS == 0 && (sweep / SWEEPS_BEFORE_EQUATIONS).is_power_of_two() {
                if sweep > 2 * SWEEPS_BEFORE_EQUATIONS && largest > HARDLY * before {
                    break;
                }
                before = largest;
                self.follow(|contact, _, impulse| Mode::of_impulse(contact, impulse));
            }
        }
    }

    /// Velocity of a place relative to its surface.
    fn relative(&self, i: usize) -> Vector3<f64> {
        self.velocity_at(&self.places[i].contact.lever) - self.places[i].contact.surface_velocity
    }

    fn push(&mut self, i: usize, change: &Vector3<f64>) {
        let place = &mut self.places[i];
        place.impulse += change;
        self.body.velocity += change * self.inverse_mass;
        self.body.angular_velocity += self.inverse_inertia * place.contact.lever.cross(change);
    }
}

#[cfg(test)]
mod tests;
