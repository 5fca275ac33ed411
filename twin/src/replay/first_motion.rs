//! How an object moved when its clip began, from noisy poses: one that flies, by the whole of its flight as that of a rigid
//! body; one that slides already, by its first poses under the friction that it has. Each clip so begins from its own fitted
//! start. Base frame, SI.
//!
//! In flight the centre of mass falls freely and the angular momentum `L` stays (Goldstein, Poole, Safko 2002, Classical
//! Mechanics, section 5.6): `dR/dt = (R J^-1 R' L) x R`. Rotation and `L` are those with the least squares of the rotations left.

use crate::rollout::ObjectState;
use crate::scene::ObjectModel;
use nalgebra::{DMatrix, DVector, Isometry3, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::GRAVITY;
use shared_mem::frames::Pose;
use shared_mem::recording::ObjectSeries;

/// Poses that a slide's first motion is estimated from, and a flight's before the whole of it counts: about 70 ms of a fast
/// tracker.
const FIRST_POSES: usize = 10;
/// Poses of a flight that count: beyond, a start that is known to a hundredth of the noise gains nothing.
const MOST_POSES: usize = 100;
/// Steps of the fit to rotations.
const FIT_STEPS: usize = 4;
/// Longest step of the free rotation [s].
const LONGEST: f64 = 0.01;
/// Difference steps of the fit: of the rotation [rad] and of the angular velocity [rad/s].
const DIFFERENCES: [f64; 2] = [1e-4, 1e-3];

/// Pose and velocities of the geometric centre at the first pose; `flying`: how many poses there are before the table may
/// touch the object. `None` with fewer than three poses.
pub(super) fn first_motion(series: &ObjectSeries, flying: usize, object: &ObjectModel) -> Option<ObjectState> {
    let flies = flying >= 3;
    let count = if flies { flying.min(MOST_POSES) } else { FIRST_POSES }.min(series.len());
    let poses: Vec<Isometry3<f64>> = series.poses[..count].iter().map(Pose::isometry).collect();
    let times: Vec<f64> =
        series.stamps_ns[..count].iter().map(|stamp| (stamp - series.stamps_ns[0]) as f64 * 1e-9).collect();
    let first = count.min(FIRST_POSES);
    let middle = poses.get(first / 2).filter(|_| count >= 3)?.rotation;
    let turns = poses[..first].iter().map(|pose| (pose.rotation * middle.inverse()).scaled_axis());
    let (turn, spin) = line(&times[..first], &turns.collect::<Vec<_>>());
    let begun = Rotation { at_start: UnitQuaternion::from_scaled_axis(turn) * middle, spin };
    let rotation = if flies { begun.fitted(&times, &poses, inertia(object)) } else { begun };
    let centre = |pose: &Isometry3<f64>| pose.translation.vector + pose.rotation * object.centre_of_mass;
    let places: Vec<Vector3<f64>> = poses.iter().map(centre).collect();
    let gravity = Vector3::z() * if flies { -GRAVITY } else { 0.0 };
    let (mut place, mut velocity) = under(gravity, &times, &places);
    let braked = GRAVITY * object.friction;
    // What stops meanwhile, or never moved, is no slide at a steady deceleration.
    if !flies && velocity.norm() > braked * times[count - 1] {
        (place, velocity) = under(velocity.normalize() * -braked, &times, &places);
    }
    let from_mass = rotation.at_start * -object.centre_of_mass;
    let pose = Isometry3::from_parts(Translation3::from(place + from_mass), rotation.at_start);
    let velocity = velocity + rotation.spin.cross(&from_mass);
    Some(ObjectState { pose: Pose::from_isometry(pose), velocity, angular_velocity: rotation.spin })
}

/// Place and velocity at time 0 of points that move under a constant acceleration.
fn under(acceleration: Vector3<f64>, times: &[f64], places: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let straight = times.iter().zip(places).map(|(t, place)| place - acceleration * (0.5 * t * t));
    line(times, &straight.collect::<Vec<_>>())
}

/// Value at time 0 and slope of the straight line through points over time.
fn line(times: &[f64], points: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let n = points.len() as f64;
    let time = times.iter().sum::<f64>() / n;
    let value = points.iter().sum::<Vector3<f64>>() / n;
    let spread = times.iter().map(|t| (t - time).powi(2)).sum::<f64>();
    let slope = points.iter().zip(times).map(|(point, t)| (point - value) * (t - time)).sum::<Vector3<f64>>() / spread;
    (value - slope * time, slope)
}

/// Principal moments of inertia over the mass, as of a box of the object's extents [m²].
fn inertia(object: &ObjectModel) -> Vector3<f64> {
    let square = object.shape.half_extents().map(|half| half * half / 3.0);
    Vector3::new(square.y + square.z, square.x + square.z, square.x + square.y)
}

/// How a free body turns.
#[derive(Debug, Clone, Copy)]
struct Rotation {
    at_start: UnitQuaternion<f64>,
    /// Angular velocity there.
    spin: Vector3<f64>,
}

impl Rotation {
    /// The one that leaves the least of all rotations, from this one on; this one where none does.
    fn fitted(mut self, times: &[f64], poses: &[Isometry3<f64>], inertia: Vector3<f64>) -> Self {
        let left = |rotation: &Self| -> DVector<f64> {
            let turned = rotation.over(times, inertia);
            let left = poses.iter().zip(turned).map(|(pose, turned)| (pose.rotation * turned.inverse()).scaled_axis());
            DVector::from_vec(left.flat_map(|left| [left.x, left.y, left.z]).collect())
        };
        let mut residuals = left(&self);
        for _ in 0..FIT_STEPS {
            let mut slopes = DMatrix::zeros(residuals.len(), 6);
            for k in 0..6 {
                let step = DIFFERENCES[k / 3];
                let moved = left(&self.moved(&DVector::from_fn(6, |i, _| if i == k { step } else { 0.0 })));
                slopes.set_column(k, &((moved - &residuals) / step));
            }
            let Some(factor) = slopes.tr_mul(&slopes).cholesky() else { return self };
            let next = self.moved(&factor.solve(&(slopes.tr_mul(&residuals) * -1.0)));
            let after = left(&next);
            if after.norm_squared() >= residuals.norm_squared() {
                return self;
            }
            (self, residuals) = (next, after);
        }
        self
    }

    /// Turned first by the first three numbers [rad], and faster by the last three [rad/s].
    fn moved(&self, by: &DVector<f64>) -> Self {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], by[2]));
        Self { at_start: turn * self.at_start, spin: self.spin + Vector3::new(by[3], by[4], by[5]) }
    }

    /// The rotations at ascending times from 0 on, by the midpoint rule.
    fn over(&self, times: &[f64], inertia: Vector3<f64>) -> Vec<UnitQuaternion<f64>> {
        let momentum = self.at_start * inertia.component_mul(&(self.at_start.inverse() * self.spin));
        let spin = |at: &UnitQuaternion<f64>| at * (at.inverse() * momentum).component_div(&inertia);
        let (mut at, mut now) = (self.at_start, 0.0);
        let mut to = |time: &f64| {
            let parts = ((time - now) / LONGEST).ceil();
            let dt = (time - now) / parts.max(1.0);
            for _ in 0..parts as usize {
                let half = UnitQuaternion::from_scaled_axis(spin(&at) * (0.5 * dt)) * at;
                at = UnitQuaternion::from_scaled_axis(spin(&half) * dt) * at;
            }
            now = *time;
            at
        };
        times.iter().map(&mut to).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ObjectShape;
    use shared_mem::cell::Support;

    fn object(half_extents: Vector3<f64>, centre_of_mass: Vector3<f64>) -> ObjectModel {
        ObjectModel {
            shape: ObjectShape::Box { half_extents },
            mass: 0.3,
            centre_of_mass,
            friction: 0.2,
            tip_friction: 0.2,
            restitution: 0.0,
            support: Support::Corners,
        }
    }

    /// Poses every 10 ms but for each 30th, which the tracker missed.
    fn series(count: u64, at: impl Fn(f64) -> Isometry3<f64>) -> ObjectSeries {
        let rows = || (0..count).filter(|row| row % 30 != 7);
        let poses = rows().map(|row| Pose::from_isometry(at(row as f64 * 0.01))).collect();
        ObjectSeries { stamps_ns: rows().map(|row| 5 + row * 10_000_000).collect(), poses }
    }

    #[test]
    fn a_toss_is_continued_from_the_whole_of_its_flight() {
        let object = object(Vector3::new(0.05, 0.03, 0.07), Vector3::new(0.004, -0.002, 0.01));
        let begun =
            Rotation { at_start: UnitQuaternion::from_euler_angles(0.3, 0.5, 1.0), spin: Vector3::new(2.0, 6.0, -1.0) };
        let velocity = Vector3::new(1.0, -0.5, 0.3);
        let noise = |t: f64, k: f64| 1e-3 * (1e4 * t * k + k).sin();
        let at = |t: f64| {
            let steps: Vec<f64> = (0..=1000).map(|k| t * f64::from(k) / 1000.0).collect();
            let rotation = begun.over(&steps, inertia(&object))[1000];
            let mass = Vector3::new(0.1, 0.2, 0.6) + velocity * t - Vector3::z() * (0.5 * GRAVITY * t * t);
            let place =
                mass - rotation * object.centre_of_mass + Vector3::new(noise(t, 1.0), noise(t, 2.0), noise(t, 3.0));
            Isometry3::from_parts(place.into(), rotation)
        };
        let tossed = series(30, at);
        let [whole, first] = [29, 10].map(|flying| first_motion(&tossed, flying, &object).expect("poses"));
        let lever = begun.at_start * -object.centre_of_mass;
        let off = |found: &ObjectState| (found.velocity - velocity - begun.spin.cross(&lever)).norm();
        assert!(off(&whole) < 4e-3 && off(&whole) < 0.5 * off(&first), "{} {}", off(&whole), off(&first));
        assert!((whole.angular_velocity - begun.spin).norm() < 1e-3, "{}", whole.angular_velocity);
        assert!(whole.pose.isometry().rotation.angle_to(&begun.at_start) < 1e-4);
    }

    #[test]
    fn a_slide_that_has_begun_is_as_fast_as_before_friction_braked_it_and_what_rests_stays() {
        let object = object(Vector3::repeat(0.05), Vector3::zeros());
        let at = |t: f64| Isometry3::translation(0.5 * t - 0.5 * 0.2 * GRAVITY * t * t, 0.0, 0.05);
        let slid = first_motion(&series(30, at), 0, &object).expect("poses");
        assert!((slid.velocity - Vector3::x() * 0.5).norm() < 1e-3, "{}", slid.velocity);
        let rests = first_motion(&series(30, |_| Isometry3::translation(0.5, 0.0, 0.05)), 0, &object).expect("poses");
        assert!(rests.velocity.norm() < 1e-12 && rests.angular_velocity.norm() < 1e-12, "{rests:?}");
    }
}
