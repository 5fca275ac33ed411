//! From any motion to rest at a target that may change at any time, inside the limits of speed, acceleration and jerk, all
//! joints arriving together. Planned by `rsruckig` for each new target, then sampled each period. Pure: what comes next
//! depends on the motion, the target and the limits alone. Units: rad, s.

use super::{JointLimits, Joints, Limits, MAX_JOINTS};
use rsruckig::prelude::*;

/// Slower than this no joint is asked to go [rad/s]: a target that allows no more is too near to a stop.
const SLOWEST: f64 = 0.01;
/// Share of the limits of acceleration and jerk that a calm way takes.
const CALM: f64 = 0.8;
/// What a joint that is not there may do, so that the planner has numbers.
const IDLE: f64 = 1.0;

/// The way to a target.
#[derive(Debug)]
pub struct Follower {
    planner: Ruckig<MAX_JOINTS, IgnoreErrorHandler>,
    input: InputParameter<MAX_JOINTS>,
    output: OutputParameter<MAX_JOINTS>,
    limits: Limits,
    fastest: Joints,
}

impl Follower {
    /// At rest at `q`; no joint will go faster than `fastest` [rad/s]. Allocates; what follows does not.
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

    /// The same with four fifths of the limits of acceleration and jerk: what is left lets whoever looks after the arm see a stop
    /// from wherever it is. It goes no way before [`Follower::set_speed`].
    #[must_use]
    pub fn calm(q: &Joints, limits: &Limits, period_s: f64) -> Self {
        let mut calmer = *limits;
        for joint in &mut calmer.joints {
            joint.acceleration = CALM * joint.acceleration.min(joint.deceleration);
            joint.jerk *= CALM;
        }
        Self::at_rest(q, &[0.0; MAX_JOINTS], calmer, period_s)
    }

    /// Goes on from another motion: position, velocity and acceleration of every joint that counts, which are numbers.
    pub fn go_on_from(&mut self, q: &Joints, velocity: &Joints, acceleration: &Joints) {
        for i in 0..self.limits.dof {
            self.input.current_position[i] = q[i];
            self.input.current_velocity[i] = velocity[i];
            self.input.current_acceleration[i] = acceleration[i];
        }
    }

    /// From the next target on, no joint goes faster than this share of its highest speed.
    pub fn set_speed(&mut self, share: f64) {
        self.fastest = std::array::from_fn(|i| share * self.limits.joints[i].velocity);
    }

    /// Goes for `target` from now on.
    ///
    /// # Errors
    /// The first joint, from 0, for which that is beyond its limits, or so near to a stop that the speed limit there leaves
    /// nothing; the way goes on as before then.
    pub fn aim(&mut self, target: &Joints) -> Result<(), usize> {
        let mut speeds = [IDLE; MAX_JOINTS];
        for (i, joint) in self.limits.counted().enumerate() {
            let inside = (joint.q_min..=joint.q_max).contains(&target[i]);
            speeds[i] = self.fastest[i].min(approach_speed(joint, self.input.current_position[i], target[i]));
            // What is no number is neither inside nor fast enough.
            if !(inside && speeds[i] >= SLOWEST) {
                return Err(i);
            }
        }
        for i in 0..self.limits.dof {
            self.input.target_position[i] = target[i];
            self.input.max_velocity[i] = speeds[i];
        }
        Ok(())
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

    /// How fast the joints are to be at the end of the last period [rad/s].
    #[must_use]
    pub fn velocity(&self) -> Joints {
        std::array::from_fn(|i| if i < self.limits.dof { self.input.current_velocity[i] } else { 0.0 })
    }
}

impl JointLimits {
    /// Where a target may lie: the range without what is so near to a stop that a joint may hardly move there [rad].
    #[must_use]
    pub fn targets(&self) -> [f64; 2] {
        let offset = self.velocity_offset;
        let margin = (offset * offset + 4.0 * offset * SLOWEST) / (2.0 * self.deceleration) + 1e-3;
        [self.q_min + margin, self.q_max - margin]
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
        let mut reach = Follower::at_rest(&from, &[0.5; MAX_JOINTS], limits, T);
        assert_eq!(reach.aim(&to), Ok(()));
        for _ in 0..200 {
            reach.step().expect("a way");
        }
        assert_eq!(reach.aim(&from), Ok(()), "turned round in full motion");
        let last = (0..3000).map(|_| reach.step().expect("a way")).last().expect("a position");
        assert!(last.iter().zip(&from).all(|(a, b)| (a - b).abs() < 1e-9), "{last:?}");
    }

    #[test]
    fn a_target_beyond_a_limit_or_at_a_stop_is_refused_and_the_way_goes_on() {
        let limits = Limits::fr3();
        let from = pose(&limits, [0.5; 7]);
        let mut reach = Follower::at_rest(&from, &[1.0; MAX_JOINTS], limits, T);
        for wrong in [limits.joints[0].q_max + 0.01, limits.joints[0].q_max, f64::NAN, f64::INFINITY] {
            let mut target = from;
            target[0] = wrong;
            assert_eq!(reach.aim(&target), Err(0), "{wrong}");
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
            let mut reach = Follower::at_rest(&from, &[fastest; MAX_JOINTS], limits, T);
            let (mut before, mut v_before, mut a_before) = (from, [0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
            for (place, cycles) in places {
                prop_assert_eq!(reach.aim(&pose(&limits, place)), Ok(()));
                for _ in 0..cycles {
                    let q = reach.step().expect("a way");
                    let v: Joints = std::array::from_fn(|i| (q[i] - before[i]) / T);
                    let a: Joints = std::array::from_fn(|i| (v[i] - v_before[i]) / T);
                    for (i, joint) in limits.counted().enumerate() {
                        let [slowest, quickest] = joint.speed_bounds(q[i]);
                        let slack = 1e-6 + joint.acceleration * T;
                        prop_assert!((slowest - slack..=quickest + slack).contains(&v[i]), "joint {i}: {} of {slowest} {quickest}", v[i]);
                        prop_assert!(v[i].abs() <= fastest + 1e-6);
                        prop_assert!(a[i].abs() <= joint.acceleration + 1e-3, "joint {i}: {}", a[i]);
                        let jerk = (a[i] - a_before[i]) / T;
                        prop_assert!(jerk.abs() <= joint.jerk + 1.0, "joint {i}: jerk {jerk}");
                    }
                    (before, v_before, a_before) = (q, v, a);
                }
            }
        }
    }

    #[test]
    fn the_ends_of_where_targets_may_lie_are_taken_and_what_is_beyond_is_not() {
        let limits = Limits::fr3();
        let from = pose(&limits, [0.5; 7]);
        for (joint, of) in limits.counted().enumerate() {
            let [low, high] = of.targets();
            assert!(low < high && high - low > 0.9 * (of.q_max - of.q_min), "{low} {high}");
            for (end, taken) in [(low, true), (high, true), (of.q_min, false), (of.q_max, false)] {
                let mut target = from;
                target[joint] = end;
                let mut follower = Follower::at_rest(&from, &[1.0; MAX_JOINTS], limits, T);
                assert_eq!(follower.aim(&target).is_ok(), taken, "joint {joint} at {end}");
            }
        }
    }

    #[test]
    fn it_goes_on_from_a_motion_without_a_jump() {
        let limits = Limits::fr3();
        let from = pose(&limits, [0.5; 7]);
        let mut follower = Follower::at_rest(&from, &[1.0; MAX_JOINTS], limits, T);
        let mut velocity = [0.0; MAX_JOINTS];
        velocity[3] = 0.4;
        follower.go_on_from(&from, &velocity, &[0.0; MAX_JOINTS]);
        assert_eq!(follower.aim(&from), Ok(()));
        let next = follower.step().expect("a way");
        assert!((next[3] - from[3] - 0.4e-3).abs() < 1e-6, "{next:?}");
        assert!((follower.velocity()[3] - 0.4).abs() < 0.01);
        let last = (0..3000).map(|_| follower.step().expect("a way")).last().expect("a position");
        assert!((last[3] - from[3]).abs() < 1e-9, "and comes back");
    }
}
