//! From any motion to rest at a target that may change at any time, inside the limits of speed, acceleration and jerk, all
//! joints arriving together. Planned by `rsruckig` for each new target, then sampled each period. Speed limits that fall
//! towards the end of a joint's range are no matter of its: the highest speed is one from which the joint can be braked to rest
//! at the target below such a limit, or the limit where the joint is, set anew on the way. Pure: what comes next depends on
//! the motion, the target and the limits alone. Units: rad, s.

use super::{JointLimits, Joints, Limits, MAX_JOINTS};
use rsruckig::prelude::*;

/// Slower than this no joint is asked to go [rad/s]: a target that allows no more is too near to a stop.
const SLOWEST: f64 = 0.01;
/// Share of the limits of acceleration and jerk that a calm way takes.
const CALM: f64 = 0.8;
/// Share of the highest speeds: who knows a way by its positions alone sees the last moment of a speeding-up a little faster
/// than it is (at 1 kHz by 8 mrad/s at most), and that must not be above the limit either.
const CALM_SPEED: f64 = 0.995;
/// The same near a stop, where the speed limit falls: as a distance [rad].
const UNSEEN: f64 = 1.2e-3;
/// Periods after which the highest speed near a stop is set anew.
const PERIODS_PER_SPEED_LIMIT: u32 = 10;
/// Share of the deceleration that stopping counts on with which the speed falls on the way towards a stop: less than a calm
/// way brakes with, so that it can be kept.
const FALLING: f64 = 0.6;
/// Longest period of whoever plans [s].
const LONGEST_PERIOD: f64 = 2e-3;
/// What a joint that is not there may do, so that the planner has numbers.
const IDLE: f64 = 1.0;

/// The way to a target.
///
/// ```
/// use twin::arm::{ArmModel, Follower, Limits, MAX_JOINTS};
///
/// let arm = ArmModel::fr3();
/// let mut target = *arm.ready();
/// target[0] += 0.1; // rad
/// let mut follower = Follower::at_rest(arm.ready(), &[0.5; MAX_JOINTS], Limits::fr3(), 1e-3); // rad/s, s
/// follower.aim(&target).expect("within the joints' limits");
/// let mut q = *arm.ready();
/// let mut periods = 0;
/// while let Some(next) = follower.step() {
///     assert!((next[0] - q[0]).abs() <= 0.5e-3 + 1e-9, "never faster than it may");
///     (q, periods) = (next, periods + 1);
///     if (q[0] - target[0]).abs() < 1e-6 || periods > 5000 {
///         break;
///     }
/// }
/// assert!((q[0] - target[0]).abs() < 1e-6 && periods > 200);
/// ```
#[derive(Debug)]
pub struct Follower {
    planner: Ruckig<MAX_JOINTS, IgnoreErrorHandler>,
    input: InputParameter<MAX_JOINTS>,
    output: OutputParameter<MAX_JOINTS>,
    limits: Limits,
    fastest: Joints,
    ahead: LookAhead,
    /// Since the speeds were set.
    periods: u32,
}

/// What is left free before a joint's stop for whoever looks ahead whether the joint can be braked.
#[derive(Debug, Clone, Copy)]
enum LookAhead {
    /// Nothing: the speed limit where the joint is counts alone.
    No,
    /// Until a stop begins the joint goes on, as long as turning the highest acceleration into the highest deceleration
    /// takes, and this long [s].
    Stop(f64),
}

impl Follower {
    /// At rest at `q`; no joint will go faster than `fastest` [rad/s]. Allocates; what follows does not.
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
            ahead: LookAhead::No,
            periods: 0,
        }
    }

    /// The same with four fifths of the limits of acceleration and jerk, and slower towards the joints' stops: what is left
    /// lets whoever looks after the arm see a stop from wherever it is. It goes no way before [`Follower::set_speed`].
    pub fn calm(q: &Joints, limits: &Limits, period_s: f64) -> Self {
        let mut calm = Self::at_rest(q, &[0.0; MAX_JOINTS], *limits, period_s);
        for (i, joint) in limits.counted().enumerate() {
            calm.input.max_acceleration[i] = CALM * deceleration(joint);
            calm.input.max_jerk[i] = CALM * joint.jerk;
        }
        calm.ahead = LookAhead::Stop(period_s);
        calm
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
        self.fastest = std::array::from_fn(|i| share * CALM_SPEED * self.limits.joints[i].velocity);
    }

    /// Goes for `target` from now on.
    ///
    /// # Errors
    /// The first joint, from 0, for which that is beyond its limits, or so near to a stop that the speed limit there leaves
    /// nothing; the way goes on as before then.
    pub fn aim(&mut self, target: &Joints) -> Result<(), usize> {
        for (i, joint) in self.limits.counted().enumerate() {
            let inside = (joint.q_min..=joint.q_max).contains(&target[i]);
            // What is no number is neither inside nor fast enough.
            if !(inside && self.fastest[i].min(self.brakeable_speed(i, target[i])) >= SLOWEST) {
                return Err(i);
            }
        }
        for (i, q) in target.iter().enumerate().take(self.limits.dof) {
            self.input.target_position[i] = *q;
        }
        self.set_speeds();
        self.input.synchronization = Synchronization::Time;
        Ok(())
    }

    /// How fast the joints may go on the way from where they are.
    fn set_speeds(&mut self) {
        self.periods = 0;
        for i in 0..self.limits.dof {
            let at_target = self.brakeable_speed(i, self.input.target_position[i]);
            self.input.max_velocity[i] = self.fastest[i].min(at_target.max(self.speed_here(i))).max(SLOWEST);
        }
    }

    /// The speed from which a joint can be braked to rest at `target` without ever being faster than the speed limit near the
    /// stop ahead. With `x` to go, braking at `a` is at `v = sqrt(2 a x)`; the limit there, the time `r` later, is
    /// `sqrt(2 s (x + left - r v)) - offset`. It is the higher one as long as
    /// `(s / a - 1) v² - 2 (offset + s r) v + 2 s left - offset² >= 0`, up to the smaller root.
    fn brakeable_speed(&self, i: usize, target: f64) -> f64 {
        let (joint, braking) = (&self.limits.joints[i], self.input.max_acceleration[i]);
        let end = self.way_to_stop(i, target, target);
        let (stopping, reaction, left) = match self.ahead {
            LookAhead::No => (joint.deceleration, 0.0, end),
            LookAhead::Stop(period_s) => (joint.stopping(), reaction(joint, period_s), end - UNSEEN),
        };
        let (gain, loss) = (stopping / braking - 1.0, joint.velocity_offset + stopping * reaction);
        let room = 2.0 * stopping * left - joint.velocity_offset * joint.velocity_offset;
        let under_root = loss * loss - gain * room;
        let brakeable = if under_root > 0.0 { room / (loss + under_root.sqrt()) } else { f64::INFINITY };
        brakeable.clamp(0.0, joint.velocity)
    }

    /// The speed limit where a joint is, as it will be when it is set anew, by a deceleration that is less than there is: a
    /// joint that keeps it can go on keeping it. `(v + offset)² = 2 s (left - r v)`.
    fn speed_here(&self, i: usize) -> f64 {
        let LookAhead::Stop(period_s) = self.ahead else { return 0.0 };
        let joint = &self.limits.joints[i];
        let left = self.way_to_stop(i, self.input.target_position[i], self.input.current_position[i]) - UNSEEN;
        let (stopping, reaction) =
            (FALLING * joint.stopping(), reaction(joint, period_s) + f64::from(PERIODS_PER_SPEED_LIMIT) * period_s);
        let loss = joint.velocity_offset + stopping * reaction;
        let room = 2.0 * stopping * left - joint.velocity_offset * joint.velocity_offset;
        // 0 where it is no number, of a joint without stops.
        (room / (loss + (loss * loss + room).max(0.0).sqrt())).max(0.0).min(joint.velocity)
    }

    /// From `position` to the stop that lies in the direction of `target` [rad].
    fn way_to_stop(&self, i: usize, target: f64, position: f64) -> f64 {
        let joint = &self.limits.joints[i];
        let upwards = target >= self.input.current_position[i];
        if upwards { joint.q_max - position } else { position - joint.q_min }
    }

    /// A period on: where the joints are to be then. `None` where no way is found.
    pub fn step(&mut self) -> Option<Joints> {
        self.periods += 1;
        if self.periods >= PERIODS_PER_SPEED_LIMIT && matches!(self.ahead, LookAhead::Stop(_)) {
            self.set_speeds();
        }
        if !self.goes_on() {
            // Each by itself where they cannot be made to arrive together.
            self.input.synchronization = Synchronization::None;
            if !self.goes_on() {
                return None;
            }
        }
        self.output.pass_to_input(&mut self.input);
        let q: Joints = std::array::from_fn(|i| self.input.current_position[i]);
        q.iter().all(|q| q.is_finite()).then_some(q)
    }

    fn goes_on(&mut self) -> bool {
        let went = self.planner.update(&self.input, &mut self.output);
        matches!(went, Ok(RuckigResult::Working | RuckigResult::Finished))
    }

    /// How fast the joints are to be at the end of the last period [rad/s].
    pub fn velocity(&self) -> Joints {
        std::array::from_fn(|i| if i < self.limits.dof { self.input.current_velocity[i] } else { 0.0 })
    }
}

impl JointLimits {
    /// Where a target may lie: the range without what is so near to a stop that a joint may hardly move there [rad].
    pub fn targets(&self) -> [f64; 2] {
        let (offset, stopping) = (self.velocity_offset, self.stopping());
        let loss = offset + stopping * reaction(self, LONGEST_PERIOD);
        let margin = (offset * offset + 2.0 * loss * SLOWEST) / (2.0 * stopping) + UNSEEN + 1e-4;
        [self.q_min + margin, self.q_max - margin]
    }
}

/// How long a joint goes on before it is braked: turning the highest acceleration into the highest deceleration, and a period [s].
fn reaction(joint: &JointLimits, period_s: f64) -> f64 {
    2.0 * joint.acceleration / joint.jerk + period_s
}

/// Deceleration at the end of the way: no more than the speed limit near a stop counts on.
fn deceleration(joint: &JointLimits) -> f64 {
    joint.acceleration.min(joint.deceleration)
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
