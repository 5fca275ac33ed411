//! The way of every joint to rest, each as fast as its limits of acceleration and jerk allow: full jerk until the largest
//! deceleration that is needed, that deceleration, full jerk back. In closed form, so there is nothing that could fail to be
//! found, and the brake drives exactly what the guard looked along. Pure.
//!
//! Source: the third-order velocity interface of Berscheid and Kröger, Jerk-limited Real-time Trajectory Generation with
//! Arbitrary Target States (2021), for the target 0.

use super::{JointLimits, Limits, Trace};
use shared_mem::msg::{Joints, MAX_JOINTS};

/// One joint's way: three phases of constant jerk, then rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct JointStop {
    phases: [Phase; 3],
    /// Where it comes to rest [rad].
    end: f64,
    /// 1 where the joint moves towards larger positions before it rests, else -1.
    direction: f64,
    jerk: f64,
    duration: f64,
}

/// Constant jerk from a state on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Phase {
    length: f64,
    q: f64,
    v: f64,
    a: f64,
    jerk: f64,
}

impl Phase {
    fn at(&self, t: f64) -> [f64; 3] {
        [
            self.q + t * (self.v + t * (self.a / 2.0 + t * self.jerk / 6.0)),
            self.v + t * (self.a + t * self.jerk / 2.0),
            self.a + t * self.jerk,
        ]
    }
}

impl JointStop {
    /// From position `q`, speed `v` and acceleration `a`, which counts as no more than the limit.
    fn of([q, v, a]: [f64; 3], limits: &JointLimits) -> Self {
        let (most, jerk) = (limits.acceleration, limits.jerk);
        let a = a.clamp(-most, most);
        // The speed that is left when the acceleration is taken back at once.
        let direction = if v + a * a.abs() / (2.0 * jerk) < 0.0 { -1.0 } else { 1.0 };
        let (speed, speeding) = (direction * v, direction * a);
        // Without a phase of constant deceleration this one would be needed.
        let needed = (jerk * speed + speeding * speeding / 2.0).max(0.0).sqrt();
        let deceleration = needed.min(most);
        let held = (speed + speeding * speeding / (2.0 * jerk)) / most - most / jerk;
        let lengths = [
            ((speeding + deceleration) / jerk).max(0.0),
            if needed > most { held.max(0.0) } else { 0.0 },
            deceleration / jerk,
        ];
        let mut stop = Self { direction, jerk, duration: lengths.iter().sum(), ..Self::default() };
        let mut state = [q, v, a];
        for ((phase, length), turn) in stop.phases.iter_mut().zip(lengths).zip([-1.0, 0.0, 1.0]) {
            *phase = Phase { length, q: state[0], v: state[1], a: state[2], jerk: turn * direction * jerk };
            state = phase.at(length);
        }
        stop.end = state[0];
        stop
    }

    /// Position, speed, the highest speed from then on, at most the way that is left, and how much the speed changes.
    fn at(&self, t: f64) -> [f64; 5] {
        let mut since = t;
        for phase in &self.phases {
            if since < phase.length {
                let [q, v, a] = phase.at(since);
                let speeding = (self.direction * a).max(0.0);
                let peak = self.direction * v + speeding * speeding / (2.0 * self.jerk);
                let fastest = v.abs().max(peak);
                // A joint that moves the other way first comes back past here.
                let left = if self.direction * v < 0.0 { fastest * (self.duration - t) } else { (self.end - q).abs() };
                // Up to the peak, and from there to 0.
                return [q, v, fastest, left, 2.0 * peak - self.direction * v];
            }
            since -= phase.length;
        }
        [self.end, 0.0, 0.0, 0.0, 0.0]
    }
}

/// The way of all joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopping {
    joints: [JointStop; MAX_JOINTS],
    dof: usize,
    duration: f64,
}

/// A moment on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Positions [rad].
    pub q: Joints,
    /// Velocities [rad/s].
    pub dq: Joints,
    /// The highest speed of each joint from then on [rad/s].
    pub fastest: Joints,
    /// How far each joint still moves from then on, at most [rad].
    pub left: Joints,
    /// By how much each joint's velocity changes from then on, up and down added [rad/s].
    pub change: Joints,
}

impl Stopping {
    /// From what was commanded last, periods of `period_s` apart. Its numbers must be finite.
    pub fn of(trace: &Trace, limits: &Limits, period_s: f64) -> Self {
        let mut way = Self { joints: [JointStop::default(); MAX_JOINTS], dof: limits.dof, duration: 0.0 };
        for (i, joint) in limits.counted().enumerate() {
            let stop = JointStop::of([trace.q[i], trace.velocity_now(i, period_s), trace.a[i]], joint);
            way.duration = way.duration.max(stop.duration);
            way.joints[i] = stop;
        }
        way
    }

    /// `t` seconds after it began. Joints that do not count are at 0.
    pub fn at(&self, t: f64) -> Moment {
        let nothing = [0.0; MAX_JOINTS];
        let mut moment = Moment { q: nothing, dq: nothing, fastest: nothing, left: nothing, change: nothing };
        for (i, joint) in self.joints.iter().enumerate().take(self.dof) {
            [moment.q[i], moment.dq[i], moment.fastest[i], moment.left[i], moment.change[i]] = joint.at(t);
        }
        moment
    }

    /// When the last joint comes to rest [s].
    pub fn duration(&self) -> f64 {
        self.duration
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nothing_jumps_no_limit_is_passed_and_what_is_still_to_come_is_no_more_than_said(
            v in -5.0..5.0_f64, a in -12.0..12.0_f64,
        ) {
            let joint = Limits::fr3().joints[0];
            let stop = JointStop::of([0.3, v, a], &joint);
            let mut before = stop.at(0.0);
            prop_assert!((before[0] - 0.3).abs() < 1e-12 && (before[1] - v).abs() < 1e-12 || stop.duration == 0.0);
            let step = 1e-4;
            for k in 1..=(stop.duration / step) as u32 + 2 {
                let now = stop.at(f64::from(k) * step);
                prop_assert!((now[0] - before[0]).abs() <= before[2] * step + 1e-12);
                prop_assert!((now[1] - before[1]).abs() <= joint.acceleration * step + 1e-9);
                prop_assert!(now[1].abs() <= before[2] + 1e-12 && now[2] <= before[2] + 1e-12);
                prop_assert!(before[3] - now[3] >= (now[0] - before[0]).abs() - 1e-9, "{before:?} {now:?}");
                prop_assert!(before[4] - now[4] >= (now[1] - before[1]).abs() - 1e-9, "{before:?} {now:?}");
                before = now;
            }
            prop_assert_eq!(before, [stop.end, 0.0, 0.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn what_rests_stays() {
        let trace = Trace::at_rest([0.4; MAX_JOINTS]);
        let way = Stopping::of(&trace, &Limits::fr3(), 1e-3);
        assert_eq!(way.duration(), 0.0);
        assert_eq!(way.at(0.0).q[..7], trace.q[..7]);
        assert_eq!(way.at(1.0).fastest, [0.0; MAX_JOINTS]);
    }
}
