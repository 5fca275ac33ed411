//! From one pose of the arm to another, rest to rest: joint by joint as fast as a calm motion may be, all arriving together.
//! Pure; rad, s.
//!
//! The only `rsruckig` code of this crate.

use super::rate::RATE;
use rsruckig::prelude::*;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::JointLimits;

/// Share of the limits of acceleration and jerk that a transit uses.
const LIMITS_SHARE: f64 = 0.4;
/// Nobody is surprised by an arm this slow [rad/s].
const MAX_SPEED: f64 = 0.8;
/// What a joint that is not there may do, so that the planner has numbers.
const ABSENT_JOINT_LIMIT: f64 = 1.0;

/// Set points of the way, the first in `from` and the last in `to`, one a control cycle, at a share `pace` of the usual
/// speed; `None` where no way is found.
pub fn plan(from: &Joints, to: &Joints, limits: &[JointLimits], pace: f64) -> Option<Vec<SetPoint>> {
    let mut input = InputParameter::<MAX_JOINTS>::new(None);
    input.synchronization = Synchronization::Time;
    for joint in 0..MAX_JOINTS {
        let limit = limits.get(joint);
        input.current_position[joint] = from[joint];
        input.target_position[joint] = if limit.is_some() { to[joint] } else { from[joint] };
        input.max_velocity[joint] =
            pace * limit.map_or(ABSENT_JOINT_LIMIT, |limit| MAX_SPEED.min(LIMITS_SHARE * limit.velocity));
        input.max_acceleration[joint] = LIMITS_SHARE * limit.map_or(ABSENT_JOINT_LIMIT, |limit| limit.acceleration);
        input.max_jerk[joint] = LIMITS_SHARE * limit.map_or(ABSENT_JOINT_LIMIT, |limit| limit.jerk);
    }
    let mut planner = Ruckig::<MAX_JOINTS, IgnoreErrorHandler>::new(None, RATE.recip());
    let mut plan = Trajectory::new(None);
    if !matches!(planner.calculate(&input, &mut plan), Ok(RuckigResult::Working)) {
        return None;
    }
    let cycles = (plan.get_duration() * RATE).ceil() as usize + 1;
    let mut points: Vec<SetPoint> = (0..cycles).map(|k| sample(&plan, k as f64 / RATE)).collect::<Option<_>>()?;
    points.push(SetPoint { q_d: *to, dq_d: [0.0; MAX_JOINTS] });
    Some(points)
}

fn sample(plan: &Trajectory<MAX_JOINTS>, time: f64) -> Option<SetPoint> {
    let mut q = DataArrayOrVec::Stack([0.0; MAX_JOINTS]);
    let mut dq = DataArrayOrVec::Stack([0.0; MAX_JOINTS]);
    let time = time.min(plan.get_duration());
    plan.at_time(time, &mut Some(&mut q), &mut Some(&mut dq), &mut None, &mut None, &mut None);
    let mut point = SetPoint::default();
    for joint in 0..MAX_JOINTS {
        (point.q_d[joint], point.dq_d[joint]) = (*q.get(joint)?, *dq.get(joint)?);
    }
    point.q_d.iter().chain(&point.dq_d).all(|x| x.is_finite()).then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::limits;
    use proptest::prelude::*;
    use shared_mem::cell::{Cell, Robot};

    fn fr3() -> (Body, Vec<JointLimits>) {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), ..Cell::default() };
        let body = Body::of(&cell).expect("an FR3");
        let limits = limits::of(&cell, &body);
        (body, limits)
    }

    proptest! {
        #[test]
        fn any_two_poses_are_joined_from_rest_to_rest_inside_the_limits(
            places in prop::array::uniform2(prop::array::uniform7(0.1..0.9_f64)),
        ) {
            let (_, limits) = fr3();
            let pose = |places: [f64; 7]| -> Joints {
                std::array::from_fn(|j| {
                    limits.get(j).map_or(0.0, |limit| limit.q_min + places[j] * (limit.q_max - limit.q_min))
                })
            };
            let [from, to] = places.map(pose);
            let points = plan(&from, &to, &limits, 1.0).expect("a way");
            let [first, last] = [&points[0], &points[points.len() - 1]];
            prop_assert!(first.q_d.iter().zip(&from).all(|(a, b)| (a - b).abs() < 1e-9));
            prop_assert_eq!(last.q_d, to);
            prop_assert!(last.dq_d.iter().chain(&first.dq_d).all(|dq| dq.abs() < 1e-9));
            prop_assert_eq!(limits::first_excess(&points, &limits, None), None);
        }
    }
}
