//! Plans one excitation clip: a motion of some kind around the pose the arm stands in, as large as asked for or as the limits
//! of joints, torque and floor allow. Pure: no clock, no shared memory. Units: rad, s, N m, m.
//!
//! Called by the capture verb; what it returns is streamed as it is.

use super::body::Body;
use super::excess::{Excess, Quantity};
use super::limits::LIMITS_SHARE;
use super::rate::RATE;
use super::request::Request;
use super::shape::Shape;
use super::stream::Motion;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{JointLimits, JointState};

/// Distance kept from the stops [rad, or m of a joint that slides].
const STOP_MARGIN: f64 = 0.05;
/// Smallest amplitude worth recording [rad].
const MIN_AMPLITUDE: f64 = 0.01;
/// How much smaller each try is, where limits couple the joints.
const AMPLITUDE_STEP: f64 = 0.95;

/// A clip's motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// One set point a control cycle; the first and the last are at rest in the start pose.
    pub set_points: Vec<SetPoint>,
    /// Number of joints.
    pub dof: usize,
    /// Largest excursion of each joint [rad].
    pub amplitude: Vec<f64>,
    /// What made an amplitude smaller than asked for: the last limit met, by joint.
    pub bound_by: Vec<Option<Quantity>>,
    /// Largest commanded speed of any joint [rad/s].
    pub peak_speed: f64,
}

impl Plan {
    /// What is streamed of it.
    pub fn motion(&self) -> Motion<'_> {
        Motion { set_points: &self.set_points, dof: self.dof }
    }
}

/// No motion can be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The arm stands where no motion may start.
    #[error(
        "the arm stands outside the limits ({0}); move it away from there, in a simulation by `q` of [simulation] in cell.toml, then start again"
    )]
    Start(Excess),
    /// Not even a tiny motion fits.
    #[error(
        "no motion worth recording fits around this pose ({0}); move the arm away from there, in a simulation by `q` of [simulation] in cell.toml, then start again"
    )]
    NoRoom(Excess),
}

/// Plans the clip. Amplitudes that do not fit are made smaller, each joint's by its own limits, all of them by torque and height.
///
/// # Errors
/// [`PlanError`] with joint, value and limit when the start pose breaks a limit or leaves no room.
pub fn plan(request: &Request, limits: &[JointLimits], body: &Body) -> Result<Plan, PlanError> {
    let dof = limits.len();
    if let Some(excess) = rest_excess(&request.start, request.floor, limits, body) {
        return Err(PlanError::Start(excess));
    }
    let refuse = |q: &Joints| rest_excess(q, request.floor, limits, body);
    let shape = Shape::draw(request, limits, body, refuse).map_err(PlanError::NoRoom)?;
    let samples = Samples::of(&shape, &request.moving, dof);
    let mut scale: Vec<f64> = samples.peaks.iter().map(|peak| if *peak > 0.0 { 1.0 } else { 0.0 }).collect();
    let mut bound_by = vec![None; dof];
    let mut shrink = |scale: &mut [f64], joint: usize, excess: Excess| {
        let peak = samples.peaks[joint];
        if peak > 0.0 {
            scale[joint] *= AMPLITUDE_STEP;
            bound_by[joint] = Some(excess.quantity);
        }
        if peak > 0.0 && scale[joint] * peak < MIN_AMPLITUDE { Err(PlanError::NoRoom(excess)) } else { Ok(()) }
    };
    for joint in (0..dof).filter(|joint| samples.peaks[*joint] > 0.0) {
        while let Some(excess) = samples.joint_excess(joint, request.start[joint], scale[joint], &limits[joint]) {
            shrink(&mut scale, joint, excess)?;
        }
    }
    // Round and round until a whole round meets no limit: most of a motion is far from all of them.
    let (mut at, mut free) = (0, 0);
    while free < samples.len() {
        match samples.body_excess(at, request, &scale, limits, body) {
            None => (at, free) = ((at + 1) % samples.len(), free + 1),
            Some(excess) => {
                (0..dof).try_for_each(|joint| shrink(&mut scale, joint, excess))?;
                free = 0;
            }
        }
    }
    let set_points = samples.set_points(&request.start, &scale);
    let amplitude = scale.iter().zip(&samples.peaks).map(|(scale, peak)| scale * peak).collect();
    Ok(Plan { peak_speed: peak_speed(&set_points), set_points, dof, amplitude, bound_by })
}

/// Largest speed of any joint [rad/s].
pub fn peak_speed(set_points: &[SetPoint]) -> f64 {
    set_points.iter().flat_map(|p| p.dq_d).fold(0.0, |peak: f64, dq| peak.max(dq.abs()))
}

/// Which limit the arm breaks where it stands still in a pose.
pub fn rest_excess(q: &Joints, floor: f64, limits: &[JointLimits], body: &Body) -> Option<Excess> {
    let beyond = q.iter().zip(limits).enumerate().find_map(|(joint, (&q, limits))| position_excess(joint, q, limits));
    beyond.or_else(|| pose_excess(&JointState::at_rest(*q), &[0.0; MAX_JOINTS], floor, limits, body))
}

fn position_excess(joint: usize, q: f64, limits: &JointLimits) -> Option<Excess> {
    let [lo, hi] = [limits.q_min + STOP_MARGIN, limits.q_max - STOP_MARGIN];
    let limit = if q < lo { lo } else { hi };
    let quantity = if limits.slides { Quantity::Travel } else { Quantity::Position };
    (!(lo..=hi).contains(&q)).then_some(Excess { joint: Some(joint), quantity, value: q, limit })
}

/// What torque and floor say about one moment.
fn pose_excess(state: &JointState, ddq: &Joints, floor: f64, limits: &[JointLimits], body: &Body) -> Option<Excess> {
    let lowest = body.lowest_point(&state.q);
    if lowest < floor {
        return Some(Excess { joint: None, quantity: Quantity::Height, value: lowest, limit: floor });
    }
    let torque = body.torque(state, ddq);
    torque.iter().zip(limits).enumerate().find_map(|(joint, (tau, limits))| {
        let limit = LIMITS_SHARE * limits.torque;
        (tau.abs() > limit).then_some(Excess {
            joint: Some(joint),
            quantity: Quantity::Torque,
            value: tau.abs(),
            limit,
        })
    })
}

/// The shape at each control cycle: value, speed, acceleration and jerk by joint, as asked for.
struct Samples {
    joints: Vec<Vec<[f64; 4]>>,
    /// Largest magnitude of each joint's values; 0 where it holds.
    peaks: Vec<f64>,
}

impl Samples {
    fn of(shape: &Shape, moving: &[bool; MAX_JOINTS], dof: usize) -> Self {
        let duration = shape.duration();
        let last = (duration * RATE).round() as u32;
        let at = |joint: usize, i: u32| match moving[joint] {
            true => shape.at(joint, f64::from(i) * duration / f64::from(last)),
            false => [0.0; 4],
        };
        let joints: Vec<Vec<[f64; 4]>> = (0..dof).map(|j| (0..=last).map(|i| at(j, i)).collect()).collect();
        let peaks = joints.iter().map(|all| all.iter().fold(0.0, |peak: f64, x| peak.max(x[0].abs()))).collect();
        Self { joints, peaks }
    }

    fn len(&self) -> usize {
        self.joints.first().map_or(0, Vec::len)
    }

    /// First sample of `joint` beyond its own limits at this share of what was asked for.
    fn joint_excess(&self, joint: usize, start: f64, scale: f64, limits: &JointLimits) -> Option<Excess> {
        self.joints[joint].iter().find_map(|shape| {
            let [dx, dq, ddq, dddq] = shape.map(|x| scale * x);
            let q = start + dx;
            let [slowest, fastest] = limits.speed_bounds(q);
            let speed_limit = LIMITS_SHARE * if dq < 0.0 { -slowest } else { fastest };
            let checks = [
                (Quantity::Speed, dq.abs(), speed_limit),
                (Quantity::Acceleration, ddq.abs(), LIMITS_SHARE * limits.acceleration),
                (Quantity::Jerk, dddq.abs(), LIMITS_SHARE * limits.jerk),
            ];
            let beyond = checks.into_iter().find(|(_, value, limit)| value > limit);
            position_excess(joint, q, limits).or(beyond.map(|(quantity, value, limit)| Excess {
                joint: Some(joint),
                quantity,
                value,
                limit,
            }))
        })
    }

    /// What the whole arm meets of torque and floor at a sample.
    fn body_excess(
        &self,
        sample: usize,
        request: &Request,
        scale: &[f64],
        limits: &[JointLimits],
        body: &Body,
    ) -> Option<Excess> {
        let (state, ddq) = self.moment(sample, &request.start, scale);
        pose_excess(&state, &ddq, request.floor, limits, body)
    }

    /// Desired state and acceleration of sample `i`.
    fn moment(&self, i: usize, start: &Joints, scale: &[f64]) -> (JointState, Joints) {
        let (mut state, mut ddq) = (JointState::at_rest(*start), [0.0; MAX_JOINTS]);
        for (joint, scale) in scale.iter().enumerate() {
            let [x, dx, ddx, _] = self.joints[joint][i];
            state.q[joint] += scale * x;
            state.dq[joint] = scale * dx;
            ddq[joint] = scale * ddx;
        }
        (state, ddq)
    }

    fn set_points(&self, start: &Joints, scale: &[f64]) -> Vec<SetPoint> {
        let point = |i| {
            let (JointState { q, dq }, _) = self.moment(i, start, scale);
            SetPoint { q_d: q, dq_d: dq }
        };
        (0..self.len()).map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::limits::shipped;
    use super::super::request::Kind;
    use super::*;
    use proptest::prelude::*;

    const ALL: [bool; MAX_JOINTS] = [true; MAX_JOINTS];

    fn request(start: Joints) -> Request {
        Request { start, kind: Kind::Multisine, moving: ALL, amplitude: 0.3, duration: 4.0, seed: 1, floor: 0.05 }
    }

    /// Checks set points as a robot does, by differences from cycle to cycle, against the full limits.
    fn assert_inside(plan: &Plan, limits: &[JointLimits], body: &Body, floor: f64) {
        let q = |i: usize, joint: usize| plan.set_points[i].q_d[joint];
        let speed = |i: usize, joint: usize| (q(i, joint) - q(i - 1, joint)) * RATE;
        let acceleration = |i: usize, joint: usize| (speed(i, joint) - speed(i - 1, joint)) * RATE;
        for (joint, limits) in limits.iter().enumerate() {
            for i in 3..plan.set_points.len() {
                let [slowest, fastest] = limits.speed_bounds(q(i, joint));
                let jerk = (acceleration(i, joint) - acceleration(i - 1, joint)) * RATE;
                assert!((limits.q_min..=limits.q_max).contains(&q(i, joint)), "joint {joint} at {i}: {}", q(i, joint));
                assert!((slowest..=fastest).contains(&speed(i, joint)), "joint {joint} at {i}: {}", speed(i, joint));
                assert!(acceleration(i, joint).abs() <= limits.acceleration, "joint {joint} at {i}");
                assert!(jerk.abs() <= limits.jerk, "joint {joint} at {i}: {jerk}");
                assert!((plan.set_points[i].dq_d[joint] - speed(i, joint)).abs() < limits.acceleration / RATE);
            }
        }
        for i in (2..plan.set_points.len()).step_by(7) {
            let point = &plan.set_points[i];
            let mut ddq = [0.0; MAX_JOINTS];
            (0..limits.len()).for_each(|joint| ddq[joint] = acceleration(i, joint));
            let tau = body.torque(&JointState { q: point.q_d, dq: point.dq_d }, &ddq);
            assert!(tau.iter().zip(limits).all(|(tau, limits)| tau.abs() <= limits.torque), "at {i}: {tau:?}");
            assert!(body.lowest_point(&point.q_d) >= floor, "at {i}");
        }
    }

    /// Plans around a place between the stops and checks every limit, the ends and the joints that are to hold.
    fn check_plan(kind: Kind, place: [f64; 7], asked: (f64, f64, u64), still: usize) -> Result<(), TestCaseError> {
        let (body, limits) = shipped();
        let (amplitude, duration, seed) = asked;
        let mut start = [0.0; MAX_JOINTS];
        for (joint, limits) in limits.iter().enumerate() {
            start[joint] = limits.q_min + place[joint] * (limits.q_max - limits.q_min);
        }
        let mut moving = ALL;
        moving[still] = false;
        let request = Request { start, kind, moving, amplitude, duration, seed, floor: 0.05 };
        // Too many refusals fail the test: then it would show nothing.
        let Ok(plan) = plan(&request, &limits, &body) else { return Err(TestCaseError::reject("no room")) };
        assert_inside(&plan, &limits, &body, request.floor);
        let (first, last) = (&plan.set_points[0], &plan.set_points[plan.set_points.len() - 1]);
        for point in [first, last] {
            prop_assert!(point.q_d.iter().zip(&start).all(|(q, start)| (q - start).abs() < 1e-12));
            prop_assert!(point.dq_d.iter().all(|dq| dq.abs() < 1e-9));
        }
        prop_assert!(plan.set_points.iter().all(|point| point.q_d[still] == start[still]));
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn every_plan_respects_every_limit(
            seed in any::<u64>(),
            place in proptest::array::uniform7(0.02..0.98_f64),
            amplitude in 0.05..1.5_f64,
            duration in 2.0..6.0_f64,
            still in 0..8_usize,
        ) {
            check_plan(Kind::Multisine, place, (amplitude, duration, seed), still)?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]
        #[test]
        fn every_chirp_respects_every_limit(
            seed in any::<u64>(),
            place in proptest::array::uniform7(0.2..0.8_f64),
            (lo, hi) in (0.1..1.0_f64, 2.0..40.0_f64),
            amplitude in 0.05..1.0_f64,
        ) {
            check_plan(Kind::Chirp { frequency: [lo, hi] }, place, (amplitude, 5.0, seed), 3)?;
        }

        #[test]
        fn every_ramp_respects_every_limit(
            seed in any::<u64>(),
            place in proptest::array::uniform7(0.2..0.8_f64),
            (lo, hi) in (0.005..0.1_f64, 0.2..2.0_f64),
            amplitude in 0.05..1.0_f64,
        ) {
            check_plan(Kind::Ramp { speeds: [lo, hi] }, place, (amplitude, 12.0, seed), 7)?;
        }

        #[test]
        fn every_hold_respects_every_limit(
            seed in any::<u64>(),
            place in proptest::array::uniform7(0.2..0.8_f64),
            poses in 1..4_usize,
            amplitude in 0.05..1.0_f64,
        ) {
            check_plan(Kind::Hold { poses }, place, (amplitude, 10.0, seed), 0)?;
        }
    }

    #[test]
    fn in_the_ready_pose_a_moderate_motion_is_played_as_asked() {
        let (body, limits) = shipped();
        let plan = plan(&Request { amplitude: 0.1, duration: 8.0, ..request(*body.model().ready()) }, &limits, &body);
        let plan = plan.expect("room");
        assert_eq!(plan.set_points.len(), 8001);
        assert_eq!(plan.bound_by, [None; 7]);
        let reached = |joint: usize| {
            let start = body.model().ready()[joint];
            plan.set_points.iter().map(|p| (p.q_d[joint] - start).abs()).fold(0.0, f64::max)
        };
        assert!((0..7).all(|joint| (reached(joint) - 0.1).abs() < 1e-6));
    }

    #[test]
    fn what_is_too_much_is_made_smaller_and_the_limit_named() {
        let (body, limits) = shipped();
        let plan = plan(&Request { amplitude: 2.0, ..request(*body.model().ready()) }, &limits, &body).expect("room");
        assert!(plan.amplitude.iter().all(|a| *a < 2.0));
        assert!(plan.bound_by.iter().all(Option::is_some), "{:?}", plan.bound_by);
    }

    #[test]
    fn a_start_beyond_a_stop_is_refused_with_joint_value_and_limit() {
        let (body, limits) = shipped();
        let mut start = *body.model().ready();
        start[3] = -0.12;
        let error = plan(&request(start), &limits, &body).unwrap_err().to_string();
        assert!(error.contains("joint 4: position -0.1200 rad, limit -0.1669 rad"), "{error}");
        assert!(error.contains("`q` of [simulation]"), "{error}");
        let mut slides = limits;
        slides[3].slides = true;
        let error = plan(&request(start), &slides, &body).unwrap_err().to_string();
        assert!(error.contains("joint 4: position -0.1200 m, limit -0.1669 m"), "{error}");
    }

    #[test]
    fn a_start_below_the_floor_is_refused() {
        let (body, limits) = shipped();
        let start = *body.model().ready();
        let error = plan(&Request { floor: 1.0, ..request(start) }, &limits, &body).unwrap_err();
        assert!(matches!(error, PlanError::Start(Excess { quantity: Quantity::Height, .. })), "{error}");
    }
}
