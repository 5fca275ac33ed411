//! How the base carries the load: the pressure that keeps a standing body from sinking, rolling and pitching.
//!
//! The body is rigid and the ground under it elastic, so the pressure is affine over the base, `p = a + b x + c y`, and
//! zero where that would be negative (a Winkler foundation that cannot pull). With normal forces `N_i = w_i p_i` and
//! friction `-kappa_i N_i` (`kappa_i` = coefficient times direction of slip), the three equations about the centre of
//! mass, at height `h`, are
//!
//! ```text
//! sum N_i = W        sum N_i (x_i - h kappa_ix) = M_y        sum N_i (y_i - h kappa_iy) = -M_x
//! ```
//!
//! which is where the load moves forward: braking pitches the body onto its leading edge.

use super::patch::Places;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Force and moment about the centre of mass [N, N m], gravity included, the table's answer not.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    pub force: Vector3<f64>,
    /// Moment about the centre of mass.
    pub moment: Vector3<f64>,
}

impl Wrench {
    /// Weight alone: `gravity` [m/s²] points down on a level table and leans on a tilted one.
    pub fn weight(mass: f64, gravity: Vector3<f64>) -> Self {
        Self { force: gravity * mass, moment: Vector3::zeros() }
    }

    /// Adds a force at a place given from the centre of mass, world axes [N, m].
    pub fn with_force(self, force: Vector3<f64>, lever: Vector3<f64>) -> Self {
        Self { force: self.force + force, moment: self.moment + lever.cross(&force) }
    }

    /// The same in axes turned by the angle of (`cos`, `sin`) about z.
    pub(super) fn in_turned_axes(&self, cos: f64, sin: f64) -> Self {
        let turn = |v: Vector3<f64>| Vector3::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x, v.z);
        Self { force: turn(self.force), moment: turn(self.moment) }
    }

    /// The components that friction has to stand up to: along the table and about its normal.
    pub(super) fn planar(&self) -> Vector3<f64> {
        Vector3::new(self.force.x, self.force.y, self.moment.z)
    }
}

/// Normal force at each place of a patch [N].
pub(super) type Loads<const N: usize> = [f64; N];
/// Friction over normal force at each place, against the friction: coefficient times direction of slip.
pub(super) type Kappas<const N: usize> = [Vector2<f64>; N];

/// Rounds of dropping the places that would pull; each patch seen so far needs at most four.
const DROPS: usize = 12;
/// Relative volume below which three equations do not determine the pressure: it all stands on one line.
const SINGULAR: f64 = 1e-9;

/// The loads under friction `kappas`; `None` when no pressure without pull can balance the body: it lifts.
///
/// `wrench` and `kappas` are in the patch frame.
pub(super) fn solve<const N: usize>(
    places: &Places<'_, N>,
    height: f64,
    wrench: &Wrench,
    kappas: &Kappas<N>,
) -> Option<Loads<N>> {
    let mut levers = *places.points;
    for i in 0..N {
        levers[i] -= kappas[i] * height;
    }
    balance(places, wrench, &levers)
}

/// The loads of a body at rest: its friction as a whole is known, it cancels the planar wrench.
pub(super) fn solve_at_rest<const N: usize>(places: &Places<'_, N>, height: f64, wrench: &Wrench) -> Option<Loads<N>> {
    let friction = Vector2::new(-wrench.force.x, -wrench.force.y);
    let tipping = Vector3::new(height * friction.y, -height * friction.x, 0.0);
    balance(places, &Wrench { force: wrench.force, moment: wrench.moment + tipping }, places.points)
}

/// Finds `p = a + b x + c y >= 0` whose forces act, at the places' `levers`, like the wrench demands.
fn balance<const N: usize>(places: &Places<'_, N>, wrench: &Wrench, levers: &[Vector2<f64>; N]) -> Option<Loads<N>> {
    let weight = -wrench.force.z;
    if weight <= 0.0 {
        return None;
    }
    let demand = Vector3::new(1.0, wrench.moment.y / weight, -wrench.moment.x / weight);
    let mut carrying = *places.shares;
    for _ in 0..DROPS {
        let pressure = pressure_on(places.points, &carrying, demand, levers)?;
        let (mut loads, mut settled) = ([0.0; N], true);
        for i in 0..N {
            let (point, share) = (places.points[i], places.shares[i]);
            let load = share * (pressure.x + pressure.y * point.x + pressure.z * point.y);
            settled &= (carrying[i] > 0.0) == (load > 0.0);
            carrying[i] = if load > 0.0 { share } else { 0.0 };
            loads[i] = weight * load.max(0.0);
        }
        if settled {
            return Some(loads);
        }
    }
    None
}

/// The affine pressure when the places take part by their `shares`.
fn pressure_on<const N: usize>(
    points: &[Vector2<f64>; N],
    shares: &[f64; N],
    demand: Vector3<f64>,
    levers: &[Vector2<f64>; N],
) -> Option<Vector3<f64>> {
    let mut matrix = Matrix3::zeros();
    for i in 0..N {
        let left = Vector3::new(1.0, levers[i].x, levers[i].y) * shares[i];
        matrix += left * Vector3::new(1.0, points[i].x, points[i].y).transpose();
    }
    let [p, q, r] = [matrix.column(0), matrix.column(1), matrix.column(2)];
    let volume = p.dot(&q.cross(&r));
    if volume.abs() <= SINGULAR * matrix[(0, 0)] * q.norm_squared().max(r.norm_squared()) {
        return None;
    }
    // Cramer's rule: three unknowns, and this is the innermost loop of every rollout.
    Some(Vector3::new(demand.dot(&q.cross(&r)), p.dot(&demand.cross(&r)), p.dot(&q.cross(&demand))) / volume)
}
