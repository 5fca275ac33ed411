//! From any motion to rest at a target that may change at any time, inside acceleration and jerk limits, all joints arriving
//! together. Planned by `rsruckig` for each new target, then sampled each cycle. Units: rad, s.

use crate::safety::{JointLimits, Limits};
use rsruckig::prelude::*;
use shared_mem::msg::{Joints, MAX_JOINTS};

/// Slower than this no joint is asked to go [rad/s]: a target that allows no more is too near to a stop.
const SLOWEST: f64 = 0.01;
/// What a joint that is not there may do, so that the planner has numbers.
const IDLE: f64 = 1.0;

/// The way to a target.
#[derive(Debug)]
pub struct Reach {
    planner: Ruckig<MAX_JOINTS, IgnoreErrorHandler>,
    input: InputParameter<MAX_JOINTS>,
    output: OutputParameter<MAX_JOINTS>,
    limits: Limits,
    fastest: Joints,
}

impl Reach {
    /// At rest at `q`; no joint will go faster than `fastest` [rad/s]. Allocates.
    #[must_use]
    pub fn at_rest(q: &Joints, fastest: &Joints, limits: Limits, period_s: f64) -> Self {
        let mut input = InputParameter::new(None);
        for i in 0..MAX_JOINTS {
            let joint = limits.joints.get(i).filter(|_| i < limits.dof);
            (input.current_position[i], input.target_position[i]) = (q[i], q[i]);
            input.max_velocity[i] = joint.map_or(IDLE, |joint| fastest[i].min(joint.velocity));
            input.max_acceleration[i] = joint.map_or(IDLE, deceleration);
            input.max_jerk[i] = joint.map_or(IDLE, |joint| joint.jerk);
        }
        Self {
            planner: Ruckig::new(None, period_s),
            input,
            output: OutputParameter::new(None),
            limits,
            fastest: *fastest,
        }
    }

    /// Goes for `target` from now on. `false` where that is beyond a joint's limits, or so near to a stop that the speed
    /// limit there leaves nothing; the way goes on as before then.
    pub fn aim(&mut self, target: &Joints) -> bool {
        let mut speeds = [IDLE; MAX_JOINTS];
        for (i, joint) in self.limits.counted().enumerate() {
            let inside = (joint.q_min..=joint.q_max).contains(&target[i]);
            speeds[i] = self.fastest[i].min(approach_speed(joint, self.input.current_position[i], target[i]));
            // What is no number is neither inside nor fast enough.
            if !(inside && speeds[i] >= SLOWEST) {
                return false;
            }
        }
        for i in 0..self.limits.dof {
            self.input.target_position[i] = target[i];
            self.input.max_velocity[i] = speeds[i];
        }
        true
    }

    /// A period on: where the joints are to be then. `None` where no way is found.
    pub fn step(&mut self) -> Option<Joints> {
        let went = self.planner.update(&self.input, &mut self.output);
        if !matches!(went, Ok(RuckigResult::Working | RuckigResult::Finished)) {
            return None;
        }
        self.output.pass_to_input(&mut self.input);
        let q: Joints = std::array::from_fn(|i| self.input.current_position[i]);
        q.iter().all(|q| q.is_finite()).then_some(q)
    }
}

/// Deceleration at the end of the way: no more than the speed limit near a stop counts on.
fn deceleration(joint: &JointLimits) -> f64 {
    joint.acceleration.min(joint.deceleration)
}

/// The speed from which a joint can be braked to rest at `target` without ever being faster than the speed limit near the
/// stop ahead. With `x` to go, braking at `a <= dec` is at `v = sqrt(2 a x)`, the limit at `sqrt(2 dec (x + left)) - offset`;
/// the limit is the higher one as long as `(v + offset)^2 <= v^2 + 2 dec left`.
fn approach_speed(joint: &JointLimits, from: f64, target: f64) -> f64 {
    let left = if target >= from { joint.q_max - target } else { target - joint.q_min };
    let (room, offset) = (2.0 * joint.deceleration * left, joint.velocity_offset);
    let brakeable = if offset > 0.0 { (room - offset * offset) / (2.0 * offset) } else { f64::INFINITY };
    brakeable.clamp(0.0, joint.velocity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::Trace;
    use proptest::prelude::*;

    const T: f64 = 1e-3;

    fn pose(limits: &Limits, places: [f64; 7]) -> Joints {
        std::array::from_fn(|i| {
            places.get(i).map_or(0.0, |place| {
                let joint = &limits.joints[i];
                joint.q_min + place * (joint.q_max - joint.q_min)
            })
        })
    }

    #[test]
    fn a_target_is_reached_at_rest_and_the_next_one_taken_up_in_full_motion() {
        let limits = Limits::fr3();
        let (from, to) = (pose(&limits, [0.5; 7]), pose(&limits, [0.55; 7]));
        let mut reach = Reach::at_rest(&from, &[0.5; MAX_JOINTS], limits, T);
        assert!(reach.aim(&to));
        for _ in 0..200 {
            reach.step().expect("a way");
        }
        assert!(reach.aim(&from), "turned round in full motion");
        let last = (0..3000).map(|_| reach.step().expect("a way")).last().expect("a position");
        assert!(last.iter().zip(&from).all(|(a, b)| (a - b).abs() < 1e-9), "{last:?}");
    }

    #[test]
    fn a_target_beyond_a_limit_or_at_a_stop_is_refused_and_the_way_goes_on() {
        let limits = Limits::fr3();
        let from = pose(&limits, [0.5; 7]);
        let mut reach = Reach::at_rest(&from, &[1.0; MAX_JOINTS], limits, T);
        for wrong in [limits.joints[0].q_max + 0.01, limits.joints[0].q_max, f64::NAN, f64::INFINITY] {
            let mut target = from;
            target[0] = wrong;
            assert!(!reach.aim(&target), "{wrong}");
        }
        assert_eq!(reach.step(), Some(from));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn whatever_the_targets_no_joint_leaves_its_limits(
            places in prop::collection::vec((prop::array::uniform7(0.06..0.94_f64), 1_usize..800), 1..5),
            fastest in 0.1..6.0_f64,
        ) {
            let limits = Limits::fr3();
            let from = pose(&limits, [0.5; 7]);
            let mut reach = Reach::at_rest(&from, &[fastest; MAX_JOINTS], limits, T);
            let mut trace = Trace::at_rest(from);
            for (place, cycles) in places {
                prop_assert!(reach.aim(&pose(&limits, place)));
                for _ in 0..cycles {
                    let next = trace.after(&reach.step().expect("a way"), T);
                    for (i, joint) in limits.counted().enumerate() {
                        let [slowest, quickest] = joint.speed_bounds(next.q[i]);
                        let slack = 1e-6 + joint.acceleration * T;
                        prop_assert!((slowest - slack..=quickest + slack).contains(&next.v[i]), "joint {i}: {} of {slowest} {quickest}", next.v[i]);
                        prop_assert!(next.v[i].abs() <= fastest + 1e-6);
                        prop_assert!(next.a[i].abs() <= joint.acceleration + 1e-3, "joint {i}: {}", next.a[i]);
                        let jerk = (next.a[i] - trace.a[i]) / T;
                        prop_assert!(jerk.abs() <= joint.jerk + 1.0, "joint {i}: jerk {jerk}");
                    }
                    trace = next;
                }
            }
        }
    }
}
