//! How fast joints and end effector may go, and how fast that may change. Numbers: the vendor's specification page for
//! system images from 5.9 on.

use crate::safety::{JointLimits, Limits, Trace};
use crate::serve::faults::{Fault, Verdict, all};
use nalgebra::Vector6;
use shared_mem::time::TICK;

/// What single precision loses of an angle between 2 and 4 rad, or of 2 to 4 m. A client that builds on the state's echo
/// builds this into its set points, and each difference divides it by the period once more.
const ECHO: f64 = 1.2e-7;
/// End effector: along and about the axes, speed, acceleration, jerk [m/s.., rad/s..].
const TRANSLATION: [f64; 3] = [3.0, 9.0, 4500.0];
const ROTATION: [f64; 3] = [2.5, 17.0, 8500.0];

/// By which names joints that go too fast are reported.
#[derive(Debug, Clone, Copy)]
pub(super) struct Names {
    velocity: &'static [Fault],
    acceleration: Fault,
    jerk: Fault,
}

/// Commanded joint by joint. The robot raises its own velocity error along with the generator's.
pub(super) const COMMANDED: Names = Names {
    velocity: &[Fault::JointVelocityLimits, Fault::JointVelocity],
    acceleration: Fault::JointVelocityDiscontinuity,
    jerk: Fault::JointAccelerationDiscontinuity,
};

/// Following from a pose that is commanded.
pub(super) const FOLLOWING: Names = Names {
    velocity: &[Fault::CartesianJointVelocityLimits],
    acceleration: Fault::CartesianJointVelocityDiscontinuity,
    jerk: Fault::CartesianJointAccelerationDiscontinuity,
};

/// The rules of the joints.
#[derive(Debug, Clone)]
pub(in crate::serve) struct JointRules {
    pub(in crate::serve) limits: Limits,
}

impl JointRules {
    /// Judges the step from `last` to `next`. A discontinuity outranks what it leads to, so it is reported alone.
    pub(super) fn check(&self, last: &Trace, next: &Trace, names: &Names) -> Verdict {
        let (mut jumps, mut speeding, mut outside) = (Vec::new(), false, false);
        for (i, limits) in self.limits.counted().enumerate() {
            let jerk = (next.a[i] - last.a[i]) / TICK;
            if exceeds(next.a[i].abs(), limits.acceleration + 2.0 * ECHO / (TICK * TICK)) {
                jumps.push(names.acceleration);
            }
            if exceeds(jerk.abs(), limits.jerk + 4.0 * ECHO / (TICK * TICK * TICK)) {
                jumps.push(names.jerk);
            }
            speeding |= next.v[i].abs() > highest_speed(limits, last.q[i], next.v[i]) + ECHO / TICK;
            outside |= !(limits.q_min..=limits.q_max).contains(&next.q[i]);
        }
        match (jumps.is_empty(), outside, speeding) {
            (false, ..) => Err(all(&jumps)),
            // Since libfranka 0.15 the robot reports a generator's position limits by its own.
            (_, true, _) => Err(Fault::JointPositionLimits.alone()),
            (_, _, true) => Err(all(names.velocity)),
            _ => Ok(()),
        }
    }

    /// Judges a motion that ends with `last`: it has to be at rest, as far as one period can stop it.
    pub(super) fn check_end(&self, last: &Trace, names: &Names) -> Verdict {
        let at_rest = |(i, limits): (usize, &JointLimits)| last.v[i].abs() / TICK <= limits.acceleration;
        if self.limits.counted().enumerate().all(at_rest) { Ok(()) } else { Err(names.acceleration.alone()) }
    }
}

/// Whether `value` is more than `most`. What is no number is more than anything.
pub(in crate::serve) fn exceeds(value: f64, most: f64) -> bool {
    value.is_nan() || value > most
}

/// The highest speed in the direction of `v` at `q` [rad/s].
pub(in crate::serve) fn highest_speed(limits: &JointLimits, q: f64, v: f64) -> f64 {
    limits.speed_towards(v.signum(), q, limits.deceleration)
}

/// Judges the end effector by its twist, its rate and the rate of that: linear part, then angular, in SI units.
pub(super) fn check_end_effector(twist: &Vector6<f64>, acceleration: &Vector6<f64>, jerk: &Vector6<f64>) -> Verdict {
    let too_much = |v: &Vector6<f64>, order: usize| {
        let slack = ECHO * 2.0_f64.powi(order as i32) / TICK.powi(order as i32 + 1);
        let (linear, angular) = (v.fixed_rows::<3>(0).norm(), v.fixed_rows::<3>(3).norm());
        exceeds(linear, TRANSLATION[order] + slack) || exceeds(angular, ROTATION[order] + 2.0 * slack)
    };
    let mut jumps = Vec::new();
    if too_much(acceleration, 1) {
        jumps.push(Fault::CartesianVelocityDiscontinuity);
    }
    if too_much(jerk, 2) {
        jumps.push(Fault::CartesianAccelerationDiscontinuity);
    }
    if !jumps.is_empty() {
        return Err(all(&jumps));
    }
    if too_much(twist, 0) {
        return Err(all(&[Fault::CartesianVelocityLimits, Fault::CartesianVelocity]));
    }
    Ok(())
}

/// Judges an end effector that stops here.
pub(super) fn check_end_effector_end(twist: &Vector6<f64>) -> Verdict {
    let (linear, angular) = (twist.fixed_rows::<3>(0).norm(), twist.fixed_rows::<3>(3).norm());
    let at_rest = linear / TICK <= TRANSLATION[1] && angular / TICK <= ROTATION[1];
    if at_rest { Ok(()) } else { Err(Fault::CartesianVelocityDiscontinuity.alone()) }
}

/// Highest speed of the end effector [m/s].
pub(in crate::serve) const END_EFFECTOR_SPEED: f64 = TRANSLATION[0];
