//! One implicit step through the moments in which explicit steps fail: something comes to rest, is at rest, or a place
//! of the base turns its direction of slip around.
//!
//! The velocity `u = (v_x, v_y, omega)` at the end of a step of length `t` is the one that minimises
//!
//! ```text
//! 1/2 (u - u_free)' M (u - u_free) + t sum mu_i N_i |s_i(u)|
//! ```
//!
//! (`u_free`: without friction; `s_i`: slip of place i), because the gradient of the second term is Coulomb's friction
//! and its kink at `s_i = 0` is stiction: a place sticks exactly when its friction stays inside the circle. The kink is
//! rounded by [`FINEST`] and approached from larger roundings, so that Newton's method converges from anywhere; what
//! then moves slower than [`STUCK`] is at rest. The loads follow the friction they cause from rounding to rounding.

use super::load::{self, Kappas, Loads, Wrench};
use super::patch::Places;
use super::planar::left_of;
use nalgebra::{Matrix3, Vector2, Vector3};

/// A body as the implicit step sees it; everything in the patch frame.
pub(super) struct Moment<'a, const N: usize> {
    pub(super) places: Places<'a, N>,
    pub(super) height: f64,
    /// Mass, mass, yaw inertia.
    pub(super) inertia: Vector3<f64>,
    pub(super) wrench: &'a Wrench,
    /// Coefficient at each place, for the slip at the start of the step.
    pub(super) mu: &'a [f64; N],
}

/// Last rounding of the kink [m/s].
const FINEST: f64 = 1e-10;
/// Below this slip a place sticks [m/s]: 1000 roundings, reached at a friction within a millionth of the limit.
const STUCK: f64 = 1e-7;
/// From one rounding to the next.
const SHARPEN: f64 = 0.1;
/// Where every place slips so many roundings fast none is near its kink: the last rounding may follow at once.
const CLEAR: f64 = 1e3;
/// Newton steps at one rounding.
const NEWTON: usize = 8;
/// Rounds at the last rounding until loads and friction agree.
const SETTLE: usize = 12;

/// Length of a slip whose kink at zero is rounded off.
fn rounded(slip: &Vector2<f64>, rounding: f64) -> f64 {
    (slip.norm_squared() + rounding * rounding).sqrt()
}

impl<const N: usize> Moment<'_, N> {
    /// Velocity after `dt`, starting from `start`; exactly zero when the body ends at rest. `None` when it lifts.
    pub(super) fn after(&self, start: Vector3<f64>, dt: f64) -> Option<Vector3<f64>> {
        let free = start + self.wrench.planar().component_div(&self.inertia) * dt;
        let mut rounding = 0.1 * self.fastest_slip(&free).max(FINEST);
        let mut u = free;
        let mut loads = self.loads(&u, rounding).unwrap_or_else(|| self.even_loads());
        while rounding > FINEST {
            u = self.minimise(u, &free, &loads, rounding, dt);
            // On the way the friction is not yet the real one: loads without an answer wait for a better one.
            loads = self.loads(&u, rounding).unwrap_or(loads);
            if self.slowest_slip(&u) > CLEAR * rounding {
                break;
            }
            rounding *= SHARPEN;
        }
        for _ in 0..SETTLE {
            let before = u;
            u = self.minimise(u, &free, &loads, FINEST, dt);
            if (u - before).amax() < 1e-3 * STUCK {
                break;
            }
            loads = self.loads(&u, FINEST).unwrap_or(loads);
        }
        self.loads(&u, FINEST)?;
        let rests = self.fastest_slip(&u) < STUCK;
        Some(if rests { Vector3::zeros() } else { u })
    }

    fn loads(&self, u: &Vector3<f64>, rounding: f64) -> Option<Loads<N>> {
        load::solve(&self.places, self.height, self.wrench, &self.kappas(u, rounding))
    }

    fn even_loads(&self) -> Loads<N> {
        self.places.shares.map(|share| -share * self.wrench.force.z)
    }

    fn slip(u: &Vector3<f64>, point: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(u.x, u.y) + left_of(point) * u.z
    }

    fn fastest_slip(&self, u: &Vector3<f64>) -> f64 {
        self.places.points.iter().map(|p| Self::slip(u, *p).norm()).fold(0.0, f64::max)
    }

    fn slowest_slip(&self, u: &Vector3<f64>) -> f64 {
        self.places.points.iter().map(|p| Self::slip(u, *p).norm()).fold(f64::INFINITY, f64::min)
    }

    /// Friction over load at each place: inside the circle of the coefficient where the place sticks.
    fn kappas(&self, u: &Vector3<f64>, rounding: f64) -> Kappas<N> {
        let mut kappas = [Vector2::zeros(); N];
        for (i, point) in self.places.points.iter().enumerate() {
            let slip = Self::slip(u, *point);
            kappas[i] = slip * (self.mu[i] / rounded(&slip, rounding));
        }
        kappas
    }

    /// The minimum at one rounding, by Newton's method with halved steps where a full one would climb.
    fn minimise(
        &self,
        start: Vector3<f64>,
        free: &Vector3<f64>,
        loads: &Loads<N>,
        rounding: f64,
        dt: f64,
    ) -> Vector3<f64> {
        let mut u = start;
        let mut cost = self.cost(&u, free, loads, rounding, dt);
        for _ in 0..NEWTON {
            let (gradient, curvature) = self.derivatives(&u, free, loads, rounding, dt);
            let Some(mut step) = newton_step(&gradient, &curvature) else { break };
            if step.amax() < 0.001 * rounding {
                break;
            }
            let mut lower = self.cost(&(u + step), free, loads, rounding, dt);
            for _ in 0..12 {
                if lower <= cost {
                    break;
                }
                step *= 0.5;
                lower = self.cost(&(u + step), free, loads, rounding, dt);
            }
            if lower > cost {
                break;
            }
            (u, cost) = (u + step, lower);
            if step.amax() < 0.01 * rounding {
                break;
            }
        }
        u
    }

    fn cost(&self, u: &Vector3<f64>, free: &Vector3<f64>, loads: &Loads<N>, rounding: f64, dt: f64) -> f64 {
        let off = u - free;
        let slips = self.places.points.iter().enumerate();
        let braking: f64 = slips.map(|(i, p)| self.mu[i] * loads[i] * rounded(&Self::slip(u, *p), rounding)).sum();
        0.5 * off.component_mul(&self.inertia).dot(&off) + dt * braking
    }

    fn derivatives(
        &self,
        u: &Vector3<f64>,
        free: &Vector3<f64>,
        loads: &Loads<N>,
        rounding: f64,
        dt: f64,
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let mut gradient = (u - free).component_mul(&self.inertia);
        let mut curvature = Matrix3::from_diagonal(&self.inertia);
        for (i, point) in self.places.points.iter().enumerate().filter(|(i, _)| loads[*i] > 0.0) {
            let slip = Self::slip(u, *point);
            let (per_speed, arm) = (1.0 / rounded(&slip, rounding), left_of(*point));
            let (unit, pull) = (slip * per_speed, dt * self.mu[i] * loads[i]);
            gradient += Vector3::new(unit.x, unit.y, arm.dot(&unit)) * pull;
            let stiffness = pull * per_speed;
            let (xx, xy, yy) = (1.0 - unit.x * unit.x, -unit.x * unit.y, 1.0 - unit.y * unit.y);
            let (xw, yw) = (xx * arm.x + xy * arm.y, xy * arm.x + yy * arm.y);
            let ww = arm.x * xw + arm.y * yw;
            curvature += Matrix3::new(xx, xy, xw, xy, yy, yw, xw, yw, ww) * stiffness;
        }
        (gradient, curvature)
    }
}

/// The step to the minimum of a parabola, by `L D L'`; `None` where it has none.
fn newton_step(gradient: &Vector3<f64>, a: &Matrix3<f64>) -> Option<Vector3<f64>> {
    let first = a[(0, 0)];
    let (l10, l20) = (a[(1, 0)] / first, a[(2, 0)] / first);
    let second = a[(1, 1)] - l10 * a[(1, 0)];
    let l21 = (a[(2, 1)] - l20 * a[(1, 0)]) / second;
    let third = a[(2, 2)] - l20 * a[(2, 0)] - l21 * l21 * second;
    if !(first > 0.0 && second > 0.0 && third > 0.0) {
        return None;
    }
    let y = -gradient.y + l10 * gradient.x;
    let z = (-gradient.z + l20 * gradient.x - l21 * y) / third;
    let y = y / second - l21 * z;
    Some(Vector3::new(-gradient.x / first - l10 * y - l20 * z, y, z))
}
