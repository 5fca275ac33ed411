//! The step of a sliding body.
//!
//! While every loaded place slips clearly, velocities follow explicit midpoint steps, as long as no place turns its
//! direction of slip by much; near a place that does (a stop, a pivot on one corner) the implicit step of
//! [`super::impulse`] takes over, and a stop is placed inside the step where the kinetic energy is used up.

use super::friction::SlidingFriction;
use super::impulse::Moment;
use super::load::{self, Loads, Wrench};
use super::patch::{Patch, Places, with_places};
use super::planar::{PlanarState, left_of};
use nalgebra::{Vector2, Vector3};

/// A body that stands with a face on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slider {
    /// Mass [kg].
    pub mass: f64,
    /// Inertia about the vertical through the centre of mass [kg m²].
    pub yaw_inertia: f64,
    /// Centre of mass above the table [m].
    pub height: f64,
    pub patch: Patch,
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ending {
    /// At rest, and the friction can hold what acts on the body.
    Rests,
    Slides,
    /// The load would have to pull at an edge: the body lifts or tips. The state stands where that begins, `left`
    /// seconds before the end of the step.
    Lifts {
        /// Time of the step that was not taken [s].
        left: f64,
    },
}

/// An explicit step may change a place's slip by this share of itself.
const TURN: f64 = 0.25;
/// Share of the load on places that may turn faster than that: a fine patch always has a few near its centre of rotation.
const UNRESOLVED: f64 = 0.1;
/// Shortest explicit and only implicit part of a step.
const EXPLICIT_PARTS: f64 = 16.0;
const IMPLICIT_PARTS: f64 = 4.0;

/// A body, what acts on it during one step, and its places.
struct Step<'a, F: ?Sized, const N: usize> {
    slider: &'a Slider,
    places: Places<'a, N>,
    wrench: &'a Wrench,
    friction: &'a F,
}

/// What friction does to a body at one instant.
struct Instant<const N: usize> {
    /// Rates of velocity and yaw rate, patch axes.
    rates: Vector3<f64>,
    /// Of velocity, world axes.
    acceleration: Vector2<f64>,
    /// In patch axes.
    slips: [Vector2<f64>; N],
    loads: Loads<N>,
}

impl Slider {
    /// Moves `state` by `dt` seconds under `wrench`, constant meanwhile, world axes.
    pub fn step(&self, state: &mut PlanarState, wrench: &Wrench, friction: &impl SlidingFriction, dt: f64) -> Ending {
        with_places!(self.patch, places => Step { slider: self, places, wrench, friction }.take(state, dt))
    }

    /// Rates of velocity and yaw rate of a moving body now, world axes; zeros at rest and where the body would lift.
    pub fn rates(&self, state: &PlanarState, wrench: &Wrench, friction: &impl SlidingFriction) -> Vector3<f64> {
        if state.is_at_rest() {
            return Vector3::zeros();
        }
        let now = with_places!(self.patch, places => {
            Step { slider: self, places, wrench, friction }.instant(state).map(|now| (now.acceleration, now.rates.z))
        });
        now.map_or_else(Vector3::zeros, |(acceleration, yaw)| Vector3::new(acceleration.x, acceleration.y, yaw))
    }

    /// Turns what a wrench accelerates within `dt` into velocity at once; what is left of it only shifts the load.
    pub fn kick(&self, state: &mut PlanarState, wrench: &mut Wrench, dt: f64) {
        let planar = wrench.planar() * dt;
        state.velocity += planar.xy() / self.mass;
        state.yaw_rate += planar.z / self.yaw_inertia;
        (wrench.force.x, wrench.force.y, wrench.moment.z) = (0.0, 0.0, 0.0);
    }

    /// Kinetic energy of the planar motion [J].
    pub fn kinetic_energy(&self, state: &PlanarState) -> f64 {
        0.5 * (self.mass * state.velocity.norm_squared() + self.yaw_inertia * state.yaw_rate * state.yaw_rate)
    }
}

impl<F: SlidingFriction, const N: usize> Step<'_, F, N> {
    fn take(&self, state: &mut PlanarState, dt: f64) -> Ending {
        let mut left = dt;
        while left > 1e-12 * dt {
            if state.is_at_rest() && self.holds(state) {
                return Ending::Rests;
            }
            let explicit = self.explicit(state, left, dt / EXPLICIT_PARTS);
            if explicit.is_none() && self.surely_lifts(state, dt) {
                return Ending::Lifts { left };
            }
            let taken = explicit.or_else(|| self.implicit(state, left.min(dt / IMPLICIT_PARTS)));
            let Some(taken) = taken else { return Ending::Lifts { left } };
            left -= taken;
        }
        if state.is_at_rest() { Ending::Rests } else { Ending::Slides }
    }

    /// Whether friction certainly holds a body at rest: every place pushes back along the force, and the friction that
    /// is left turns against the moment about the middle of the load. Sufficient; the implicit step decides the rest.
    fn holds(&self, state: &PlanarState) -> bool {
        let (sin, cos) = state.yaw.sin_cos();
        let local = self.wrench.in_turned_axes(cos, sin);
        let Some(loads) = load::solve_at_rest(&self.places, self.slider.height, &local) else { return false };
        let mu = self.coefficients(state, cos, sin);
        let weight: f64 = loads.iter().sum();
        let places = || self.places.points.iter().enumerate();
        let middle = places().map(|(i, p)| p * loads[i]).sum::<Vector2<f64>>() / weight;
        let least = mu.iter().copied().fold(f64::INFINITY, f64::min);
        let reach = places().map(|(_, p)| (p - middle).norm()).fold(0.0, f64::max);
        let turning = places().map(|(i, p)| loads[i] * (p - middle).norm_squared()).sum::<f64>() * least / reach;
        let push = Vector2::new(local.force.x, local.force.y);
        let moment = local.moment.z - middle.perp(&push);
        push.norm() / (least * weight) + moment.abs() / turning <= 1.0
    }

    /// One explicit step of at most `left`: the time taken, `None` when it would have to be shorter than `shortest` or
    /// the loads cannot be derived from the directions of slip alone. The implicit step decides then.
    fn explicit(&self, state: &mut PlanarState, left: f64, shortest: f64) -> Option<f64> {
        if state.is_at_rest() {
            return None;
        }
        let first = self.instant(state)?;
        let horizon = self.horizon(&first, state.yaw_rate, left);
        if horizon < shortest.min(left) {
            return None;
        }
        let taken = horizon.min(left);
        let mut middle = *state;
        middle.advance(state.velocity, state.yaw_rate, 0.5 * taken);
        middle.velocity += first.acceleration * (0.5 * taken);
        middle.yaw_rate += first.rates.z * (0.5 * taken);
        let second = self.instant(&middle)?;
        state.advance(middle.velocity, middle.yaw_rate, taken);
        state.velocity += second.acceleration * taken;
        state.yaw_rate += second.rates.z * taken;
        Some(taken)
    }

    /// Whether the body lifts although every place slips so fast that friction cannot turn its direction within `dt`:
    /// then the implicit step would find nothing else.
    fn surely_lifts(&self, state: &PlanarState, dt: f64) -> bool {
        let (sin, cos) = state.yaw.sin_cos();
        let local = self.wrench.in_turned_axes(cos, sin);
        let (planar, weight) = (local.planar(), -local.force.z);
        let mut kappas = [Vector2::zeros(); N];
        let (mut slowest, mut fastest_change) = (f64::INFINITY, 0.0_f64);
        for (i, point) in self.places.points.iter().enumerate() {
            let turned = turn(cos, sin, *point);
            let slip = state.velocity + left_of(turned) * state.yaw_rate;
            let (mu, speed, reach) = (self.friction.mu(state.position + turned, slip), slip.norm(), point.norm());
            kappas[i] = turn(cos, -sin, self.friction_at(state.position + turned, slip) / speed);
            let (force, moment) = (planar.xy().norm() + mu * weight, planar.z.abs() + mu * weight * reach);
            let change =
                force / self.slider.mass + moment * reach / self.slider.yaw_inertia + reach * state.yaw_rate.powi(2);
            (slowest, fastest_change) = (slowest.min(speed), fastest_change.max(change));
        }
        TURN * slowest > fastest_change * dt && load::solve(&self.places, self.slider.height, &local, &kappas).is_none()
    }

    fn instant(&self, state: &PlanarState) -> Option<Instant<N>> {
        let (sin, cos) = state.yaw.sin_cos();
        let local = self.wrench.in_turned_axes(cos, sin);
        let mut slips = [Vector2::zeros(); N];
        let mut kappas = [Vector2::zeros(); N];
        for (i, point) in self.places.points.iter().enumerate() {
            let turned = turn(cos, sin, *point);
            let slip = state.velocity + left_of(turned) * state.yaw_rate;
            let speed = slip.norm();
            slips[i] = turn(cos, -sin, slip);
            if speed > 0.0 {
                kappas[i] = turn(cos, -sin, self.friction_at(state.position + turned, slip) / speed);
            }
        }
        let loads = load::solve(&self.places, self.slider.height, &local, &kappas)?;
        let mut total = local.planar();
        for (i, point) in self.places.points.iter().enumerate() {
            let force = kappas[i] * -loads[i];
            total += Vector3::new(force.x, force.y, point.perp(&force));
        }
        let Slider { mass, yaw_inertia, .. } = *self.slider;
        let rates = Vector3::new(total.x / mass, total.y / mass, total.z / yaw_inertia);
        Some(Instant { rates, acceleration: turn(cos, sin, rates.xy()), slips, loads })
    }

    /// Friction at a place, reversed, over its load and times the speed of its slip; world axes.
    #[inline]
    fn friction_at(&self, place: Vector2<f64>, slip: Vector2<f64>) -> Vector2<f64> {
        slip * self.friction.mu(place, slip) + left_of(slip) * self.friction.aside(place, slip)
    }

    /// Longest step, `wanted` or a power of two shorter, in which all but [`UNRESOLVED`] of the load keeps its direction.
    fn horizon(&self, now: &Instant<N>, yaw_rate: f64, wanted: f64) -> f64 {
        // How much of its slip each place may change, and how fast it changes, both squared.
        let (mut spare, mut rate) = ([0.0; N], [0.0; N]);
        for (i, point) in self.places.points.iter().enumerate() {
            let change = now.rates.xy() + left_of(*point) * now.rates.z - point * (yaw_rate * yaw_rate);
            (spare[i], rate[i]) = (TURN * TURN * now.slips[i].norm_squared(), change.norm_squared());
        }
        let allowed = UNRESOLVED * now.loads.iter().sum::<f64>();
        let mut horizon = wanted;
        for _ in 0..8 {
            let turns = |i: &usize| spare[*i] < rate[*i] * (horizon * horizon);
            let fast: f64 = (0..N).filter(turns).map(|i| now.loads[i]).sum();
            if fast <= allowed {
                return horizon;
            }
            horizon *= 0.5;
        }
        0.0
    }

    /// One implicit step of `dt`: the time taken, `None` when the body lifts.
    fn implicit(&self, state: &mut PlanarState, dt: f64) -> Option<f64> {
        let (sin, cos) = state.yaw.sin_cos();
        let local = self.wrench.in_turned_axes(cos, sin);
        let mu = self.coefficients(state, cos, sin);
        let Slider { mass, yaw_inertia, height, .. } = *self.slider;
        let inertia = Vector3::new(mass, mass, yaw_inertia);
        let moment = Moment { places: self.places, height, inertia, wrench: &local, mu: &mu };
        let velocity = turn(cos, -sin, state.velocity);
        let start = Vector3::new(velocity.x, velocity.y, state.yaw_rate);
        let end = moment.after(start, dt)?;
        let stops = end == Vector3::zeros();
        let taken = if stops { self.time_to_stop(state, dt) } else { dt };
        let after = turn(cos, sin, end.xy());
        state.advance((state.velocity + after) * 0.5, 0.5 * (state.yaw_rate + end.z), taken);
        (state.velocity, state.yaw_rate) = (after, end.z);
        Some(taken)
    }

    /// When a body that stops within `dt` does so: near its end a motion slows evenly, so its energy, half of momentum
    /// times speed, lasts for twice the energy over the power that is lost.
    fn time_to_stop(&self, state: &PlanarState, dt: f64) -> f64 {
        let Some(now) = self.instant(state) else { return dt };
        let gain = self.slider.mass * state.velocity.dot(&now.acceleration)
            + self.slider.yaw_inertia * state.yaw_rate * now.rates.z;
        if gain < 0.0 { (-2.0 * self.slider.kinetic_energy(state) / gain).min(dt) } else { dt }
    }

    fn coefficients(&self, state: &PlanarState, cos: f64, sin: f64) -> [f64; N] {
        self.places.points.map(|point| {
            let turned = turn(cos, sin, point);
            self.friction.mu(state.position + turned, state.velocity + left_of(turned) * state.yaw_rate)
        })
    }
}

/// From the patch frame to the world for the angle of (`cos`, `sin`), back for (`cos`, `-sin`).
#[inline]
fn turn(cos: f64, sin: f64, v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}
